"""Back cover: it closes the body and holds camera clamp, mirror seat and LED pedestals."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import wires_under_board
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.cable import plug, plug_recess
from gelslim_cad.solids.clamp import clamp_screw_positions
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.led_seat import STOP_MM, board_middle_mm, stops
from gelslim_cad.solids.materials import COVER, PRINTED
from gelslim_cad.solids.mirror import recessed_footprint, seat_screw_positions
from gelslim_cad.solids.shapes import (
    box,
    chamfered,
    countersink,
    pair,
    rounded_box,
    single,
    subtract,
    union,
)
from gelslim_cad.solids.wires import SOLDERED_MM

LOWEST_PEDESTAL_MM = 0.3
CHAMFER_MM = 0.4


def cover(d: Dimensions) -> Part:
    """The printed back cover."""
    at = Layout(d)
    half, tip = at.half_width_mm, d["finger.tip_x_mm"]
    top, r = d["cover.top_z_mm"], d["design.housing.corner_radius_mm"]
    plate = rounded_box((at.cover_x_mm, tip), (-half, half), (at.back_z_mm, top), (0, r, r, 0))
    bottom = next(f for f in plate.Faces() if abs(f.Center().z - at.back_z_mm) < 1e-6)
    outside = [e for e in bottom.Edges() if abs(e.Center().x - at.cover_x_mm) > 1e-6]
    plate = chamfered(plate, outside, min(CHAMFER_MM, 0.4 * (top - at.back_z_mm)))
    solid = union([plate, *plug(d), *_pedestals(d, top)])
    solid = subtract(solid, _cuts(d, at))
    return Part(
        name="back_cover",
        solid=single(solid, "back_cover"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=COVER,
        explode_mm=(0, 0, -56),
        note="black, as the body",
    )


def _pedestals(d: Dimensions, top: float) -> tuple[cq.Shape, ...]:
    """Bars that press the LED boards up against the legs, with a stop at the tip end."""
    height = d["led.board_bottom_z_mm"] - top
    if height < LOWEST_PEDESTAL_MM:  # the boards lie on the cover itself
        return (*stops(d),)
    half = d["led.board_width_mm"] / 2 - 0.1
    middle, reach = board_middle_mm(d), d["led.board_length_mm"] / 2
    # Under the boards' proximal ends the wires are soldered.
    wires = SOLDERED_MM[1] + d["design.leds.wire_diameter_mm"] if wires_under_board(d) else 1.0
    bars = pair(
        (middle - reach + wires, middle + reach + STOP_MM),
        (d["led.y_mm"] - half, d["led.y_mm"] + half),
        (top - 0.1, d["led.board_bottom_z_mm"]),
    )
    return (*bars, *stops(d))


def _cuts(d: Dimensions, at: Layout) -> list[cq.Shape]:
    """Recess of the mirror seat and all screw holes."""
    top, wall = d["cover.top_z_mm"], d["design.housing.back_wall_mm"]
    x0, x1, half = recessed_footprint(d, at)
    gap = d["design.housing.fit_clearance_mm"]
    recess = box((x0 - gap, x1 + gap), (-half - gap, half + gap), (top - at.recess_mm, top + 1.0))
    places = [(h.x_mm, h.y_mm) for h in at.cover_holes()]
    places += clamp_screw_positions(d)
    places += seat_screw_positions(d, at)
    s = at.screw
    holes = [
        countersink(x, y, at.back_z_mm, 1, s.countersunk_head_mm, s.clearance_mm, wall + 0.5)
        for x, y in places
    ]
    return [recess, *plug_recess(d), *holes]
