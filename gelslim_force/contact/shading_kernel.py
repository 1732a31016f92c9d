"""Compiled change of shading between two frames. Import only where it runs: numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
SATURATED = 253
FREE = 255
"""Value of a mask where a pixel counts: all bits, so that a value and its mask give the value."""


@njit(**COMPILED)
def block_discs(mask: Any, centres: Any, radius: Any) -> None:
    """Set `mask` (h, w) to 0 in discs of `radius` (n,) px about `centres` (n, 2) that are known."""
    height, width = mask.shape
    for k in range(len(centres)):
        x, y, r = centres[k, 0], centres[k, 1], radius[k]
        if not (x > -r and y > -r and x < width + r and y < height + r):
            continue
        for i in range(max(0, math.ceil(y - r)), min(height, math.floor(y + r) + 1)):
            half = math.sqrt(max(r * r - (i - y) ** 2, 0.0))
            first, past = max(0, math.ceil(x - half)), min(width, math.floor(x + half) + 1)
            row = mask[i]
            # Unsigned places cannot count from the end, which would keep them from the vector unit.
            for j in range(np.uintp(first), np.uintp(max(first, past))):
                row[j] = 0


@njit(**COMPILED)
def glaring_bins(image: Any, size: Any, glaring: Any) -> None:
    """Mark the bins (rows, columns) of `size` px in which a pixel of an image (h, w, c) may be
    saturated: those where every channel reaches SATURATED somewhere."""
    rows, channels = glaring.shape[0], image.shape[2]
    flat = image.reshape(image.shape[0], image.shape[1] * channels)
    most = np.empty(flat.shape[1], dtype=np.uint8)
    for row in range(rows):
        most[:] = 0
        # Down the columns of full rows first: that runs on the vector unit.
        for i in range(row * size, (row + 1) * size):
            for k in range(len(most)):
                most[k] = max(most[k], flat[i, k])
        glaring[row] = 0
        if most.max() >= SATURATED:
            _mark_glare(most, size, channels, glaring[row])


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
    mask: Any,
    glaring: Any,
    size: Any,
    floor: Any,
    ratios: Any,
    counts: Any,
) -> None:
    """Ratios (c, rows, columns) of the light of two images (h, w, c) uint8, `floor` added to both.

    Pixels whose `mask` (h, w) is 0, and those that are saturated in all channels of one image,
    are left out of both images; `counts` (rows, columns) are the remaining ones. The latter are
    looked for in the bins marked in `glaring` (rows, columns).
    """
    channels, rows, columns = ratios.shape
    height, width = first.shape[0], first.shape[1] * channels
    a, b = first.reshape(height, width), second.reshape(height, width)
    kept = np.empty(width, dtype=np.uint8)
    down, along = np.empty((3, width), dtype=np.uint16), np.empty((3, width), dtype=np.uint32)
    least = np.empty(columns)
    step = size * channels
    for row in range(rows):
        _sum_down(a, b, mask, row * size, size, kept, down)
        for part in range(3):
            _sum_along(down[part], size, channels, along[part])
        for column in range(columns):
            if glaring[row, column]:
                bin_sums = along[:, column * step : column * step + channels]
                _without_glare(first, second, mask, row * size, column * size, size, bin_sums)
        for column in range(columns):
            free = np.int64(along[2, column * step])
            counts[row, column] = free
            least[column] = np.float32(floor * max(free, 1))
        for c in range(channels):
            before, after, found = along[0, c:], along[1, c:], ratios[c, row]
            for column in range(columns):
                at = column * step
                found[column] = (after[at] + least[column]) / (before[at] + least[column])


@njit(**COMPILED)
def _sum_down(a: Any, b: Any, mask: Any, top: Any, size: Any, kept: Any, down: Any) -> None:
    """Sums (3, w c) down `size` rows of both images (h, w c) and of 1, where the `mask` (h, w) is
    FREE; `kept` (w c,) is overwritten."""
    first, second, free = down[0], down[1], down[2]
    first[:], second[:], free[:] = 0, 0, 0
    for i in range(top, top + size):
        _spread_mask(mask[i], kept)
        some, other = a[i], b[i]
        for k in range(len(free)):
            first[k] += some[k] & kept[k]
            second[k] += other[k] & kept[k]
            free[k] += kept[k] & 1


@njit(**COMPILED)
def _spread_mask(row: Any, found: Any) -> None:
    """Repeat each value (w,) of a row for every channel, to `found` (w c,)."""
    if len(found) == len(row):
        found[:] = row
        return
    one, two = np.uintp(1), np.uintp(2)
    for j in range(np.uintp(len(row))):
        at = np.uintp(3) * j
        found[at] = found[at + one] = found[at + two] = row[j]


@njit(**COMPILED)
def _sum_along(down: Any, size: Any, channels: Any, found: Any) -> None:
    """Sums (w,) over `size` pixels of one channel, from each place to the right."""
    last = len(down) - channels * (size - 1)
    for k in range(last):
        found[k] = down[k]
    for step in range(1, size):
        ahead = down[channels * step :]
        for k in range(last):
            found[k] += ahead[k]


@njit(**COMPILED)
def _without_glare(
    first: Any, second: Any, mask: Any, top: Any, left: Any, size: Any, found: Any
) -> None:
    """Sums (3, c) of both images, and of 1, over the pixels of a bin that are free and not
    saturated."""
    found[:] = 0
    for i in range(top, top + size):
        for j in range(left, left + size):
            if mask[i, j] == 0 or _glares(first[i, j]) or _glares(second[i, j]):
                continue
            for c in range(found.shape[1]):
                found[0, c] += first[i, j, c]
                found[1, c] += second[i, j, c]
                found[2, c] += 1


@njit(**COMPILED)
def _glares(pixel: Any) -> Any:
    least = pixel[0]
    for c in range(1, len(pixel)):
        least = min(least, pixel[c])
    return least >= SATURATED
