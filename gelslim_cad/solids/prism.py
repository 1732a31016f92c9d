"""Prisms along z over outlines of straight and circular pieces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import cadquery as cq
import numpy as np

from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.closed_wire import Piece, closed_wire

Point2 = tuple[float, float]
Hole = tuple[float, float, float]
"""x, y and diameter of a round hole."""


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
