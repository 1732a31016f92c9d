"""Compiled loops over pixels: sums of channels, means of cells, darkness.

Import it only where it runs, because it loads numba.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def channel_sums(image: Any, sums: Any) -> None:
    """Write the sum over channels of `image` (h, w, c) uint8 to `sums` (h, >= w) uint16."""
    height, width, channels = image.shape
    if channels == 3:
        for y in range(height):
            for x in range(width):
                sums[y, x] = (
                    np.uint16(image[y, x, 0])
                    + np.uint16(image[y, x, 1])
                    + np.uint16(image[y, x, 2])
                )
    else:
        for y in range(height):
            for x in range(width):
                sums[y, x] = image[y, x, 0]


@njit(**COMPILED)
def cell_means(sums: Any, cell: Any, means: Any) -> None:
    """Write the means of cell x cell squares of `sums` to `means` (h // cell, w // cell)."""
    rows, columns = means.shape
    strip = np.empty(columns * cell, dtype=np.uint32)
    for i in range(rows):
        strip[:] = 0
        for y in range(i * cell, (i + 1) * cell):
            for x in range(strip.size):
                strip[x] += sums[y, x]
        for j in range(columns):
            total = np.uint32(0)
            for x in range(j * cell, (j + 1) * cell):
                total += strip[x]
            means[i, j] = np.float32(total) / np.float32(cell * cell)


@njit(**COMPILED)
def darkness(sums: Any, background: Any, cell: Any, floor: Any, slack: Any, dark: Any) -> None:
    """Write 1 - (smoothed + slack) / background to `dark` (h, w) float32.

    Smoothed is the 3 x 3 binomial mean of `sums`. `background` (r, c) is given at the centres of
    the cells and interpolated bilinearly; it is at least `floor`, because a black picture holds no
    information. `slack` allows for noise, which matters more where the light is weak.
    """
    height, width = dark.shape
    rows, columns = background.shape
    strip = np.zeros(width + 2, dtype=np.int32)
    across = np.empty(columns, dtype=np.float32)
    ground = np.empty(width, dtype=np.float32)
    left = np.empty(width, dtype=np.int32)
    part = np.empty(width, dtype=np.float32)
    for x in range(width):
        at = min(max((x + 0.5) / cell - 0.5, 0.0), columns - 1.0)
        left[x] = min(int(at), max(columns - 2, 0))
        part[x] = at - left[x]
    step = 1 if columns > 1 else 0
    one, slack = np.float32(1), np.float32(slack)
    for y in range(height):
        at = min(max((y + 0.5) / cell - 0.5, 0.0), rows - 1.0)
        top = min(int(at), max(rows - 2, 0))
        below = min(top + 1, rows - 1)
        share = np.float32(at - top)
        for j in range(columns):
            value = background[top, j] + share * (background[below, j] - background[top, j])
            across[j] = max(value, np.float32(floor))
        for x in range(width):
            j = left[x]
            ground[x] = across[j] + part[x] * (across[j + step] - across[j])
        before, after = sums[max(0, y - 1)], sums[min(height - 1, y + 1)]
        here, found = sums[y], dark[y]
        for x in range(width):
            strip[x + 1] = before[x] + 2 * np.int32(here[x]) + after[x]
        strip[0], strip[width + 1] = strip[1], strip[width]
        for x in range(width):
            near = np.float32(np.int32(strip[x] + 2 * strip[x + 1] + strip[x + 2]))
            found[x] = one - (near * np.float32(0.0625) + slack) / ground[x]
