"""The wires of the LED boards, from the boards to outside of the gripper adapter.

Those of the side boards leave their channels through notches and lie in the outer part of the lanes
beside the camera's cable. Those of the board at the tip lie on the cover between the mirror's seat
and the baffle, and in the inner part of the lane at +y. Of each two one lies above the other.
"""

from __future__ import annotations

import math

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import LANE_GAP_MM, STACK_RATIO, wires_under_board
from gelslim_cad.geometry.led_strips import has_tip_light
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.cable import FLARE_RATIO, SLIP_MM, notch_end_x_mm, outside_x_mm
from gelslim_cad.solids.materials import WIRE
from gelslim_cad.solids.tip_light import board_z_mm, tip_wires_x_mm
from gelslim_cad.solids.tube import Point3, tube

WIRE_SHORTER_MM = 2.0
"""The wires are drawn so much shorter than the cable, beside whose connector they would lie."""
SOLDERED_MM = (0.8, 2.4)
"""Of the ends of the upper and the lower wire from the end of their board."""
NOTCH_GAP_MM = 0.2


def led_wires(d: Dimensions) -> tuple[Part, ...]:
    """The wires of the LED boards, two to a board: at -y, at +y, and at the tip where one is."""
    diameter = d["design.leds.wire_diameter_mm"]
    ways = [(_side_points(d, side, k), side * 4.0) for side in (-1, 1) for k in (0, 1)]
    if has_tip_light(d):
        ways += [(_tip_points(d, k), 2.0) for k in (0, 1)]
    return tuple(
        Part(
            name=f"led_wire_{number}",
            solid=tube(points, FLARE_RATIO * diameter, diameter),
            material=f"stranded wire, {diameter:g} mm outside",
            process="buy",
            colour=WIRE,
            quantity=len(ways) if number == 1 else 0,
            explode_mm=(0, aside, -46),
            note="two to a board; drawn short outside of the finger",
            tags=frozenset({"wire"} if number == 1 else {"wire", "instance"}),
        )
        for number, (points, aside) in enumerate(ways, start=1)
    )


def _side_points(d: Dimensions, side: int, k: int) -> list[Point3]:
    """Corners of the lower (0) or upper (1) wire of a side board.

    From the board's end through the notch, down to the cover, along the chamber, behind the
    clamp to its lane in the mount.
    """
    size = d["design.leds.wire_diameter_mm"]
    low = _low_z_mm(d, k)
    under = wires_under_board(d)
    soldered = d["led.board_bottom_z_mm"] - size / 2 - SLIP_MM
    high = soldered - (1 - k) * STACK_RATIO * size if under else low
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    end = middle - d["led.board_length_mm"] / 2
    rear = _rear_x_mm(d)
    row, run = d["led.y_mm"], d["wire.run_y_mm"]
    notch, aside = _notch_x_mm(d), _aside_x_mm(d)
    later = k * STACK_RATIO * size
    room = aside - rear - (FLARE_RATIO + STACK_RATIO) * size - 0.2
    ramp = min(max(abs(high - low), 3 * size), room)
    beside_leg = high + size / 2 > d["guide.leg_end_z_mm"] - SLIP_MM
    start = d["guide.proximal_end_x_mm"] if beside_leg else end
    points = [(start - 0.1, row, high)]
    if under:
        points = [(end + SOLDERED_MM[1 - k], row, soldered)]
        if k == 0:
            points.append((end + SOLDERED_MM[0] + 0.2, row, high))
    points += [
        (notch, row, high),
        (aside, run, high),
        (aside - later, run, high),
        (aside - later - max(ramp, 0.1), run, low),
        (rear, run, low),
        (rear, d["wire.lane_y_mm"], low),
        (_end_x_mm(d), d["wire.lane_y_mm"], low),
    ]
    return [(x, side * y, z) for x, y, z in points]


def _tip_points(d: Dimensions, k: int) -> list[Point3]:
    """Corners of the lower (0) or upper (1) wire of the board at the tip.

    From under the board down its channel, along the cover inside of the baffle, beside the clamp
    and behind it to the lane in the mount, there and there inside of the side board's wires.
    """
    size, beside = d["design.leds.wire_diameter_mm"], d["wire.beside_mm"]
    low, x = _low_z_mm(d, k), tip_wires_x_mm(d)[k]
    near, lane = d["wire.tip_y_mm"], d["wire.lane_y_mm"] - beside
    clear_of_clamp = d["clamp.width_mm"] / 2 + d["design.housing.fit_clearance_mm"] + size / 2
    along = max(near, clear_of_clamp + 0.05)
    # Side by side round two bends of 45° the wires keep their distance if one bends later.
    aside = _aside_x_mm(d) - (math.sqrt(2) - 1) * beside
    if along > near:
        aside = max(aside, d["clamp.front_x_mm"] + 1.5 * size)
    rear = _rear_x_mm(d) + beside
    return [
        (x, near, board_z_mm(d)[0] - SLIP_MM),
        (x, near, low),
        (aside + along - near, near, low),
        (aside, along, low),
        (rear, along, low),
        (rear, lane, low),
        (_end_x_mm(d), lane, low),
    ]


def _low_z_mm(d: Dimensions, k: int) -> float:
    """Height on the cover of the lower (0) or upper (1) wire of a board."""
    return float(d["wire.low_z_mm"] + k * STACK_RATIO * d["design.leds.wire_diameter_mm"])


def _rear_x_mm(d: Dimensions) -> float:
    """Where the wires of the side boards run behind the clamp."""
    return float(d["chamber.rear_x_mm"] + LANE_GAP_MM + d["design.leds.wire_diameter_mm"] / 2)


def _notch_x_mm(d: Dimensions) -> float:
    """Where the wires of the side boards have left their notches."""
    return notch_end_x_mm(d) - NOTCH_GAP_MM


def _aside_x_mm(d: Dimensions) -> float:
    """Where the wires of the side boards are clear of the clamp."""
    return _notch_x_mm(d) - float(d["wire.run_y_mm"] - d["led.y_mm"])


def _end_x_mm(d: Dimensions) -> float:
    """Where the drawing of the wires ends."""
    return outside_x_mm(d) + WIRE_SHORTER_MM
