"""The finger's parts: valid, apart from each other, as large as their closed forms say."""

from __future__ import annotations

import math

import cadquery as cq
import pytest
from finger_samples import each_finger, finger, part, parts_of

from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.geometry.thread import hole_diameter_mm
from gelslim_cad.proof.solids import interferences
from gelslim_cad.solids.guide import led_positions_mm
from gelslim_cad.solids.layout import Layout


def span(parts: list[Part], axis: str) -> tuple[float, float]:
    boxes = [p.solid.BoundingBox(1e-6) for p in parts]
    return (
        min(getattr(b, f"{axis}min") for b in boxes),
        max(getattr(b, f"{axis}max") for b in boxes),
    )


@each_finger
def test_every_part_is_one_valid_solid_with_a_name_of_its_own(name: str) -> None:
    parts = parts_of(name)
    assert len({p.name for p in parts}) == len(parts)
    for p in parts:
        assert p.solid.isValid(), p.name
        assert len(p.solid.Solids()) == 1, p.name
        assert p.solid.Volume() > 0, p.name


@each_finger
def test_no_two_parts_take_up_the_same_space(name: str) -> None:
    assert interferences(parts_of(name)) == []


def test_two_parts_pushed_into_each_other_are_noticed() -> None:
    parts = [part("mini20", "light_guide"), part("mini20", "gel_pad")]
    assert interferences(parts) == []
    sunk = Part(
        name="sunk",
        solid=parts[1].solid.translate(cq.Vector(0, 0, -0.1)),
        material="",
        process="cast",
        colour=(0, 0, 0, 1),
    )
    area = GelShape.of(finger("mini20")).area_mm2
    (found,) = interferences([parts[0], sunk])
    assert found.volume_mm3 == pytest.approx(0.1 * area, rel=1e-9)


@each_finger
def test_guide_mirror_and_gel_have_the_volume_of_their_closed_forms(name: str) -> None:
    d = finger(name)
    t, inner = d["design.light_guide.thickness_mm"], d["guide.inner_radius_mm"]
    flat = d["design.gel.width_mm"] + 2 * d["design.light_guide.side_margin_mm"]
    bends = math.pi / 2 * ((inner + t) ** 2 - inner**2)
    profile = t * flat + bends + 2 * t * d["design.light_guide.leg_length_mm"]
    guide = part(name, "light_guide").solid.Volume()
    assert guide == pytest.approx(profile * d["guide.length_mm"], rel=1e-9)
    # Thickness is the same all along, so the flat blank without what is trimmed from its legs holds
    # as much acrylic (neutral fibre t/2).
    trimmed = 2 * d["manufacturing.leg_trim_mm"]
    blank = (d["guide.blank_width_mm"] - trimmed) * t * d["guide.length_mm"]
    assert guide == pytest.approx(blank, rel=1e-9)

    plate = d["mirror.length_mm"] * d["mirror.width_mm"] * d["design.mirror.thickness_mm"]
    assert part(name, "mirror").solid.Volume() == pytest.approx(plate, rel=1e-9)
    gel = GelShape.of(d)
    assert part(name, "gel_pad").solid.Volume() == pytest.approx(gel.volume_mm3, rel=1e-8)


@each_finger
def test_the_finger_is_as_large_as_its_dimensions_say(name: str) -> None:
    d = finger(name)
    case = [p for p in parts_of(name) if p.name in ("body", "back_cover", "tip_bezel", "gel_pad")]
    x, y, z = (span(case, axis) for axis in "xyz")
    assert x[1] - x[0] == pytest.approx(d["finger.length_mm"], abs=1e-4)
    assert y[1] - y[0] == pytest.approx(d["finger.width_mm"], abs=1e-4)
    assert z[1] - z[0] == pytest.approx(d["finger.thickness_mm"], abs=1e-4)
    assert z[1] == pytest.approx(0, abs=1e-4)
    # Nothing but the adapter, the gripper's bolts, cable and wires reaches out of the case.
    out = ("gripper_adapter", "camera_cable", "led_wire_")
    inner = [p for p in parts_of(name) if not p.name.startswith(out)]
    for axis, limits in zip("xyz", (x, y, z), strict=True):
        low, high = span(inner, axis)
        assert low >= limits[0] - 0.02, axis
        assert high <= limits[1] + 0.02, axis


@each_finger
def test_bezel_window_surrounds_the_gel_evenly(name: str) -> None:
    d = finger(name)
    bezel, gel = part(name, "tip_bezel").solid, part(name, "gel_pad").solid
    z = (d["stack.gel_bottom_z_mm"] - d["design.housing.gel_proud_mm"]) / 2
    for half, direction in (
        (d["design.gel.length_mm"] / 2, cq.Vector(1, 0, 0)),
        (d["design.gel.width_mm"] / 2, cq.Vector(0, 1, 0)),
    ):
        for sign in (-1, 1):
            at = [
                direction * (sign * (half + offset)) + cq.Vector(0, 0, z)
                for offset in (-0.01, 0.01, 0.29, 0.31)
            ]
            assert [gel.isInside(p, 1e-6) for p in at] == [True, False, False, False]
            assert [bezel.isInside(p, 1e-6) for p in at] == [False, False, False, True]


@each_finger
def test_every_led_stands_on_its_board_under_the_leg(name: str) -> None:
    d = finger(name)
    places = led_positions_mm(d)
    assert len(places) == min(
        d["design.leds.max_count"],
        math.ceil(d["design.gel.length_mm"] / d["design.leds.max_pitch_mm"] - 1e-9),
    )
    for colour, side in (("red", -1), ("green", 1)):
        board = part(name, f"led_board_{colour}").solid
        lights = [f for f in board.Faces() if abs(f.Center().z - d["led.top_z_mm"]) < 1e-6]
        if d["led.pitch_mm"] > d["design.leds.package_mm"]:
            assert sorted(f.Center().x for f in lights) == pytest.approx(places, abs=1e-6)
        assert all(f.Center().y == pytest.approx(side * d["led.y_mm"]) for f in lights)


@each_finger
def test_screws_reach_into_their_pilots_and_do_not_bottom_out(name: str) -> None:
    d = finger(name)
    at = Layout(d)
    body = part(name, "body").solid
    for kind, holes in (("bezel", at.bezel_holes()), ("cover", at.cover_holes())):
        for k, hole in enumerate(holes):
            screw = part(name, f"{kind}_screw_{k + 1}").solid
            box = screw.BoundingBox(1e-6)
            depth = abs((box.zmin if hole.inward < 0 else box.zmax) - hole.surface_z_mm)
            assert depth == pytest.approx(hole.screw_length_mm, abs=1e-3)
            assert hole.plate_mm < depth < hole.plate_mm + hole.pilot_mm
            # Body all around the insert, under its head, none within it.
            z = hole.surface_z_mm + hole.inward * (hole.plate_mm + 1.0)
            process = d["manufacturing.print_process"]
            radius = hole_diameter_mm(at.thread, at.screw_name, process) / 2
            for turn in range(8):
                c, s = math.cos(turn * math.pi / 4), math.sin(turn * math.pi / 4)
                for share, expected in ((0.97, False), (1.15, True)):
                    p = cq.Vector(hole.x_mm + share * radius * c, hole.y_mm + share * radius * s, z)
                    assert body.isInside(p, 1e-6) is expected
