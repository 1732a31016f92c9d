"""Plain solids in the sensor frame: boxes, rounded plates, prisms, holes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import cadquery as cq

from gelslim_cad.solids.closed_wire import Piece, closed_wire

Point2 = tuple[float, float]


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
