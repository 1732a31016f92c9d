"""The camera's seat: touched at its points alone, springs as stiff and strained as they say."""

from __future__ import annotations

from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from finger_samples import each_finger, finger, part
from scipy.integrate import solve_bvp
from shipped_fingers import DESIGNS

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.dimensions.seat import LEAST_PRELOAD_MM, MODULUS_MPA, POINT_MM, STRAIN
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import common_volume
from gelslim_cad.solids.camera import camera
from gelslim_cad.solids.clamp import camera_clamp
from gelslim_cad.solids.led_seat import uncrushed_ribs
from gelslim_cad.solids.shapes import SolidError
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.plan import with_values


def changed(design: str, **values: object) -> Dimensions:
    spec = read_spec(next(path for path in DESIGNS if path.stem == design)).spec
    return derive(with_values(spec, {n.replace("__", "."): v for n, v in values.items()}))


@each_finger
def test_the_printed_springs_reach_into_the_camera_by_their_deflection(name: str) -> None:
    """In place they touch it; as printed they overlap it at two nubs and nowhere else."""
    d = finger(name)
    if not d["clamp.preloaded"]:
        assert part(name, "camera_clamp").printed is None
        return
    assert_springs_press(d, part(name, "camera_clamp"), part(name, "camera").solid)


def assert_springs_press(d: Dimensions, clamp: Part, module: cq.Shape) -> None:
    """In place the clamp touches the camera; as printed its two nubs reach into it.

    The wider one meets the rear face by a point, or by what the cable leaves beside it.
    """
    assert common_volume(clamp.solid, module) < 1e-6
    printed = clamp.printed
    assert printed is not None
    assert printed.isValid()
    common = printed.intersect(module)
    assert len(common.Solids()) == 2
    across = max(solid.BoundingBox().ylen for solid in common.Solids())
    assert across == pytest.approx(pressed_mm(d), abs=1e-6)
    pitch = np.radians(d["camera_pose.pitch_deg"])
    forward = np.array([np.cos(pitch), 0.0, -np.sin(pitch)])
    rear = -d["camera_pose.face_mm"] - d["camera.module_depth_mm"]
    pinhole = np.array([d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]])
    ahead = [
        max((np.array(v.toTuple()) - pinhole) @ forward for v in solid.Vertices()) - rear
        for solid in common.Solids()
    ]
    # The flat nub reaches in by the deflection, the wedge at the rear edge by as much.
    assert ahead == pytest.approx([d["clamp.spring_deflection_mm"]] * 2, abs=1e-6)


def pressed_mm(d: Dimensions) -> float:
    """Width of the rear face that the flat nub meets."""
    if d["camera.cable_exit"] == "top":
        return POINT_MM
    gap = d["camera.module_width_mm"] - d["camera.cable_width_mm"]
    return min(POINT_MM, gap / 2 - d["design.housing.fit_clearance_mm"])


@pytest.mark.parametrize(
    ("exit_side", "width_mm"),
    [("bottom", 7.9), ("top", 8.5), ("rear", 7.9), ("bottom", 6.2)],
    ids=["wide at the bottom", "as wide as the module", "wide behind", "between the springs"],
)
def test_springs_press_beside_a_wide_cable(exit_side: str, width_mm: float) -> None:
    """At the top it may be as wide as the module, which it leaves above the springs."""
    d = changed("mini20", camera__cable_exit=exit_side, camera__cable_width_mm=width_mm)
    assert d["clamp.preloaded"] == 1
    assert_springs_press(d, camera_clamp(d), camera(d).solid)


@pytest.mark.parametrize("process", ["sla", "fdm", "sls"])
def test_spring_formulas_are_those_of_an_integrated_beam(process: str) -> None:
    """E I w'' = F (L - x) from a clamped root, by collocation."""
    d = changed("mini20", manufacturing__print_process=process)
    length, thick = d["clamp.spring_length_mm"], d["clamp.spring_mm"]
    inertia = d["clamp.spring_width_mm"] * thick**3 / 12

    def tip_and_strain(force: float) -> tuple[float, float]:
        def slope(x: np.ndarray, w: np.ndarray) -> np.ndarray:
            return np.vstack([w[1], force * (length - x) / (MODULUS_MPA * inertia)])

        x = np.linspace(0, length, 30)
        found = solve_bvp(slope, lambda a, b: a, x, np.zeros((2, x.size)))
        return found.y[0, -1], thick / 2 * force * length / (MODULUS_MPA * inertia)

    tip, _ = tip_and_strain(d["clamp.preload_n"] / 2)
    assert tip == pytest.approx(LEAST_PRELOAD_MM, rel=1e-6)
    per_newton, strain = tip_and_strain(1.0)
    most = d["clamp.spring_deflection_mm"] + d["manufacturing.print_tolerance_mm"]
    assert d["clamp.strain_percent"] / 100 == pytest.approx(strain * most / per_newton, rel=1e-6)
    assert d["clamp.strain_percent"] / 100 <= STRAIN[process] + 1e-12


@pytest.mark.parametrize(
    "changes",
    [
        {"design__housing__camera_seat": "loose"},
        {"camera__lens_height_mm": 0.0},
        {"camera__lens_diameter_mm": 8.0},
        {"camera__module_depth_mm": 2.0},
        {"manufacturing__print_tolerance_mm": 0.6},
        {"camera__cable_width_mm": 8.5},
        {"camera__cable_width_mm": 10.0},
        {"camera__cable_width_mm": 8.5, "camera__cable_exit": "rear"},
        {"camera__cable_width_mm": 9.0, "camera__cable_exit": "top"},
    ],
    ids=[
        *("loose", "no lips", "wide lens", "shallow", "coarse print"),
        *("wide cable", "cable beyond the springs", "wide cable behind", "wide cable on top"),
    ],
)
def test_a_camera_without_room_for_the_seat_lies_loose(changes: dict[str, object]) -> None:
    d = changed("mini20", **changes)
    assert d["clamp.preloaded"] == 0
    height, play = d["camera.module_height_mm"], d["clamp.play_mm"]
    assert d["clamp.pitch_tilt_deg"] == pytest.approx(np.degrees(2 * play / height))
    clamp = camera_clamp(d)
    assert clamp.printed is None
    assert clamp.solid.isValid()


