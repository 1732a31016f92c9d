"""Single dimensions against their closed forms, and the virtual camera against the fold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fold_samples import mini20, shipped

from gelslim_cad.dimensions import definition, derive
from gelslim_cad.dimensions.dimensions import ORDER, PATHS
from gelslim_cad.dimensions.registry import REGISTRY
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_optics.camera.virtual_camera import reflect_direction, reflect_point

DESIGN_NAMES = ["mini20", "gelslim2"]


def test_every_dimension_is_titled_explained_and_has_known_inputs() -> None:
    d = mini20()
    assert len(ORDER) == len(REGISTRY) > 70
    seen: set[str] = set()
    for entry in ORDER:
        assert len(entry.title) > 3, entry.name
        assert entry.formula.strip(), entry.name
        for parameter in entry.inputs:
            assert parameter in PATHS or parameter in seen, (entry.name, parameter)
        seen.add(entry.identifier)
        assert definition(entry.name) is entry
        assert all(value is not None or name in d.given for name, value in d.inputs(entry.name))
    finite = {name: value for name, value in d.values.items() if not math.isfinite(value)}
    assert finite == {}


def test_units_follow_from_names() -> None:
    assert definition("finger.thickness_mm").unit == "mm"
    assert definition("view.tilt_deg").unit == "°"
    assert definition("view.focal_px").unit == "px"
    assert definition("led.count").unit == ""


@pytest.mark.parametrize("name", ["finger.colour", "finger_thickness_mm", "design.gel.length_mm"])
def test_unknown_dimensions_are_refused(name: str) -> None:
    with pytest.raises(KeyError, match=name.replace(".", r"\.")):
        definition(name)


def test_guide_by_hand() -> None:
    # t = 3, R/t = 2 on a gel 20 wide, margins 0.5, legs 1: R 6, outer 9, flat 21.
    d = mini20(
        {
            "design.light_guide.thickness_mm": 3.0,
            "design.light_guide.bend_radius_ratio": 2.0,
            "design.light_guide.leg_length_mm": 1.0,
            "design.light_guide.side_margin_mm": 0.5,
            "design.gel.thickness_mm": 2.0,
        }
    )
    assert d["guide.inner_radius_mm"] == 6
    assert d["guide.outer_radius_mm"] == 9
    assert d["guide.flat_width_mm"] == 21
    assert d["guide.outer_width_mm"] == 39
    assert d["guide.leg_end_z_mm"] == -12
    assert d["guide.blank_width_mm"] == pytest.approx(21 + 2 + math.pi * 7.5)
    assert d["led.y_mm"] == pytest.approx(10.5 + 7.5)
    assert d["stack.window_bottom_z_mm"] == -5
    # R + leg + two gaps of 0.2 + LED 0.7 + board 0.8.
    assert d["guide.stack_mm"] == pytest.approx(6 + 1 + 0.4 + 0.7 + 0.8)


@pytest.mark.parametrize(
    ("length_mm", "pitch_mm", "most", "expected"),
    [(20, 5, 12, 4), (20, 4.9, 12, 5), (20.01, 5, 12, 5), (30, 1, 12, 12), (10, 50, 12, 1)],
)
def test_led_count(length_mm: float, pitch_mm: float, most: int, expected: int) -> None:
    d = mini20(
        {
            "design.gel.length_mm": length_mm,
            "design.leds.max_pitch_mm": pitch_mm,
            "design.leds.max_count": most,
        }
    )
    assert d["led.count"] == expected
    assert d["led.pitch_mm"] == pytest.approx(length_mm / expected)


def test_camera_figures_by_hand() -> None:
    d = mini20()
    assert d["view.focal_px"] == pytest.approx(3.6 / (3.6288 / 640))
    assert d["view.across_fov_deg"] == pytest.approx(53.5, abs=0.05)
    assert d["view.along_fov_deg"] == pytest.approx(41.41, abs=0.05)
    assert d["view.aperture_mm"] == pytest.approx(3.6 / 2.9)


@pytest.mark.parametrize("name", DESIGN_NAMES)
def test_thickness_adds_up(name: str) -> None:
    d = derive(shipped(name))
    layers = d["design.light_guide.thickness_mm"] + d["stack.gel_total_mm"]
    assert d["finger.thickness_mm"] == pytest.approx(
        d["design.housing.back_wall_mm"] + d["finger.depth_mm"] + layers
    )
    needs = (d["finger.mirror_depth_mm"], d["finger.camera_depth_mm"], d["guide.stack_mm"])
    assert d["finger.depth_mm"] == pytest.approx(max(needs))


@pytest.mark.parametrize("name", DESIGN_NAMES)
def test_camera_mirrored_at_the_fold_is_the_virtual_camera(name: str) -> None:
    d = derive(shipped(name))
    angle, pitch = math.radians(d["mirror.angle_deg"]), math.radians(d["camera_pose.pitch_deg"])
    normal = np.array([-math.sin(angle), 0, math.cos(angle)])
    for end in ("upper", "lower"):
        on_mirror = [d[f"mirror.{end}_x_mm"], 0, d[f"mirror.{end}_z_mm"]]
        place = reflect_point([d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]], on_mirror, normal)
        expected = [d["view.virtual_x_mm"], 0, d["view.virtual_z_mm"]]
        np.testing.assert_allclose(place, expected, atol=1e-9)
    axis = reflect_direction([math.cos(pitch), 0, -math.sin(pitch)], normal)
    tilt = math.radians(d["view.tilt_deg"])
    np.testing.assert_allclose(axis, [math.sin(tilt), 0, math.cos(tilt)], atol=1e-12)


@pytest.mark.parametrize("name", DESIGN_NAMES)
def test_the_whole_gel_is_in_the_image_its_near_edge_on_top(name: str) -> None:
    d = derive(shipped(name))
    camera = virtual_camera(d)
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    side = np.linspace(-1, 1, 21)
    rim = [(a * x, b * y, 0.0) for a in side for b in side]
    pixels = camera.project(rim)
    size = np.array([d["camera.image_width_px"], d["camera.image_height_px"]])
    half = np.abs(pixels - (size - 1) / 2).max(axis=0) / (size / 2)
    assert np.all(half <= 1 - d["design.optics.image_margin"] + 1e-6)
    assert half == pytest.approx([d["view.across_use"], d["view.along_use"]], abs=1e-6)
    near, far = camera.project([(-x, 0, 0), (x, 0, 0)])
    assert near[1] < far[1]
    # -y, where the red LEDs are, is on the left.
    left, right = camera.project([(0, -y, 0), (0, y, 0)])
    assert left[0] < right[0]
    ends = camera.apparent_distance_mm([(-x, 0, 0), (x, 0, 0)])
    expected = [d["view.near_distance_mm"], d["view.far_distance_mm"]]
    assert ends == pytest.approx(expected, rel=1e-9)


def test_best_focus_blurs_both_edges_alike_in_the_image() -> None:
    d = mini20()
    s, near, far = (d[f"view.{k}_mm"] for k in ("focus", "near_distance", "far_distance"))
    assert abs(near - s) / near == pytest.approx(abs(far - s) / far)
    f = d["camera.focal_length_mm"]
    # Thin lens 1/f = 1/s + 1/v; the extension is v - f.
    assert d["view.lens_extension_mm"] == pytest.approx(1 / (1 / f - 1 / s) - f)
