"""Each rule between fields, of the spec and of scenes, is broken by a fault and enforced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gelslim_cad.spec import Spec
from gelslim_cad.spec.reference import RULES as SPEC_RULES
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.reader import load_bytes
from gelslim_twin.scene.reader import RULES as SCENE_RULES
from gelslim_twin.scene.scene import Scene

SPEC = """\
format: gelslim-spec/1
name: finger
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 24, width_mm: 22}
"""
SCENE = """\
format: gelslim-scene/1
name: press
sensor: {spec: finger.yaml}
indenters: [{shape: sphere, radius_mm: 4}]
motion: {waypoints: [{move: press, depth_mm: 0.5}]}
observe: [force]
"""


OWN_LED = """\
electronics: {own_forward_v: [2, 3], own_test_current_ma: 20, own_max_current_ma: 30,
              own_thermal_k_per_w: 200, own_max_junction_c: 100}
"""
SPEC_FAULTS: tuple[tuple[str, Callable[[str], str]], ...] = (
    ("camera", lambda t: t.replace("image_width_px: 640, ", "model: ov9821, ")),
    ("camera", lambda t: t.replace("image_width_px: 640", "mode: 640x480, image_width_px: 640")),
    ("camera", lambda t: t.replace("640", "400")),
    ("camera", lambda t: t.replace("3.6288", "3.9")),
    ("camera", lambda t: t.replace("f_number: 2.9", "f_number: 2.9, vertical_fov_deg: 60")),
    ("camera", lambda t: t.replace("f_number: 2.9", "f_number: 2.9, lens_diameter_mm: 9")),
    ("camera", lambda t: t.replace("f_number: 2.9", "f_number: 2.9, distortion: {k1: -1}")),
    ("camera.distortion", lambda t: t.replace("2.9}", "2.9, distortion: {k4: 0.1}}")),
    ("camera.distortion", lambda t: t.replace("2.9}", "2.9, distortion: {k1: 1, tv_percent: 1}}")),
    ("design.gel", lambda t: t.replace("width_mm: 22}", "width_mm: 22, corner_radius_mm: 11.5}")),
    ("design.leds", lambda t: t + "  leds: {emission: table}\n"),
    ("design.leds", lambda t: t + "  leds: {light: white, one_wavelength_nm: 850}\n"),
    ("design.markers", lambda t: t + "  markers: {rows: 40}\n"),
    ("design.markers", lambda t: t + "  markers: {pitch_mm: 0.4}\n"),
    ("parts", lambda t: t + "parts: {body: mine.stl}\n"),
    ("material.gel", lambda t: t + "material: {gel: {youngs_modulus_mpa: 147}}\n"),
    ("electronics", lambda t: t + "electronics: {own_max_current_ma: 30}\n"),
    ("electronics", lambda t: t + OWN_LED.replace("[2, 3]", "[2, 30]")),
    ("mesh", lambda t: t + "mesh: {cells_along: 30}\n"),
)
SCENE_FAULTS: tuple[tuple[str, Callable[[str], str]], ...] = (
    ("sensor", lambda t: t.replace("finger.yaml", "finger.yaml, bundle: b")),
    (
        "indenters[]: ring",
        lambda t: t.replace("sphere, radius_mm: 4", "ring, outer_radius_mm: 4, inner_radius_mm: 4"),
    ),
    ("indenters[]: flat_punch", lambda t: t.replace("sphere, radius_mm: 4", "flat_punch")),
    ("motion", lambda t: t.replace("{waypoints", "{csv: a.csv, waypoints")),
    (
        "motion",
        lambda t: t.replace(
            "[{move: press, depth_mm: 0.5}]",
            "[" + ", ".join(["{move: hold, steps: 5000}"] * 4) + "]",
        ),
    ),
    ("observe", lambda t: t.replace("[force]", "[force, force]")),
    ("vary", lambda t: t + "vary: {depth_factor: [1, 0.5]}\n"),
    ("vary", lambda t: t + "vary: {depth_factor: [0.5, 1, gamma]}\n"),
    ("vary.split", lambda t: t + "vary: {split: {validation_share: 0.6, test_share: 0.4}}\n"),
)


def _read(text: str, model: type) -> Any:
    return load_bytes("input.yaml", text.encode(), model)


def test_each_rule_between_fields_has_a_fault_that_breaks_it() -> None:
    assert [block for block, _ in SPEC_RULES] == [block for block, _ in SPEC_FAULTS]
    assert [block for block, _ in SCENE_RULES] == [block for block, _ in SCENE_FAULTS]


@pytest.mark.parametrize(
    ("text", "model", "fault"),
    [(SPEC, Spec, f) for _, f in SPEC_FAULTS] + [(SCENE, Scene, f) for _, f in SCENE_FAULTS],
)
def test_rules_between_fields_are_enforced(
    text: str, model: type, fault: Callable[[str], str]
) -> None:
    assert _read(text, model)
    broken = fault(text)
    assert broken != text
    with pytest.raises(InputError) as raised:
        _read(broken, model)
    assert len(raised.value.problems) == 1, "the fault must break this rule only"
