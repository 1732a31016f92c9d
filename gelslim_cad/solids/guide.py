"""The curved acrylic light guide: flat window, two 90° bends of constant thickness, two legs.

    ____________________   gel side
   /  ________________  \\
  |  /                \\  |
  |_|                  |_|   LEDs shine up into the legs

The LED boards lie under the legs, one colour at -y (left in the image), one at +y; a third may
stand in front of the window's end face at the tip.
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.led_strips import (
    has_tip_light,
    shared_light,
    strip_sides,
    strip_wavelengths_nm,
)
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import ACRYLIC, BLUE_BOARD, GREEN_BOARD, PLAIN_BOARD, RED_BOARD
from gelslim_cad.solids.shapes import Piece, box, closed_wire, single, union
from gelslim_cad.solids.tip_light import tip_board
from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Point, Segment


def profile_wire(profile: GuideProfile, x_mm: float) -> cq.Wire:
    """Outline of the profile's acrylic in the plane x = x_mm, arcs exact."""

    def at(point: Point) -> cq.Vector:
        return cq.Vector(x_mm, *point)

    def piece(curve: Segment | Arc) -> Piece:
        straight = isinstance(curve, Segment)
        return Piece(at(curve.start), None if straight else at(curve.at(0.5)))

    return closed_wire([piece(e.curve) for e in joined(profile.outline("acrylic"))])


def joined(outline: tuple[Edge, ...]) -> list[Edge]:
    """Join collinear segments: a change of medium next to the acrylic does not divide its face."""
    merged: list[Edge] = []
    for edge in outline:
        last = merged[-1] if merged else None
        if last is not None and _in_line(last.curve, edge.curve):
            run = Segment(last.curve.start, edge.curve.end)
            merged[-1] = Edge(last.name, run, last.left, last.right)
        else:
            merged.append(edge)
    return merged


def _in_line(first: Segment | Arc, second: Segment | Arc) -> bool:
    if not (isinstance(first, Segment) and isinstance(second, Segment)):
        return False
    (a, b), (c, d), (_, _), (e, f) = first.start, first.end, second.start, second.end
    cross = (c - a) * (f - d) - (d - b) * (e - c)
    return abs(cross) < 1e-9 * first.length_mm * second.length_mm


def light_guide(d: Dimensions) -> Part:
    """The guide over its whole length."""
    wire = profile_wire(guide_profile(d), d["guide.proximal_end_x_mm"])
    solid = cq.Solid.extrudeLinear(wire, [], cq.Vector(d["guide.length_mm"], 0, 0))
    return Part(
        name="light_guide",
        solid=single(solid, "light_guide"),
        material=f"cast acrylic, {d['design.light_guide.thickness_mm']:g} mm",
        process="bend",
        colour=ACRYLIC,
        explode_mm=(0, 0, 14),
        note="laser-cut blank, anneal, bend hot over a former, polish the leg ends"
        + (" and the window's end at the tip" if has_tip_light(d) else ""),
        print_rotation_deg=(180, 0, 0),
    )


def guide_blank(d: Dimensions) -> Part:
    """Flat blank of the guide before bending, lying on z = 0."""
    width, t = d["guide.blank_width_mm"], d["design.light_guide.thickness_mm"]
    length = d["guide.blank_length_mm"]
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    start = cq.Vector(middle - length / 2, -width / 2, 0)
    return Part(
        name="light_guide_blank",
        solid=cq.Solid.makeBox(length, width, t, start),
        material=f"cast acrylic, {t:g} mm",
        process="laser",
        colour=ACRYLIC,
        quantity=0,
        in_assembly=False,
        note="anneal after cutting, bend, then trim the legs",
    )


def led_positions_mm(d: Dimensions) -> list[float]:
    """LED centres along the finger."""
    count, pitch = round(d["led.count"]), d["led.pitch_mm"]
    return [(k - (count - 1) / 2) * pitch for k in range(count)]


def _board(d: Dimensions, side: int) -> cq.Solid:
    y = side * d["led.y_mm"]
    half = d["led.board_width_mm"] / 2
    bottom = d["led.board_bottom_z_mm"]
    top = bottom + d["design.leds.board_thickness_mm"]
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    reach = d["led.board_length_mm"] / 2
    package = d["design.leds.package_mm"] / 2
    pieces: list[cq.Shape] = [
        box((middle - reach, middle + reach), (y - half, y + half), (bottom, top))
    ]
    pieces += [
        box((x - package, x + package), (y - package, y + package), (top - 0.05, d["led.top_z_mm"]))
        for x in led_positions_mm(d)
    ]
    return single(union(pieces), "LED board")


def led_boards(d: Dimensions) -> tuple[Part, ...]:
    """The boards of the two sides and, where there is one, of the tip."""
    model, alike = d["design.leds.model"], shared_light(d)
    colours = {"red": RED_BOARD, "green": GREEN_BOARD, "blue": BLUE_BOARD}
    made = {
        "left": lambda: (_board(d, -1), d["led.count"], d["led.pitch_mm"], (0.0, -4.0, -46.0)),
        "right": lambda: (_board(d, 1), d["led.count"], d["led.pitch_mm"], (0.0, 4.0, -46.0)),
        "tip": lambda: (tip_board(d), d["led.tip_count"], d["led.tip_pitch_mm"], (0, 0, 20.0)),
    }
    parts = []
    for side, name in zip(strip_sides(d), strip_wavelengths_nm(d), strict=True):
        solid, count, pitch, explode_mm = made[side]()
        part = Part(
            name=f"led_board_{name}",
            solid=solid,
            material=f"{round(count)} × {model} {alike or name}, "
            f"{d['design.leds.board_thickness_mm']:g} mm board",
            process="pcb",
            colour=colours.get(name, PLAIN_BOARD),
            explode_mm=explode_mm,
            note=f"{round(count)} LEDs at {pitch:.2f} mm pitch",
        )
        parts.append(part)
    return tuple(parts)
