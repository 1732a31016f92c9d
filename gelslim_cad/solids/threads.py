"""Holes, bosses, inserts and nuts for the screws of bezel and cover."""

from __future__ import annotations

import math
from functools import lru_cache

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.geometry.thread import (
    INSERTS,
    NUT_PLAY_MM,
    NUT_SEAT_MM,
    NUTS_MM,
    Insert,
    half_width_mm,
    hole_diameter_mm,
    insert_depth_mm,
)
from gelslim_cad.solids.layout import NUT_ROOM_MM, OUT_MM, Hole, Layout
from gelslim_cad.solids.materials import BRASS, STEEL
from gelslim_cad.solids.shapes import Point2, box, pair, rod, single

PLAY_MM = 0.01
KINDS_KEPT = 8
"""Kinds of inserts that are kept: all of one kind are copies of one solid."""
HEAD_PLAY_MM = 0.1
BOSS_FLOOR_MM = 1.0
OVERLAP_MM = 0.05
FILM_MM = 0.2
"""One layer of filament, which a knife or the tip of a soldering iron opens."""


def _between(hole: Hole, start: float, end: float) -> Point2:
    """Heights of two depths behind the clamped plate."""
    face = hole.surface_z_mm + hole.inward * hole.plate_mm
    ends = (face + hole.inward * start, face + hole.inward * end)
    return min(ends), max(ends)


def thread_cuts(at: Layout, hole: Hole) -> list[cq.Shape]:
    """What a hole takes from the part behind the clamped plate."""
    d, thread, screw = at.d, hole.thread, at.screw_name
    x, y = hole.x_mm, hole.y_mm
    bore = at.screw.pilot_mm if thread == "self_cut" else at.screw.clearance_mm
    cuts: list[cq.Shape] = [rod(x, y, _between(hole, -OVERLAP_MM, hole.pilot_mm), bore)]
    if thread == "insert":
        insert = INSERTS[screw]
        wide = hole_diameter_mm(thread, screw, d["manufacturing.print_process"])
        deep = insert_depth_mm(screw, d["manufacturing.print_process"])
        head = insert.head + 2 * HEAD_PLAY_MM
        cuts += [
            rod(x, y, _between(hole, -OVERLAP_MM, deep), wide),
            rod(x, y, _between(hole, -OVERLAP_MM, insert.head_height), head),
        ]
    elif thread == "nut":
        flats, height = NUTS_MM[screw]
        half = (flats + NUT_PLAY_MM) / 2
        side = math.copysign(1.0, hole.slot_x_mm - x)
        ends = (x - side * half * 2 / math.sqrt(3), hole.slot_x_mm)
        heights = _between(hole, NUT_SEAT_MM, NUT_SEAT_MM + height + NUT_PLAY_MM)
        cuts.append(box((min(ends), max(ends)), (y - half, y + half), heights))
        if hole.entry_z_mm is not None:
            entry = (hole.slot_x_mm, hole.slot_x_mm + flats * 2 / math.sqrt(3) + NUT_ROOM_MM)
            cuts.append(box(entry, (y - half, y + half), (hole.entry_z_mm, heights[1])))
    elif thread == "flush":
        flats, height = NUTS_MM[screw]
        ends = (hole.pilot_mm - height, hole.pilot_mm + OUT_MM)
        cuts.append(_hexagon(hole, flats + NUT_PLAY_MM, ends))
    return cuts


def film(at: Layout, hole: Hole) -> cq.Shape:
    """A film that closes a hole's mouth while a printer stands supports under it.

    The supports end at the film, and the hole stays free.
    """
    insert = INSERTS.get(at.screw_name) if hole.thread == "insert" else None
    mouth = at.screw.clearance_mm if insert is None else insert.head + 2 * HEAD_PLAY_MM
    wide = mouth + 2 * OVERLAP_MM
    return rod(hole.x_mm, hole.y_mm, _between(hole, 0.0, FILM_MM), wide)


def roof_bosses(at: Layout) -> list[cq.Shape]:
    """Blocks under the roof, between the pocket's end wall and the side walls, if there is room."""
    d = at.d
    if at.roof_thread == "flush":
        return []
    half = half_width_mm(at.thread, at.screw_name, d["manufacturing.print_process"])
    x = at.roof_screw_x_mm
    side = at.half_width_mm - d["design.housing.side_wall_mm"] / 2
    top = (d["stack.window_bottom_z_mm"] + d["stack.gel_bottom_z_mm"]) / 2
    low = d["stack.gel_bottom_z_mm"] - d["thread.roof_depth_mm"] - BOSS_FLOOR_MM
    return list(pair((x - half, at.pocket_x_mm[0]), (at.screw_y_mm - half, side), (low, top)))