LOW_CABLES = [
    ("gelslim2", {"design__envelope__goal": "shortest"}),
    ("mini20", {"design__gel__length_mm": 14.0, "design__gel__width_mm": 14.0}),
]
"""Fingers whose fold has to leave the cable its room above the cover."""


def with_floor(d: Dimensions, floor_mm: float) -> Dimensions:
    """The same finger with its cover so high that this floor is left under the cable."""
    value = check(d).of("cable.floor_mm").value
    assert value is not None
    top = d["cover.top_z_mm"] + value - floor_mm
    return replace(d, values=d.values | {"cover.top_z_mm": top, "clamp.base_mm": floor_mm})


@pytest.mark.parametrize(("design", "values"), LOW_CABLES)
@pytest.mark.parametrize("floor_mm", [-0.66, 0.15])
def test_a_clamp_that_its_cable_parts_is_refused_by_its_rule(
    design: str, values: dict[str, object], floor_mm: float
) -> None:
    found = changed(design, **values)
    assert check(found).of("cable.floor_mm").status == "pass"
    assert camera_clamp(found).solid.isValid()
    d = with_floor(found, floor_mm)
    rule = check(d).of("cable.floor_mm")
    assert rule.status == "fail"
    assert rule.value == pytest.approx(floor_mm, abs=1e-9)
    with pytest.raises(SolidError, match=r"camera_clamp .* cable\.floor_mm"):
        camera_clamp(d)


@pytest.mark.parametrize(("design", "values"), LOW_CABLES)
@pytest.mark.parametrize("seat", ["loose", "preloaded"])
def test_a_clamp_with_the_least_floor_is_one_solid(
    design: str, values: dict[str, object], seat: str
) -> None:
    """The cover at the height that leaves a floor as thick as the rule's limit."""
    d = changed(design, **values, design__housing__camera_seat=seat)
    rule = check(d).of("cable.floor_mm")
    assert rule.value is not None
    assert rule.limit is not None
    preloaded = float(seat == "preloaded")
    moved = with_floor(d, rule.limit + 1e-6)
    moved = replace(moved, values=moved.values | {"clamp.preloaded": preloaded})
    clamp = camera_clamp(moved)
    assert clamp.solid.isValid()
    assert (clamp.printed is not None) == (seat == "preloaded")


@pytest.mark.parametrize("seat", ["loose", "preloaded"])
@pytest.mark.parametrize("kind", ["round", "flat"])
def test_a_clamp_before_the_thickest_cable_is_one_solid(seat: str, kind: str) -> None:
    """The floor is left 1 mm before the cable; a cable as thick as the module leaves none."""
    size = "camera__cable_width_mm" if kind == "round" else "camera__cable_thickness_mm"
    cable = {
        "design__housing__camera_seat": seat,
        "camera__cable_exit": "bottom",
        "camera__cable_kind": kind,
        "camera__cable_bend_radius_mm": 0.5,
    }
    depth = changed("mini20")["camera.module_depth_mm"]
    least = changed("mini20", **cable, **{size: depth - 1.3})
    assert check(least).of("cable.depth_mm").status == "pass"
    clamp = camera_clamp(least)
    assert clamp.solid.isValid()
    assert (clamp.printed is not None) == (seat == "preloaded")
    parted = changed("mini20", **cable, **{size: depth})
    rule = check(parted).of("cable.depth_mm")
    assert rule.status == "fail"
    assert (rule.value, rule.limit) == (pytest.approx(depth + 1.3), depth)
    with pytest.raises(SolidError, match=r"camera_clamp .* cable\.depth_mm"):
        camera_clamp(parted)


@pytest.mark.parametrize(("exit_side", "status"), [("top", "fail"), ("rear", "pass")])
def test_a_cable_thicker_than_its_module_leaves_only_behind(exit_side: str, status: str) -> None:
    d = changed(
        "mini20",
        camera__cable_exit=exit_side,
        camera__cable_kind="round",
        camera__cable_width_mm=4.5,
    )
    assert check(d).of("cable.depth_mm").status == status


@each_finger
def test_led_boards_touch_their_edges_and_crush_their_ribs(name: str) -> None:
    """Pushed out by 1 µm a board overlaps the edges; it overlaps the ribs as printed."""
    d = finger(name)
    if not uncrushed_ribs(d):
        pytest.skip("no room for an edge")
    body, board = part(name, "body"), part(name, "led_board_green").solid
    assert body.printed is not None
    assert common_volume(body.solid, board) < 1e-6
    step = 1e-3
    outwards = board.translate((0, step, 0))
    thick = d["design.leds.board_thickness_mm"]
    assert common_volume(body.solid, outwards) == pytest.approx(2 * 1.5 * thick * step, rel=0.01)
    squeeze = 2 * d["clamp.point_error_mm"]
    assert common_volume(body.printed, board) == pytest.approx(2 * 0.5 * thick * squeeze, rel=0.01)
    tipwards = board.translate((step, 0, 0))
    assert common_volume(part(name, "back_cover").solid, tipwards) > 0
