"""Compiled sums over elliptic windows of a picture, sixteen pixels of a row at a time.

Import it only where it runs, because it loads numba. Pictures are the sums of the colour channels,
(h, w + LANES) uint16; the last columns are never used, they only let every load have sixteen
pixels. An ellipse (a, b, c, box_x, box_y) is a u² + 2 b u v + c v² <= 1 about its centre, with its
half box in px. A plane (level, slope x, slope y) is the light about that centre.

Sums of sixteen columns are kept beside each other in `lanes`, quantity after quantity, so that
the compiler can use vector instructions without changing the order of any sum.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

# Sums are not reordered: with full fastmath, cached code had another order than new code.
COMPILED: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz"},
}
LANES = 16
QUANTITIES = 5
MASS, SQUARE, WEIGHT, SU, SV, SUU, SUV, SVV = range(8)
"""Sums over a window: darkness, its square, weights, and the weights' first and second moments."""


@njit(**COMPILED)
def ellipse(mxx: Any, mxy: Any, myy: Any, factor: Any, margin: Any) -> Any:
    """Ellipse whose semi-axes are factor * axis + margin, for second moments in px².

    A filled ellipse has the second moment axis² / 4.
    """
    middle = 0.5 * (mxx + myy)
    spread = math.sqrt(0.25 * (mxx - myy) ** 2 + mxy * mxy)
    long = factor * 2.0 * math.sqrt(middle + spread) + margin
    short = factor * 2.0 * math.sqrt(max(middle - spread, 0.05)) + margin
    cos2, sin2 = 1.0, 0.0
    if spread > 0:
        cos2, sin2 = 0.5 * (mxx - myy) / spread, mxy / spread
    mean, half = 0.5 * (1 / long**2 + 1 / short**2), 0.5 * (1 / long**2 - 1 / short**2)
    mean2, half2 = 0.5 * (long**2 + short**2), 0.5 * (long**2 - short**2)
    box_x, box_y = math.sqrt(mean2 + half2 * cos2), math.sqrt(mean2 - half2 * cos2)
    return mean + half * cos2, half * sin2, mean - half * cos2, box_x, box_y


@njit(**COMPILED)
def box(shape: Any, width: Any, height: Any, x0: Any, y0: Any) -> Any:
    """First and last column, first and last row of the ellipse in the picture; may be empty."""
    return (
        max(0, math.ceil(x0 - shape[3])),
        min(width - 1, math.floor(x0 + shape[3])),
        max(0, math.ceil(y0 - shape[4])),
        min(height - 1, math.floor(y0 + shape[4])),
    )


@njit(**COMPILED)
def _window_lanes(
    picture: Any,
    first: Any,
    last: Any,
    top: Any,
    bottom: Any,
    x0: Any,
    y0: Any,
    window: Any,
    plane: Any,
    scale: Any,
    offset: Any,
    lanes: Any,
) -> None:
    """Write sums over the rows of a window for the columns from `first` on, up to `last`."""
    one, zero = np.float32(1), np.float32(0)
    wa, rise = np.float32(window[0]), np.float32(plane[1])
    start, more = np.float32(first - x0), np.int32(last - first)
    scale, offset = np.float32(scale), np.float32(offset)
    lanes[:] = zero
    for y in range(top, bottom + 1):
        height = y - y0
        v = np.float32(height)
        wb, wc = np.float32(2 * window[1] * height), np.float32(window[2] * height * height - 1)
        base = np.float32(plane[0] + plane[2] * height)
        row = picture[y, first : first + LANES]
        for i in range(LANES):
            u = np.float32(i) + start
            dark = one - np.float32(row[i]) / max(base + rise * u, one)
            inside = ((wa * u + wb) * u + wc <= zero) & (np.int32(i) <= more)
            dark = dark if inside else zero
            positive = max(dark, zero)
            weight = min(max(dark * scale - offset, zero), one)
            side = weight * v
            lanes[i] += positive
            lanes[LANES + i] += positive * positive
            lanes[2 * LANES + i] += weight
            lanes[3 * LANES + i] += side
            lanes[4 * LANES + i] += side * v


@njit(**COMPILED)
def window_sums(
    picture: Any,
    width: Any,
    x0: Any,
    y0: Any,
    window: Any,
    plane: Any,
    low: Any,
    high: Any,
    lanes: Any,
    sums: Any,
) -> None:
    """Write the sums (8,) over a window; weights rise from 0 to 1 between two darknesses."""
    left, right, top, bottom = box(window, width, picture.shape[0], x0, y0)
    scale, offset = 1 / (high - low), low / (high - low)
    sums[:] = 0.0
    for first in range(left, right + 1, LANES):
        _window_lanes(
            picture, first, right, top, bottom, x0, y0, window, plane, scale, offset, lanes
        )
        for i in range(LANES):
            u = first + i - x0
            weight, side = float(lanes[2 * LANES + i]), float(lanes[3 * LANES + i])
            sums[MASS] += lanes[i]
            sums[SQUARE] += lanes[LANES + i]
            sums[WEIGHT] += weight
            sums[SU] += weight * u
            sums[SV] += side
            sums[SUU] += weight * u * u
            sums[SUV] += side * u
            sums[SVV] += lanes[4 * LANES + i]
