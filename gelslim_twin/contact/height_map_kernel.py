"""Compiled height map of a mesh seen from below."""

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
