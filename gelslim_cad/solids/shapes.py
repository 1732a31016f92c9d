"""Plain solids: boxes, holes, and prisms over outlines of straight and circular pieces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cadquery as cq
import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_MakeWire,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.TopoDS import TopoDS_Edge, TopoDS_Vertex

from gelslim_cad.markers.outline import Outline

Point2 = tuple[float, float]
Hole = tuple[float, float, float]
"""x, y and diameter of a round hole."""


class SolidError(ValueError):
    """A solid is invalid or in several pieces; the message names it."""


def box(x: Point2, y: Point2, z: Point2) -> cq.Solid:
    """Axis-aligned box between the given bounds (mm)."""
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    return cq.Solid.makeBox(*size, cq.Vector(x[0], y[0], z[0]))


def pair(x: Point2, y: Point2, z: Point2) -> tuple[cq.Solid, cq.Solid]:
    """A box at y = (inner, outer) and its mirror image at -y."""
    return box(x, y, z), box(x, (-y[1], -y[0]), z)


def rounded_wire(x: Point2, y: Point2, radii: Sequence[float], z: float) -> cq.Wire:
    """Rectangle with corner radii (proximal -y, tip -y, tip +y, proximal +y) at height z."""
    limit = min(x[1] - x[0], y[1] - y[0]) / 2 - 1e-6
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    into = [(0, -1), (1, 0), (0, 1), (-1, 0)]
    pieces: list[Piece] = []
    for k, (cx, cy) in enumerate(corners):
        r = max(0.0, min(radii[k], limit))
        (ax, ay), (bx, by) = into[k], into[(k + 1) % 4]
        if r <= 1e-6:
            pieces.append(Piece(cq.Vector(cx, cy, z)))
            continue
        start = cq.Vector(cx - ax * r, cy - ay * r, z)
        end = cq.Vector(cx + bx * r, cy + by * r, z)
        bulge = r * (1 - math.sqrt(0.5))
        mid = cq.Vector(cx - (ax - bx) * bulge, cy - (ay - by) * bulge, z)
        pieces += [Piece(start, mid), Piece(end)]
    return closed_wire(pieces)


def rounded_box(x: Point2, y: Point2, z: Point2, radii: Sequence[float]) -> cq.Solid:
    """Prism over `rounded_wire`."""
    wire = rounded_wire(x, y, radii, z[0])
    return cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 0, z[1] - z[0]))


def prism_across(profile: Sequence[Point2], half_width: float) -> cq.Solid:
    """Prism over a polygon of (x, z) points, from y = -half_width to +half_width."""
    points = [cq.Vector(x, -half_width, z) for x, z in profile]
    wire = cq.Wire.makePolygon([*points, points[0]])
    return cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 2 * half_width, 0))


def rod(x: float, y: float, z: Point2, diameter: float) -> cq.Solid:
    """Cylinder along z."""
    return cq.Solid.makeCylinder(
        diameter / 2, z[1] - z[0], cq.Vector(x, y, z[0]), cq.Vector(0, 0, 1)
    )


def pointed_rod(x: float, y: float, z: Point2, diameter: float) -> cq.Shape:
    """Cylinder along z with a tip of 45° beyond its upper end: a blind hole that prints from below.

    A flat end would be a ceiling in the hole, under which slicers put a support.
    """
    tip = cq.Solid.makeCone(
        diameter / 2, 0.0, diameter / 2, cq.Vector(x, y, z[1]), cq.Vector(0, 0, 1)
    )
    return rod(x, y, z, diameter).fuse(tip)


def countersink(
    x: float, y: float, surface_z: float, inward: int, head: float, hole: float, depth: float
) -> cq.Shape:
    """Clearance hole with a 90° countersink; `inward` is the sign of z into the material."""
    start = surface_z - inward * 0.01
    direction = cq.Vector(0, 0, inward)
    shaft = cq.Solid.makeCylinder(hole / 2, depth + 0.02, cq.Vector(x, y, start), direction)
    cone = cq.Solid.makeCone(
        head / 2, hole / 2, (head - hole) / 2, cq.Vector(x, y, start), direction
    )
    return shaft.fuse(cone)


def union(shapes: Iterable[cq.Shape]) -> cq.Shape:
    """Fuse all shapes at once."""
    first, *rest = list(shapes)
    return first.fuse(*rest) if rest else first


def subtract(base: cq.Shape, tools: Iterable[cq.Shape]) -> cq.Shape:
    """Cut all tools at once."""
    cutters = list(tools)
    return base.cut(*cutters) if cutters else base


def single(shape: cq.Shape, name: str) -> cq.Solid:
    """Return the one valid solid of `shape`; raise SolidError for none or several."""
    solids = shape.Solids()
    if len(solids) != 1:
        raise SolidError(f"{name} came out as {len(solids)} solids instead of one")
    solid: cq.Solid = solids[0]
    if not solid.isValid() or solid.Volume() <= 0:
        raise SolidError(f"{name} came out as an invalid solid")
    return solid


def chamfered(solid: cq.Solid, edges: Sequence[cq.Edge], length: float) -> cq.Solid:
    """Chamfer `edges`; where the kernel cannot, return the solid unchanged."""
    if length <= 0 or not edges:
        return solid
    try:
        result = solid.chamfer(length, None, list(edges))
        solids = result.Solids()
    except Exception:  # the kernel raises many kinds for a chamfer it cannot build
        return solid
    good = len(solids) == 1 and solids[0].isValid() and 0 < solids[0].Volume() < solid.Volume()
    return solids[0] if good else solid


@dataclass(frozen=True)
class Piece:
    """From `start_mm` to where the next piece starts: straight, or an arc through `middle_mm`."""

    start_mm: cq.Vector
    middle_mm: cq.Vector | None = None


def closed_wire(pieces: Sequence[Piece]) -> cq.Wire:
    """Wire through the pieces in turn, the last one ending where the first begins.

    Neighbouring pieces share one vertex. The kernel would merge equal ends into their mean, summed
    in the order of memory addresses, so that the last bits would differ between processes.
    """
    corners = [BRepBuilderAPI_MakeVertex(p.start_mm.toPnt()).Vertex() for p in pieces]
    wire = BRepBuilderAPI_MakeWire()
    for k, piece in enumerate(pieces):
        follow = (k + 1) % len(pieces)
        wire.Add(_edge(piece, corners[k], pieces[follow].start_mm, corners[follow]))
    return cq.Wire(wire.Wire())


def _edge(piece: Piece, start: TopoDS_Vertex, to_mm: cq.Vector, end: TopoDS_Vertex) -> TopoDS_Edge:
    if piece.middle_mm is None:
        return BRepBuilderAPI_MakeEdge(start, end).Edge()
    points = (piece.start_mm.toPnt(), piece.middle_mm.toPnt(), to_mm.toPnt())
    arc = GC_MakeArcOfCircle(*points).Value()
    first, last = arc.FirstParameter(), arc.LastParameter()
    return BRepBuilderAPI_MakeEdge(arc, start, end, first, last).Edge()


def outline_wire(outline: Outline, z_mm: float) -> cq.Wire:
    """Closed wire of `outline` at height z."""
    pieces: list[Piece] = []
    points = outline.points_mm
    for (x0, y0), (x1, y1), bulge in zip(
        points.tolist(), np.roll(points, -1, axis=0).tolist(), outline.bulges.tolist(), strict=True
    ):
        start = cq.Vector(x0, y0, z_mm)
        if bulge == 0:
            pieces.append(Piece(start))
            continue
        # The arc's middle lies to the right of the chord for a left turn, by bulge * chord / 2.
        middle = cq.Vector(
            (x0 + x1) / 2 + bulge * (y1 - y0) / 2, (y0 + y1) / 2 - bulge * (x1 - x0) / 2, z_mm
        )
        pieces.append(Piece(start, middle))
    return closed_wire(pieces)


def prism(
    outline: Outline,
    z_mm: Point2,
    holes: Iterable[Hole] = (),
    windows: Iterable[Outline] = (),
) -> cq.Solid:
    """Solid over `outline` between two heights, with round holes and windows cut through.

    One planar face with inner wires is extruded, which is fast even with hundreds of holes. Holes
    and windows must lie inside the outline and must not meet.
    """
    up = cq.Vector(0, 0, 1)
    inner = [cq.Wire.makeCircle(d / 2, cq.Vector(x, y, z_mm[0]), up) for x, y, d in holes]
    inner += [outline_wire(window, z_mm[0]) for window in windows]
    return cq.Solid.extrudeLinear(
        outline_wire(outline, z_mm[0]), inner, cq.Vector(0, 0, z_mm[1] - z_mm[0])
    )


def rectangle(x: Point2, y: Point2, radius_mm: float = 0.0) -> Outline:
    """Rectangle between bounds, corners rounded by at most half the shorter side."""
    radius = max(0.0, min(radius_mm, (x[1] - x[0]) / 2, (y[1] - y[0]) / 2))
    shape = Outline.rounded_rectangle(x[1] - x[0], y[1] - y[0], radius)
    middle = np.array([(x[0] + x[1]) / 2, (y[0] + y[1]) / 2])
    return Outline(shape.points_mm + middle, shape.bulges)


def rounded_polygon(points: Sequence[Point2], radius_mm: float) -> Outline:
    """Polygon whose corners, convex and concave, are arcs tangent to both sides.

    The radius shrinks where a side is too short: an arc takes at most 0.45 of either side.
    """
    corners = np.asarray(points, dtype=float)
    before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    sides_in, sides_out = np.hypot(*before.T), np.hypot(*after.T)
    drawn: list[tuple[float, float]] = []
    bulges: list[float] = []
    for corner, u, v, l_in, l_out in zip(corners, before, after, sides_in, sides_out, strict=True):
        u, v = u / l_in, v / l_out
        turn = math.pi - math.acos(float(np.clip(u @ v, -1, 1)))
        if turn < 1e-9 or radius_mm <= 0:
            drawn.append((float(corner[0]), float(corner[1])))
            bulges.append(0.0)
            continue
        take = min(radius_mm * math.tan(turn / 2), 0.45 * l_in, 0.45 * l_out)
        left = float(-u[0] * v[1] + u[1] * v[0]) > 0
        start, end = corner + take * u, corner + take * v
        drawn += [(float(start[0]), float(start[1])), (float(end[0]), float(end[1]))]
        bulges += [math.tan(turn / 4) * (1 if left else -1), 0.0]
    return Outline(np.array(drawn), np.array(bulges))
