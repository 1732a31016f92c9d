"""Compiled level, noise and trend of the light by a part of its bins. Import only where it runs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def upper_median(values: Any) -> Any:
    """The upper median of values (n,)."""
    half = len(values) // 2
    return np.partition(values, half)[half]


@njit(**COMPILED)
def middle_and_spread(seen: Any, scale: Any, robust: Any, middle: Any, spread: Any) -> None:
    """Medians of rows (c, n), and standard deviations over those of `scale` (c, n).

    Args:
        seen: (c, n).
        scale: (c, n) standard deviations up to a factor for each row.
        robust: Standard deviation over the median absolute deviation.
        middle: Receives (c, 1).
        spread: Receives (c, 1).
    """
    for c in range(len(seen)):
        middle[c, 0] = upper_median(seen[c])
        off = np.abs(seen[c] - middle[c, 0]) / scale[c]
        spread[c, 0] = spread.dtype.type(robust) * upper_median(off)


@njit(**COMPILED)
def halves_differ(seen: Any, spread: Any, scale: Any, place: Any, least: Any, found: Any) -> None:
    """Mark in `found` (c,) the rows whose medians on both sides of the mean place differ.

    Args:
        seen: (c, n).
        spread: (c, 1) standard deviation over `scale`.
        scale: (c, n).
        place: (n,) along an axis of the picture.
        least: Difference of the medians, over the mean standard deviation, from which it is one.
        found: (c,).
    """
    middle = place.mean()
    one, other = place < middle, place >= middle
    if not one.any() or not other.any():
        return
    for c in range(len(seen)):
        apart = abs(upper_median(seen[c][one]) - upper_median(seen[c][other]))
        found[c] |= apart > least * (spread[c, 0] * scale[c]).mean()
