"""Compiled pass over two frames for the change of shading. Import only where it runs: numba."""

from __future__ import annotations

from typing import Any

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
    """Sums (2, rows, columns, c) of two images (h, w, c) uint8 over the same free pixels.

    Blocked pixels, and those where every channel glares in one of the two, are left out of
    both; `counts` (rows, columns) are those left in.
    """
    _, rows, columns, channels = sums.shape
    sums[:] = 0
    counts[:] = 0
    for i in range(rows * size):
        row = i // size
        for column in range(columns):
            for j in range(column * size, (column + 1) * size):
                if blocked[i, j]:
                    continue
                low = 255
                for c in range(channels):
                    low = min(low, max(first[i, j, c], second[i, j, c]))
                if low >= SATURATED:
                    continue
                counts[row, column] += 1
                for c in range(channels):
                    sums[0, row, column, c] += first[i, j, c]
                    sums[1, row, column, c] += second[i, j, c]
