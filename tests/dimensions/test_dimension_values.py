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


ABSENT_WITHOUT_A_TIP = ("electronics.tip_circuit",)
"""mini20 has no strip at the tip, hence no circuit of its board."""


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
        for name, value in d.inputs(entry.name):
            absent = name in d.given or name in ABSENT_WITHOUT_A_TIP
            assert value is not None or absent, (entry.name, name)
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
    assert d["guide.blank_width_mm"] == pytest.approx(21 + 2 + 2 * 5 + math.pi * 7.5)
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
    """A lens focused on s has its image at v, and 3.6288 mm of sensor are 640 px."""
    d = mini20()
    image_mm = 1 / (1 / 3.6 - 1 / d["view.focus_mm"])
    assert d["view.image_distance_mm"] == pytest.approx(image_mm, rel=1e-12)
    assert d["view.focal_px"] == pytest.approx(image_mm / 3.6288 * 640)
    assert d["view.across_fov_deg"] == pytest.approx(fov_deg(3.6288, image_mm))
    assert d["view.along_fov_deg"] == pytest.approx(fov_deg(2.7216, image_mm))
    assert d["view.aperture_mm"] == pytest.approx(3.6 / 2.9)
    # At infinity the sheet has 53.5 x 41.4 degrees; here the view is narrower by a tenth.
    assert fov_deg(3.6288, 3.6) == pytest.approx(53.5, abs=0.05)
    assert 1.11 < fov_deg(3.6288, 3.6) / d["view.across_fov_deg"] < 1.15


def fov_deg(side_mm: float, image_mm: float) -> float:
    return 2 * math.degrees(math.atan(side_mm / 2 / image_mm))


INSIDE = {
    "camera.focusing": "internal",
    "camera.horizontal_fov_deg": 50.0,
    "camera.field_of_view_at_mm": 30.0,
}


def test_a_lens_that_focuses_inside_has_the_scale_of_its_sheet_and_stays_in_place() -> None:
    d = mini20(INSIDE)
    assert d["view.across_fov_deg"] == pytest.approx(50.0)
    assert d["view.focal_px"] == pytest.approx(320 / math.tan(math.radians(25)))
    assert d["view.lens_extension_mm"] == d["view.lens_travel_mm"] == 0
    assert d["camera_pose.face_mm"] == d["camera.lens_height_mm"]


def test_a_fixed_lens_is_sharp_where_it_was_made_to_be() -> None:
    """Its blur at the two edges is no longer equal, and its sensor stays at the sheet's place."""
    fixed = {"camera.focusing": "fixed", "camera.focus_distance_mm": 40.0}
    d = mini20({**fixed, "design.optics.blur_per_diameter": 1.0})
    assert d["view.focus_mm"] == 40.0
    assert d["view.image_distance_mm"] == pytest.approx(3.6 * 40 / 36.4)
    assert d["view.lens_travel_mm"] == 0
    for edge in ("near", "far"):
        away = max(abs(d[f"view.{edge}_{fan}_mm"] - 40.0) for fan in ("sagittal", "tangential"))
        assert d[f"view.{edge}_blur_mm"] == pytest.approx(3.6 / 2.9 * away / 40)


def test_the_field_of_view_of_a_sheet_may_hold_for_a_distance() -> None:
    """The same lens, measured at infinity and at 100 mm: 1/f = 1/100 + 1/v."""
    near = 1 / (1 / 3.6 - 1 / 100)
    sheets = [
        {"camera.horizontal_fov_deg": fov_deg(3.5, 3.6)},
        {
            "camera.horizontal_fov_deg": fov_deg(3.5, near),
            "camera.field_of_view_at_mm": 100.0,
        },
    ]
    first, second = (mini20(changes) for changes in sheets)
    assert first["view.sensor_across_mm"] == pytest.approx(3.5)
    assert second["view.sensor_across_mm"] == pytest.approx(3.5)
    assert second["view.across_fov_deg"] == pytest.approx(first["view.across_fov_deg"])


def test_the_lens_moves_out_with_its_pupil_and_its_front() -> None:
    """The pupil 0.5 mm behind the front: the camera stands back by what lies before the pupil."""
    front, behind = mini20(), mini20({"camera.entrance_pupil_mm": 1.0})
    for d, pupil in ((front, 1.5), (behind, 1.0)):
        assert d["camera_pose.face_mm"] == pytest.approx(pupil + d["view.lens_extension_mm"])
        assert d["camera_pose.lens_front_mm"] == pytest.approx(1.5 - pupil)
    barrel = behind["camera_pose.face_mm"] + behind["camera_pose.lens_front_mm"]
    assert barrel == pytest.approx(1.5 + behind["view.lens_extension_mm"])


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
    for edge, end in (("near", -x), ("far", x)):
        seen = camera.apparent_distances_mm([(end, 0, 0), (end, y, 0), (end, -y, 0)])
        assert seen[0, 0] == pytest.approx(d[f"view.{edge}_distance_mm"], rel=1e-9)
        assert seen.max() == pytest.approx(d[f"view.{edge}_sagittal_mm"], rel=1e-9)
        assert seen.min() == pytest.approx(d[f"view.{edge}_tangential_mm"], rel=1e-9)


def test_best_focus_blurs_the_nearest_and_the_farthest_image_alike() -> None:
    d = mini20()
    s, near, far = (d[f"view.{k}_mm"] for k in ("focus", "near_tangential", "far_sagittal"))
    assert abs(near - s) / near == pytest.approx(abs(far - s) / far)
    f = d["camera.focal_length_mm"]
    # Thin lens 1/f = 1/s + 1/v; the extension is v - f.
    assert d["view.lens_extension_mm"] == pytest.approx(1 / (1 / f - 1 / s) - f)
