"""Compiled height map of a mesh seen from below, and where verticals pass its facets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

EDGE_MM = 1e-9
"""Margin by which a facet covers the points on its edges."""
THIN_MM2 = 1e-15
"""Twice the area in the plane below which a facet is upright and covers no point."""


@njit(cache=True)
def lower_heights(corners: Any, x: Any, y: Any, height: Any) -> None:
    """Lower `height` (nx, ny) to the facets (n, 3, 3) over the points of the grid x, y."""
    for n in range(len(corners)):
        facet = corners[n]
        double = _double_area(facet)
        if abs(double) < THIN_MM2:
            continue
        i0, i1 = _between(x, facet[:, 0], EDGE_MM)
        j0, j1 = _between(y, facet[:, 1], EDGE_MM)
        for i in range(i0, i1):
            for j in range(j0, j1):
                u, v = _weights(facet, double, x[i], y[j])
                if u >= -EDGE_MM and v >= -EDGE_MM and u + v <= 1 + EDGE_MM:
                    height[i, j] = min(height[i, j], _height(facet, u, v))


@njit(cache=True)
def vertical_passes(
    corners: Any, x: Any, y: Any, place: Any, height: Any, facet: Any, side: Any
) -> int:
    """Where verticals over the points of the grid x, y pass facets (n, 3, 3); returns how many.

    Writes the number of the point of the grid, the height, the number of the facet, and 1 where
    the facet faces down or -1 where it faces up, as long as the arrays (m,) have room.
    """
    count, room = 0, len(place)
    for n in range(len(corners)):
        double = _double_area(corners[n])
        if abs(double) < THIN_MM2:
            continue
        i0, i1 = _between(x, corners[n][:, 0], 0.0)
        j0, j1 = _between(y, corners[n][:, 1], 0.0)
        for i in range(i0, i1):
            for j in range(j0, j1):
                u, v = _weights(corners[n], double, x[i], y[j])
                if u >= 0 and v >= 0 and u + v <= 1:
                    if count < room:
                        place[count], facet[count] = i * len(y) + j, n
                        height[count] = _height(corners[n], u, v)
                        side[count] = 1 if double < 0 else -1
                    count += 1
    return count


@njit(cache=True)
def _double_area(facet: Any) -> float:
    """Twice the area of a facet (3, 3) in the plane, positive where it faces up."""
    ex, ey = facet[1, 0] - facet[0, 0], facet[1, 1] - facet[0, 1]
    gx, gy = facet[2, 0] - facet[0, 0], facet[2, 1] - facet[0, 1]
    return ex * gy - gx * ey


@njit(cache=True)
def _between(grid: Any, ends: Any, margin: float) -> tuple[int, int]:
    """First number of the grid lines that a facet covers, and the number after the last."""
    first = np.searchsorted(grid, min(ends[0], ends[1], ends[2]) - margin)
    return first, np.searchsorted(grid, max(ends[0], ends[1], ends[2]) + margin)


@njit(cache=True)
def _weights(facet: Any, double: float, x: float, y: float) -> tuple[float, float]:
    """Barycentric coordinates of a place with the second and the third corner."""
    dx, dy = x - facet[0, 0], y - facet[0, 1]
    ex, ey = facet[1, 0] - facet[0, 0], facet[1, 1] - facet[0, 1]
    gx, gy = facet[2, 0] - facet[0, 0], facet[2, 1] - facet[0, 1]
    return (dx * gy - dy * gx) / double, (dy * ex - dx * ey) / double


@njit(cache=True)
def _height(facet: Any, u: float, v: float) -> float:
    z = facet[0, 2]
    return z + u * (facet[1, 2] - z) + v * (facet[2, 2] - z)
