"""Compiled change of shading between two frames. Import only where it runs: numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
SATURATED = 253


@njit(**COMPILED)
def block_discs(blocked: Any, centres: Any, radius: Any, size: Any, touched: Any) -> None:
    """Set `blocked` (h, w) in discs of `radius` (n,) px around `centres` (n, 2); NaN is skipped.

    `touched` (rows, columns) is set for the bins of `size` px that the box of a disc overlaps.
    """
    height, width = blocked.shape
    rows, columns = touched.shape
    for k in range(len(centres)):
        x, y, r = centres[k, 0], centres[k, 1], radius[k]
        if not (x > -r and y > -r and x < width + r and y < height + r):
            continue
        top, bottom = max(0, int(y - r)), min(height, int(y + r) + 2)
        left, right = max(0, int(x - r)), min(width, int(x + r) + 2)
        for i in range(top, bottom):
            for j in range(left, right):
                if (i - y) ** 2 + (j - x) ** 2 <= r * r:
                    blocked[i, j] = 1
        for row in range(top // size, min(rows, (bottom - 1) // size + 1)):
            for column in range(left // size, min(columns, (right - 1) // size + 1)):
                touched[row, column] = 1


@njit(**COMPILED)
def bin_sums(image: Any, size: Any, sums: Any, glaring: Any) -> None:
    """Sums (rows, columns, c) of an image (h, w, c) over bins, and the bins in which a pixel may be
    saturated: those where every channel reaches SATURATED somewhere."""
    rows, channels = sums.shape[0], sums.shape[2]
    width = image.shape[1] * channels
    flat = image.reshape(image.shape[0], width)
    down, most = np.zeros(width, dtype=np.uint16), np.zeros(width, dtype=np.uint8)
    for row in range(rows):
        # Down the columns of full rows first: that runs on the vector unit.
        down[:] = 0
        most[:] = 0
        for i in range(row * size, (row + 1) * size):
            for k in range(width):
                down[k] += flat[i, k]
                most[k] = max(most[k], flat[i, k])
        _along(down, size, channels, sums[row])
        glaring[row] = 0
        if most.max() >= SATURATED:
            _mark_glare(most, size, channels, glaring[row])


@njit(**COMPILED)
def _along(down: Any, size: Any, channels: Any, sums: Any) -> None:
    if channels == 3:
        for column in range(sums.shape[0]):
            first = second = third = np.int64(0)
            start = column * size * 3
            for k in range(start, start + 3 * size, 3):
                first += down[k]
                second += down[k + 1]
                third += down[k + 2]
            sums[column, 0], sums[column, 1], sums[column, 2] = first, second, third
    else:
        for column in range(sums.shape[0]):
            first = np.int64(0)
            for k in range(column * size, (column + 1) * size):
                first += down[k]
            sums[column, 0] = first


@njit(**COMPILED)
def _mark_glare(most: Any, size: Any, channels: Any, glaring: Any) -> None:
    for column in range(glaring.shape[0]):
        least = np.uint8(255)
        for c in range(channels):
            top = np.uint8(0)
            for k in range(column * size, (column + 1) * size):
                top = max(top, most[channels * k + c])
            least = min(least, top)
        glaring[column] = least >= SATURATED


@njit(**COMPILED)
def light_ratios(
    first: Any,
    second: Any,
    blocked: Any,
    touched: Any,
    glaring: Any,
    size: Any,
    sums: Any,
    floor: Any,
    ratios: Any,
    counts: Any,
) -> None:
    """Ratios (c, rows, columns) of the light of two images (h, w, c) uint8, `floor` added to both.

    Blocked pixels, and those that are saturated in all channels of one image, are left out of both
    images; `counts` (rows, columns) are the remaining ones. `sums` (2, rows, columns, c) are those
    of all pixels of a bin. They are used where no pixel is blocked (`touched`) and none may be
    saturated (`glaring`).
    """
    channels, rows, columns = ratios.shape
    g, b = min(1, channels - 1), channels - 1
    for row in range(rows):
        for column in range(columns):
            free = size * size
            p0, p1, p2 = sums[0, row, column, 0], sums[0, row, column, g], sums[0, row, column, b]
            q0, q1, q2 = sums[1, row, column, 0], sums[1, row, column, g], sums[1, row, column, b]
            if touched[row, column] or glaring[row, column]:
                may = glaring[row, column]
                free = p0 = p1 = p2 = q0 = q1 = q2 = 0
                for i in range(row * size, (row + 1) * size):
                    for j in range(column * size, (column + 1) * size):
                        if blocked[i, j] or (
                            may and (_glares(first[i, j]) or _glares(second[i, j]))
                        ):
                            continue
                        free += 1
                        p0, q0 = p0 + first[i, j, 0], q0 + second[i, j, 0]
                        p1, q1 = p1 + first[i, j, g], q1 + second[i, j, g]
                        p2, q2 = p2 + first[i, j, b], q2 + second[i, j, b]
            counts[row, column] = free
            least = np.float32(floor * max(free, 1))
            ratios[0, row, column] = (q0 + least) / (p0 + least)
            ratios[g, row, column] = (q1 + least) / (p1 + least)
            ratios[b, row, column] = (q2 + least) / (p2 + least)


@njit(**COMPILED)
def _glares(pixel: Any) -> Any:
    least = pixel[0]
    for c in range(1, len(pixel)):
        least = min(least, pixel[c])
    return least >= SATURATED
