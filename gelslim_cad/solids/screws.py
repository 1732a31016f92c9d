"""Assembled screws. Threads are drawn with the core diameter, so that they fill their holes."""

from __future__ import annotations

import math
from functools import lru_cache

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.fasteners import ScrewSize, stock_length_mm
from gelslim_cad.geometry.part import Part
from gelslim_cad.geometry.thread import SHORT_OF_END_MM
from gelslim_cad.solids.clamp import SCREW_DEPTH_MM, clamp_screw_positions
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import STEEL
from gelslim_cad.solids.mirror import seat_pilot_mm, seat_screw_positions
from gelslim_cad.solids.shapes import single

PLAY_MM = 0.01
KINDS_KEPT = 16
"""Kinds and lengths of screws that are kept: all of one kind are copies of one solid."""


@lru_cache(maxsize=KINDS_KEPT)
def _countersunk(size: ScrewSize, inward: int, length: float) -> cq.Solid:
    """A screw whose head's face lies in the origin; `inward` is the sign of z towards its tip."""
    direction, at = cq.Vector(0, 0, inward), cq.Vector(0, 0, 0)
    core = size.pilot_mm / 2 - PLAY_MM
    head = size.countersunk_head_mm / 2 - 2 * PLAY_MM
    shank = cq.Solid.makeCylinder(core, length, at, direction)
    cone = cq.Solid.makeCone(head, core, head - core, at, direction)
    socket = _socket(0.0, inward, 0.3 * size.countersunk_head_mm, 0.5 * (head - core))
    return single(shank.fuse(cone).cut(socket), "screw")


@lru_cache(maxsize=KINDS_KEPT)
def _cap(size: ScrewSize, length: float) -> cq.Solid:
    """A cap screw upwards whose head's seat lies in the origin."""
    up, at = cq.Vector(0, 0, 1), cq.Vector(0, 0, 0)
    shank = cq.Solid.makeCylinder(size.pilot_mm / 2 - PLAY_MM, length + 0.1, at, up)
    bottom = -size.cap_height_mm
    head = cq.Solid.makeCylinder(
        size.cap_head_mm / 2, size.cap_height_mm, cq.Vector(0, 0, bottom), up
    )
    socket = _socket(bottom, 1, 0.48 * size.cap_head_mm, 0.5 * size.cap_height_mm)
    return single(shank.fuse(head).cut(socket), "bolt")


def _socket(z: float, inward: int, across: float, depth: float) -> cq.Solid:
    """Hexagon socket, `across` corners wide, sunk from the head's face at z."""
    corners = [
        cq.Vector(
            across / 2 * math.cos(k * math.pi / 3),
            across / 2 * math.sin(k * math.pi / 3),
            z - 0.01 * inward,
        )
        for k in range(6)
    ]
    wire = cq.Wire.makePolygon([*corners, corners[0]])
    return cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 0, inward * (depth + 0.01)))


def screws(d: Dimensions) -> tuple[Part, ...]:
    """All screws, one part each; the first of each kind and length carries the quantity."""
    at = Layout(d)
    name = d["design.housing.screw"]
    wall = d["design.housing.back_wall_mm"]
    parts: list[Part] = []
    kinds: dict[str, list[tuple[cq.Solid, float, int]]] = {"bezel": [], "cover": []}
    for kind, holes in (("bezel", at.bezel_holes()), ("cover", at.cover_holes())):
        for h in holes:
            n = h.screw_length_mm
            solid = _countersunk(at.screw, h.inward, n).translate((h.x_mm, h.y_mm, h.surface_z_mm))
            kinds[kind].append((solid, n, -h.inward))
    kinds["clamp"] = [
        (_countersunk(at.screw, 1, n).translate((x, y, at.back_z_mm)), n, -1)
        for x, y in clamp_screw_positions(d)
        for n in (stock_length_mm(wall + SCREW_DEPTH_MM - SHORT_OF_END_MM),)
    ]
    kinds["seat"] = [
        (_countersunk(at.screw, 1, n).translate((x, y, at.back_z_mm)), n, -1)
        for x, y in seat_screw_positions(d, at)
        for n in (stock_length_mm(wall + seat_pilot_mm(d, at, x) - 0.2),)
    ]
    for kind, places in kinds.items():
        parts += _instances(f"{kind}_screw", f"{name} countersunk, steel", places)
    bolts = _mount_bolts(d, at)
    return (*parts, *_instances("mount_bolt", f"{d['design.mount.bolt']} cap head, steel", bolts))


def _mount_bolts(d: Dimensions, at: Layout) -> list[tuple[cq.Solid, float, int]]:
    low, high = at.slot_z_mm
    head = min(at.bolt.cap_height_mm + 0.2, low - at.back_z_mm - 1.0)
    seat = at.back_z_mm + max(0.0, head)
    room = high + max(0.5, min(6.0, at.top_z_mm - high - 1.0)) - seat
    n = stock_length_mm(room - 0.3)
    return [
        (_cap(at.bolt, n).translate((at.bolt_x_mm(), y, seat)), n, -1)
        for y in (-at.tongue_y_mm, at.tongue_y_mm)
    ]


def _instances(kind: str, material: str, places: list[tuple[cq.Solid, float, int]]) -> list[Part]:
    parts = []
    lengths = [n for _, n, _ in places]
    for k, (solid, length, side) in enumerate(places):
        first = lengths.index(length) == k
        parts.append(
            Part(
                name=f"{kind}_{k + 1}",
                solid=solid,
                material=f"{material}, {length:g} mm",
                process="buy",
                colour=STEEL,
                quantity=lengths.count(length) if first else 0,
                explode_mm=(0, 0, 48 if side > 0 else -70),
                tags=frozenset({"fastener"} if first else {"fastener", "instance"}),
            )
        )
    return parts
