"""Compiled composition of a frame and its noise. Imported where used, as it needs numba.

Noise comes from a counter-based generator: the three values of a pixel are one 64-bit hash of its
number, the same in any order and on any number of threads.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def compose(
    irradiance: Any, gain: Any, step: Any, ink: Any, contrast: Any, colour: Any, glare: Any,
    top: Any, out: Any,
) -> None:  # fmt: skip
    """Write rows `top` and on of the grey values: sum over sources of colour · light · (1 - c ink).

    `out` (rows, w, 3) float32 says how many; all else has the whole picture's size (h, w).
    `irradiance` (k, h, w); `contrast` (3,) of the channels; `gain` (r, c, k) on every `step`-th
    pixel, bilinear between, or empty for a level surface; `glare` (h, w, 3) is added, or empty.
    """
    count, width = irradiance.shape[0], irradiance.shape[2]
    shaded, spots, columns = gain.size > 0, glare.size > 0, gain.shape[1]
    one = np.float32(1)
    row, held = np.ones(width, dtype=np.float32), np.empty(columns, dtype=np.float32)
    # A row of each colour lies together, so that several pixels are computed at once.
    sums = np.empty((3, width), dtype=np.float32)
    for n in range(out.shape[0]):
        y = top + n
        sums[:] = 0
        for k in range(count):
            if shaded:
                j = min(y // step, gain.shape[0] - 2)
                v = np.float32((y - j * step) / step)
                for i in range(columns):
                    held[i] = gain[j, i, k] + v * (gain[j + 1, i, k] - gain[j, i, k])
                for i in range(columns - 1):
                    grow = (held[i + 1] - held[i]) / np.float32(step)
                    for x in range(i * step, min((i + 1) * step, width)):
                        row[x] = held[i] + grow * np.float32(x - i * step)
                row[(columns - 1) * step :] = held[columns - 1]
            plane = irradiance[k, y]
            for m in range(3):
                share, total = colour[k, m], sums[m]
                for x in range(width):
                    total[x] += share * (plane[x] * row[x])
        for x in range(width):
            for m in range(3):
                out[n, x, m] = sums[m, x] * (one - contrast[m] * ink[y, x])
        if spots:
            for x in range(width):
                for m in range(3):
                    out[n, x, m] += glare[y, x, m]


@njit(**COMPILED)
def develop(values: Any, curve: Any, image: Any) -> None:
    """Round grey values (n,) float32 to `image` (n,) uint8, held to 0 ... 255.

    `curve` holds the response at steps of 1/16, or is empty for the straight one.
    """
    zero, most, half = np.float32(0), np.float32(255), np.float32(0.5)
    if curve.size == 0:
        for n in range(values.size):
            image[n] = np.uint8(min(max(values[n], zero), most) + half)
    else:
        for n in range(values.size):
            image[n] = curve[int(min(max(values[n], zero), most) * np.float32(16) + half)]


BITS, BATCH = 14, 256


@njit(**COMPILED)
def mixed(value: Any) -> Any:
    """Finaliser of SplitMix64 (Steele, Lea, Flood 2014) of a 64-bit number."""
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@njit(**COMPILED)
def add_noise(image: Any, first: Any, key: Any, table: Any, read2: Any, shot: Any) -> None:
    """Add to `image` (n, 3) float32 noise of variance read2 + shot · value, in place.

    `first` is the number of the first pixel in the whole picture; `table` (2 ** BITS,) holds
    values of the unit normal distribution in equal shares.
    """
    golden, mask = np.uint64(0x9E3779B97F4A7C15), np.uint64((1 << BITS) - 1)
    zero, values = np.float32(0), image.reshape(-1)
    spread, words = np.empty(3 * BATCH, dtype=np.float32), np.empty(BATCH, dtype=np.uint64)
    for begin in range(0, image.shape[0], BATCH):
        count = min(BATCH, image.shape[0] - begin)
        # Roots and hashes apart from the look-up in the table: several are computed at once.
        for k in range(3 * count):
            spread[k] = math.sqrt(read2 + shot * max(values[3 * begin + k], zero))
        for n in range(count):
            words[n] = mixed(key + golden * np.uint64(first + begin + n + 1))
        for n in range(count):
            for c in range(3):
                at = (words[n] >> np.uint64(21 * c + 4)) & mask
                values[3 * (begin + n) + c] += spread[3 * n + c] * table[at]
