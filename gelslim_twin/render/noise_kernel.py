"""Compiled sensor noise from a counter-based stream. Import only where it runs: numba.

Every pixel's three values come from one 64-bit hash of its number: the same whatever the order,
the number of threads or what else is drawn.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
BITS = 14


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
    zero = np.float32(0)
    for n in range(image.shape[0]):
        word = mixed(key + golden * np.uint64(first + n + 1))
        for c in range(3):
            value = image[n, c]
            spread = math.sqrt(read2 + shot * max(value, zero))
            at = (word >> np.uint64(21 * c + 4)) & mask
            image[n, c] = value + spread * table[at]
