"""The strip of LEDs at the tip: its board, its slot and its wires in the finger."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gelslim_cad.assembly.bodies import bodies, part_meshes
from gelslim_cad.assembly.finger_order import finger_order, tail_x_mm
from gelslim_cad.assembly.proof import prove
from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import interferences
from gelslim_cad.solids.body import body
from gelslim_cad.solids.guide import led_boards, light_guide
from gelslim_cad.solids.wires import led_wires
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.plan import with_values

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"
TIP = {"design.leds.tip": "blue"}


@cache
def finger(tip: bool = True) -> Dimensions:
    return derive(with_values(read_spec(MINI20).spec, TIP if tip else {}))


@cache
def tip_parts() -> tuple[Part, ...]:
    return (body(finger()), light_guide(finger()), *led_boards(finger()), *led_wires(finger()))


def part(name: str) -> Part:
    return next(p for p in tip_parts() if p.name == name)


def common_mm3(first: object, second: object) -> float:
    return float(first.intersect(second).Volume())  # type: ignore[attr-defined]


def test_the_finger_grows_by_led_and_board_and_else_stays() -> None:
    dark, lit = finger(tip=False), finger()
    depth = lit["design.leds.height_mm"] + lit["design.leds.board_thickness_mm"]
    assert lit["finger.tip_x_mm"] - dark["finger.tip_x_mm"] == pytest.approx(depth)
    for name in ("finger.thickness_mm", "finger.width_mm", "guide.distal_end_x_mm"):
        assert lit[name] == dark[name]
    tips = [n for n in dark.values if "tip_" in n and n.startswith(("led.", "wire.", "electr"))]
    assert len(tips) > 10
    assert [n for n in tips if dark[n] != 0] == []
    assert dark["wire.beside_mm"] == 0
    assert [c.id for c in check(lit) if c.status == "fail"] == []


def test_leds_face_the_middle_of_the_windows_end_within_its_flat_part() -> None:
    d = finger()
    board = part("led_board_blue").solid
    t, fit = d["design.light_guide.thickness_mm"], d["design.housing.fit_clearance_mm"]
    window = part("light_guide").solid.BoundingBox()
    faces = [f for f in board.Faces() if abs(f.Center().x - d["led.tip_face_x_mm"]) < 1e-6]
    assert len(faces) == d["led.tip_count"] == 4
    assert d["led.tip_face_x_mm"] - window.xmax == pytest.approx(fit)
    half, flat = d["design.leds.package_mm"] / 2, d["guide.flat_width_mm"] / 2
    assert all(f.Area() == pytest.approx((2 * half) ** 2) for f in faces)
    assert {round(f.Center().z, 6) for f in faces} == {round(window.zmax - t / 2, 6)}
    places = np.sort([f.Center().y for f in faces])
    np.testing.assert_allclose(places, [-7.5, -2.5, 2.5, 7.5], atol=1e-9)
    assert places[-1] + half < flat


def test_the_slot_locates_the_board_and_the_ribs_press_it_to_its_back() -> None:
    """Moved by 1 µm it overlaps floor, back or stop by that much, and the ribs as printed."""
    d, board, held = finger(), part("led_board_blue").solid, part("body")
    assert held.printed is not None
    assert common_mm3(held.solid, board) < 1e-6
    step, tall = 1e-3, d["led.tip_board_width_mm"]
    long, thick = d["led.tip_board_length_mm"], d["design.leds.board_thickness_mm"]
    back = common_mm3(held.solid, board.translate((step, 0, 0)))
    assert back == pytest.approx(long * tall * step, rel=0.01)
    stop = common_mm3(held.solid, board.translate((0, -step, 0)))
    assert stop == pytest.approx(tall * thick * step, rel=0.01)
    channel = d["design.leds.wire_diameter_mm"] + 0.3
    floor = common_mm3(held.solid, board.translate((0, 0, -step)))
    assert floor > 0.95 * (long - channel) * thick * step
    squeeze = 2 * d["clamp.point_error_mm"]
    ribs = common_mm3(held.printed, board)
    assert ribs == pytest.approx(2 * 0.5 * (tall - 0.3) * squeeze, rel=0.1)


def test_the_board_lies_below_the_bezel_and_the_ledge_still_carries_the_window() -> None:
    d, held = finger(), part("body").solid
    board = part("led_board_blue").solid.BoundingBox()
    gap = d["design.housing.fit_clearance_mm"] / 2
    assert d["stack.gel_bottom_z_mm"] - board.zmax == pytest.approx(gap)
    dark = body(finger(tip=False)).solid
    x = (d["ledge.distal_x_mm"], d["guide.distal_end_x_mm"])
    top = d["stack.window_bottom_z_mm"] - d["shim.compressed_mm"]
    reach = d["guide.flat_width_mm"] / 2
    from gelslim_cad.solids.shapes import box

    ledge = box(x, (-reach, reach), (top - 1.0, top))
    assert common_mm3(held, ledge) == pytest.approx(common_mm3(dark, ledge))


def test_wires_run_inside_of_the_others_and_touch_nothing() -> None:
    d = finger()
    assert interferences(tip_parts()) == []
    assert sum(p.quantity for p in tip_parts() if p.name.startswith("led_wire_")) == 6
    size = d["design.leds.wire_diameter_mm"]
    for name in ("led_wire_5", "led_wire_6"):
        bounds = part(name).solid.BoundingBox()
        assert bounds.ymax + 0.1 < d["baffle.inner_y_mm"]
        assert bounds.zmin > d["cover.top_z_mm"]
        assert bounds.xmax < d["finger.tip_x_mm"] - d["design.housing.tip_wall_mm"] + size
    # In the mount its wires lie between the cable and those of the side board.
    assert d["wire.lane_y_mm"] + size / 2 < d["cable.slot_half_mm"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("design", "light"),
    [("gelslim2", "red_green"), ("long50", "red_green"), ("wide", "green_blue"), ("thin", "white")],
)
def test_a_finger_with_light_from_the_tip_goes_together(design: str, light: str) -> None:
    from gelslim_cad.solids.finger import finger_parts

    tip = {"red_green": "blue", "green_blue": "red", "white": "white"}[light]
    spec = read_spec(MINI20.with_name(f"{design}.yaml")).spec
    d = derive(with_values(spec, {"design.leds.light": light, "design.leds.tip": tip}))
    made = finger_parts(d)
    assert interferences(made) == []
    steps = finger_order(d, [p.name for p in made])
    proven = prove(steps, bodies(part_meshes(made), tail_x_mm(d)))
    keys = [p.step.key for p in proven]
    assert keys.index("tip_board") < keys.index("tip_wires") < keys.index("bezel")