def thread_parts(d: Dimensions) -> tuple[Part, ...]:
    """Inserts and nuts of the screws, one part each; the first of each kind has the quantity."""
    at = Layout(d)
    parts: list[Part] = []
    for kind, holes in (("bezel", at.bezel_holes()), ("cover", at.cover_holes())):
        fitted = [(hole, "insert" if hole.thread == "insert" else "nut") for hole in holes]
        fitted = [(h, name) for h, name in fitted if h.thread != "self_cut"]
        names = [name for _, name in fitted]
        for k, (hole, name) in enumerate(fitted):
            first = names.index(name) == k
            part_name = f"{kind}_{name}_{k + 1}"
            parts.append(
                Part(
                    name=part_name,
                    solid=single(_insert(at, hole) if name == "insert" else _nut(at, hole), name),
                    material=_material(at, name),
                    process="buy",
                    colour=BRASS if name == "insert" else STEEL,
                    quantity=names.count(name) if first else 0,
                    explode_mm=(0, 0, -6.0 * hole.inward),
                    note=_note(d, hole) if first else "",
                    tags=frozenset({"fastener"} if first else {"fastener", "instance"}),
                )
            )
    return tuple(parts)


def _material(at: Layout, name: str) -> str:
    if name == "nut":
        return f"hexagon nut {at.screw_name}, ISO 4032, steel"
    return f"brass insert {at.screw_name} x {INSERTS[at.screw_name].length:g}, as PENCOM MNZ"


def _note(d: Dimensions, hole: Hole) -> str:
    if hole.thread == "flush":
        return "glue it into its pocket under the roof, flush"
    if hole.thread == "nut":
        return "slide it into its slot before the screw is driven"
    if d["manufacturing.print_process"] == "sla":
        return "glue it in flush with epoxy, a greased screw in its thread: resin does not melt"
    return "press it in flush with a soldering iron at the melting point of the print"


def _insert(at: Layout, hole: Hole) -> cq.Shape:
    wide = hole_diameter_mm(hole.thread, at.screw_name, at.d["manufacturing.print_process"])
    face = hole.surface_z_mm + hole.inward * hole.plate_mm
    made = _sleeve(INSERTS[at.screw_name], wide, at.screw.pilot_mm, hole.inward)
    return made.translate((hole.x_mm, hole.y_mm, face))


@lru_cache(maxsize=KINDS_KEPT)
def _sleeve(insert: Insert, wide: float, bore: float, inward: int) -> cq.Shape:
    """Sleeve with a head, as wide as its hole: the knurls sink into the plastic.

    The mouth of its hole is in the origin; `inward` is the sign of z into the material.
    """

    def between(start: float, end: float) -> Point2:
        return min(inward * start, inward * end), max(inward * start, inward * end)

    sleeve = rod(0.0, 0.0, between(PLAY_MM, insert.length), wide - 2 * PLAY_MM)
    head = rod(0.0, 0.0, between(PLAY_MM, insert.head_height - PLAY_MM), insert.head)
    drilled = rod(0.0, 0.0, between(-1.0, insert.length + 1.0), bore)
    return sleeve.fuse(head).cut(drilled)


def _nut(at: Layout, hole: Hole) -> cq.Shape:
    """Hexagon prism at its seat, two of its flats along the slot."""
    flats, height = NUTS_MM[at.screw_name]
    seat = hole.pilot_mm - height if hole.thread == "flush" else NUT_SEAT_MM
    prism = _hexagon(hole, flats, (seat + PLAY_MM, seat + height))
    bore = rod(
        hole.x_mm, hole.y_mm, _between(hole, seat - 1.0, seat + height + 1.0), at.screw.pilot_mm
    )
    return prism.cut(bore)


def _hexagon(hole: Hole, flats: float, depths: Point2) -> cq.Solid:
    """Hexagonal prism between two depths behind the plate."""
    low, high = _between(hole, *depths)
    corners = [
        cq.Vector(
            hole.x_mm + flats / math.sqrt(3) * math.cos(k * math.pi / 3),
            hole.y_mm + flats / math.sqrt(3) * math.sin(k * math.pi / 3),
            low,
        )
        for k in range(6)
    ]
    wire = cq.Wire.makePolygon([*corners, corners[0]])
    return cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 0, high - low))
