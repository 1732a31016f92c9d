"""Compiled series and centroids of outlines. Import only where they run: numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def expand(points: Any, weights: Any, out: Any) -> None:
    """Write corners (m, c, 2) as `weights` (c, k) of rim points (m, k, 2)."""
    rims, count = points.shape[0], points.shape[1]
    for m in range(rims):
        for c in range(weights.shape[0]):
            u = v = 0.0
            for k in range(count):
                u += weights[c, k] * points[m, k, 0]
                v += weights[c, k] * points[m, k, 1]
            out[m, c, 0], out[m, c, 1] = u, v


@njit(**COMPILED)
def centroids(outlines: Any, centres: Any, area: Any) -> None:
    """Write area centroids (m, 2) and signed areas (m,) of outlines (m, k, 2)."""
    count = outlines.shape[1]
    for m in range(outlines.shape[0]):
        x0, y0 = outlines[m, 0, 0], outlines[m, 0, 1]
        doubled = sx = sy = 0.0
        for k in range(1, count - 1):
            xa, ya = outlines[m, k, 0] - x0, outlines[m, k, 1] - y0
            xb, yb = outlines[m, k + 1, 0] - x0, outlines[m, k + 1, 1] - y0
            cross = xa * yb - xb * ya
            doubled += cross
            sx += (xa + xb) * cross
            sy += (ya + yb) * cross
        area[m] = doubled / 2
        if doubled != 0:
            centres[m, 0], centres[m, 1] = x0 + sx / (3 * doubled), y0 + sy / (3 * doubled)
        else:
            centres[m, 0] = centres[m, 1] = np.nan


@njit(**COMPILED)
def within(outlines: Any, width: Any, height: Any, inside: Any) -> None:
    """Write whether every corner of an outline (m, k, 2) lies in a picture, to `inside` (m,)."""
    for m in range(outlines.shape[0]):
        inside[m] = True
        for k in range(outlines.shape[1]):
            x, y = outlines[m, k, 0], outlines[m, k, 1]
            if not (x >= -0.5 and y >= -0.5 and x <= width - 0.5 and y <= height - 0.5):
                inside[m] = False
                break


@njit(**COMPILED)
def farthest(start: Any, end: Any, path: Any) -> None:
    """Write the longest way of a corner from outlines `start` to `end` (m, k, 2) to `path` (m,)."""
    for m in range(start.shape[0]):
        most = 0.0
        for k in range(start.shape[1]):
            dx, dy = end[m, k, 0] - start[m, k, 0], end[m, k, 1] - start[m, k, 1]
            most = max(most, dx * dx + dy * dy)
        path[m] = np.sqrt(most)
