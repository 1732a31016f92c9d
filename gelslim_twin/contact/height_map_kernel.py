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
        ax, ay, az = corners[n, 0]
        bx, by, bz = corners[n, 1]
        cx, cy, cz = corners[n, 2]
        double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(double) < THIN_MM2:
            continue
        i0 = np.searchsorted(x, min(ax, bx, cx) - EDGE_MM)
        i1 = np.searchsorted(x, max(ax, bx, cx) + EDGE_MM)
        j0 = np.searchsorted(y, min(ay, by, cy) - EDGE_MM)
        j1 = np.searchsorted(y, max(ay, by, cy) + EDGE_MM)
        for i in range(i0, i1):
            dx = x[i] - ax
            for j in range(j0, j1):
                dy = y[j] - ay
                u = (dx * (cy - ay) - dy * (cx - ax)) / double
                v = (dy * (bx - ax) - dx * (by - ay)) / double
                if u >= -EDGE_MM and v >= -EDGE_MM and u + v <= 1 + EDGE_MM:
                    z = az + u * (bz - az) + v * (cz - az)
                    if z < height[i, j]:
                        height[i, j] = z


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
        ax, ay, az = corners[n, 0]
        bx, by, bz = corners[n, 1]
        cx, cy, cz = corners[n, 2]
        double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(double) < THIN_MM2:
            continue
        i0, i1 = np.searchsorted(x, min(ax, bx, cx)), np.searchsorted(x, max(ax, bx, cx))
        j0, j1 = np.searchsorted(y, min(ay, by, cy)), np.searchsorted(y, max(ay, by, cy))
        for i in range(i0, i1):
            dx = x[i] - ax
            for j in range(j0, j1):
                dy = y[j] - ay
                u = (dx * (cy - ay) - dy * (cx - ax)) / double
                v = (dy * (bx - ax) - dx * (by - ay)) / double
                if u >= 0 and v >= 0 and u + v <= 1:
                    if count < room:
                        place[count], facet[count] = i * len(y) + j, n
                        height[count] = az + u * (bz - az) + v * (cz - az)
                        side[count] = 1 if double < 0 else -1
                    count += 1
    return count
