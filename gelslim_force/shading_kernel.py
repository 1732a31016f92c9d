"""Compiled pass over two frames for the change of shading. Import only where it runs: numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
SATURATED = 253


@njit(**COMPILED)
def block_discs(blocked: Any, centres: Any, radius: Any) -> None:
    """Set `blocked` (h, w) in discs of `radius` (n,) px about `centres` (n, 2); NaN is passed."""
    height, width = blocked.shape
    for k in range(len(centres)):
        x, y, r = centres[k, 0], centres[k, 1], radius[k]
        if not (x > -r and y > -r and x < width + r and y < height + r):
            continue
        for i in range(max(0, int(y - r)), min(height, int(y + r) + 2)):
            for j in range(max(0, int(x - r)), min(width, int(x + r) + 2)):
                if (i - y) ** 2 + (j - x) ** 2 <= r * r:
                    blocked[i, j] = 1


@njit(**COMPILED)
def sums_in_bins(first: Any, second: Any, blocked: Any, size: Any, sums: Any, counts: Any) -> None:
    """Sums (2, rows, columns, c) of two images (h, w, 1 or 3) uint8 over the same free pixels.

    Blocked pixels, and those where every channel glares in one of the two, are left out of
    both; `counts` (rows, columns) are those left in.
    """
    _, rows, columns, channels = sums.shape
    sums[:] = 0
    for row in range(rows):
        for column in range(columns):
            free = 0
            a0 = a1 = a2 = b0 = b1 = b2 = np.int64(0)
            for i in range(row * size, (row + 1) * size):
                for j in range(column * size, (column + 1) * size):
                    if blocked[i, j]:
                        continue
                    p0, q0 = np.int64(first[i, j, 0]), np.int64(second[i, j, 0])
                    p1, q1, p2, q2 = p0, q0, p0, q0
                    if channels == 3:
                        p1, q1 = np.int64(first[i, j, 1]), np.int64(second[i, j, 1])
                        p2, q2 = np.int64(first[i, j, 2]), np.int64(second[i, j, 2])
                    if min(p0, p1, p2) >= SATURATED or min(q0, q1, q2) >= SATURATED:
                        continue
                    free += 1
                    a0, a1, a2 = a0 + p0, a1 + p1, a2 + p2
                    b0, b1, b2 = b0 + q0, b1 + q1, b2 + q2
            counts[row, column] = free
            sums[0, row, column, 0], sums[1, row, column, 0] = a0, b0
            if channels == 3:
                sums[0, row, column, 1], sums[1, row, column, 1] = a1, b1
                sums[0, row, column, 2], sums[1, row, column, 2] = a2, b2
