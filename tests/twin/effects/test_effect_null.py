"""An effect whose parameters do nothing is the effect left out, bit for bit, scene to frame."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sampled import quick
from scene_samples import ROOT
from sim_rig import small_sensor

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

NULL: dict[str, dict[str, Any]] = {
    "friction": {},
    "relaxation": {"terms": []},
    "viscoelasticity": {"terms": []},
    "sliding_friction": {},
    "adhesion": {},
    "lens_distortion": {},
    "marker_print": {"jitter_mm": 0, "missing_percent": 0, "odd_percent": 0},
    "shading": {"ambient_share": 1},
    "dirt": {"specks": 0, "hairs": 0},
    "specular": {"spots": 0},
    "motion_blur": {"shutter_ms": 0},
    "exposure": {"time": 1, "gain": 1, "gamma": 1},
    "sensor_noise": {"full_well_electrons": 0},
    "compression": {},
}
"""Refraction and defocus stand in the sensor; their tests are with the camera and the renderer."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("null")
    small_sensor(place)
    return place


def scene(effects: dict[str, Any]) -> dict[str, Any]:
    return {
        "format": "gelslim-scene/1",
        "name": "null",
        "sensor": {"bundle": "bundle"},
        "indenters": [{"shape": "sphere", "radius_mm": 6}],
        "motion": {
            "waypoints": [
                {"move": "press", "depth_mm": 0.25, "steps": 2, "duration_s": 0.1},
                {"move": "shear", "x_mm": 0.2, "steps": 1, "duration_s": 0.3},
            ]
        },
        "observe": ["displacement", "force", "markers", "image"],
        "effects": {"nonlinearity": "off"} | effects,
        "seed": 3,
    }


@cache
def _sensor(place: Path) -> TwinSensor:
    return TwinSensor(load_bundle(place))


MECHANICS = ("normal_contact", "friction", "nonlinearity", "relaxation", "viscoelasticity",
             "sliding_friction", "adhesion")  # fmt: skip
_solved: dict[tuple[Any, ...], list[GelState]] = {}


def _states(folder: Path, plan: Plan, loaded: LoadedScene) -> list[GelState]:
    """States of all poses; plans whose mechanics are the same share them."""
    chosen = [plan.choice(name) for name in plan.order if name in MECHANICS]
    key = (folder, *((c.effect, c.rung, *c.rung_parameters) for c in chosen))
    if key not in _solved:
        sensor = _sensor(folder / "bundle")
        pad = SurfaceCompliance(sensor.bundle)
        _solved[key] = list(mechanics_of(loaded, plan, pad).states(loaded.poses))
    return _solved[key]


def outcome(folder: Path, effects: dict[str, Any]) -> tuple[tuple[str, ...], bytes]:
    """The plan's order, and every array that comes of the last pose."""
    path = folder / "scene.yaml"
    path.write_text(json.dumps(scene(effects)))
    loaded, sensor = read_scene(path), _sensor(folder / "bundle")
    plan = plan_scene(loaded, bundle_figures(folder / "bundle"))
    states = _states(folder, plan, loaded)
    viewer = Viewer(sensor, plan, loaded.scene)
    frame = viewer.frame(states[-1], states[-2], 3, 0.3)
    arrays = (*(a for s in states for a in (s.displacement_mm, s.force_n)), frame.image)
    return plan.order, b"".join(
        np.ascontiguousarray(a).tobytes() for a in (*arrays, viewer.markers_px(states[-1]))
    )


DRAWN = ("motion_blur", "exposure", "sensor_noise", "marker_print", "dirt", "specular")
"""Tried in every run on the renderer alone, in the tests of its effects."""
SOLVED = ("viscoelasticity", "sliding_friction", "adhesion")
"""Tried in every run on the contact alone, in the tests of these contacts."""


@pytest.mark.parametrize("name", quick(sorted(NULL), lambda name: name not in (*DRAWN, *SOLVED)))
def test_switched_on_with_nothing_to_do_it_changes_nothing(folder: Path, name: str) -> None:
    on_order, on = outcome(folder, {name: {"use": "on", **NULL[name]}})
    off_order, off = outcome(folder, {name: {"use": "off"}})
    assert name in on_order
    assert name not in off_order
    assert on == off


def test_what_does_nothing_is_left_out_by_itself(folder: Path) -> None:
    order, _ = outcome(folder, NULL)
    assert not set(NULL) & set(order)


def test_solving_a_bare_press_loads_no_other_mechanics(folder: Path) -> None:
    text = scene({"sensor_noise": "off"}) | {"observe": ["force"]}
    (folder / "bare.yaml").write_text(json.dumps(text))
    code = f"""
import sys
from pathlib import Path
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.effects.registry import EFFECTS
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance
place = Path({str(folder)!r})
loaded = read_scene(place / "bare.yaml")
plan = plan_scene(loaded, bundle_figures(place / "bundle"))
sensor = TwinSensor(load_bundle(place / "bundle"))
pad = SurfaceCompliance(sensor.bundle)
assert len(list(mechanics_of(loaded, plan, pad).states(loaded.poses))) == 4
absent = [e.implementation for e in EFFECTS if e.name not in plan.order]
absent += ["gelslim_twin.contact.coulomb_kernel", "gelslim_twin.contact.corrected_contact"]
assert "gelslim_twin.contact.coulomb_contact" in absent
assert "gelslim_twin.contact.nonlinear" in absent and "gelslim_twin.contact.relaxation" in absent
print(plan.order, [m for m in absent if m in sys.modules])
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "('normal_contact',) []"
