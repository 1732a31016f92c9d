"""Round cables and wires: a circle swept along straight pieces that arcs join."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cadquery as cq

from gelslim_cad.solids.shapes import single

Point3 = tuple[float, float, float]
SHORTEST_MM = 1e-6
LARGEST_SHARE = 0.45
"""Most of a straight piece between two arcs that one of them takes."""


def tube(points: Sequence[Point3], radius_mm: float, diameter_mm: float) -> cq.Solid:
    """Round wire along a polyline whose corners are arcs.

    Args:
        points: Corners of the polyline in mm; collinear ones are left out.
        radius_mm: Radius of the arcs along the wire's middle, less where a piece is too short.
        diameter_mm: Diameter of the wire.

    Returns:
        The solid.

    Raises:
        SolidError: The kernel cannot sweep it.
    """
    edges = path_edges(points, radius_mm)
    start = edges[0].startPoint()
    section = cq.Wire.makeCircle(diameter_mm / 2, start, edges[0].tangentAt(0))
    swept = cq.Solid.sweep(section, [], cq.Wire.assembleEdges(edges))
    return single(swept, "wire")


def path_edges(points: Sequence[Point3], radius_mm: float) -> list[cq.Edge]:
    """Straight pieces and arcs of the rounded polyline."""
    corners = _corners([cq.Vector(*p) for p in points])
    edges: list[cq.Edge] = []
    last = corners[0]
    for k in range(1, len(corners) - 1):
        corner = corners[k]
        to_before, to_after = corners[k - 1] - corner, corners[k + 1] - corner
        u, v = to_before.normalized(), to_after.normalized()
        turn = math.pi - u.getAngle(v)
        room = to_before.Length * (1.0 if k == 1 else LARGEST_SHARE)
        room = min(room, to_after.Length * (1.0 if k == len(corners) - 2 else LARGEST_SHARE))
        take = min(radius_mm * math.tan(turn / 2), room)
        start, end = corner + u * take, corner + v * take
        radius = take / math.tan(turn / 2)
        middle = corner + (u + v).normalized() * (radius / math.cos(turn / 2) - radius)
        if (start - last).Length > SHORTEST_MM:
            edges.append(cq.Edge.makeLine(last, start))
        edges.append(cq.Edge.makeThreePointArc(start, middle, end))
        last = end
    if (corners[-1] - last).Length > SHORTEST_MM:
        edges.append(cq.Edge.makeLine(last, corners[-1]))
    return edges


def _corners(points: Sequence[cq.Vector]) -> list[cq.Vector]:
    """The points without repeated and collinear ones."""
    kept: list[cq.Vector] = []
    for point in points:
        if kept and (point - kept[-1]).Length < SHORTEST_MM:
            continue
        if len(kept) > 1:
            before, after = kept[-1] - kept[-2], point - kept[-1]
            if before.cross(after).Length < 1e-9 * before.Length * after.Length:
                kept.pop()
        kept.append(point)
    return kept
