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
QUANTITIES = 3
"""Most sums of columns that a window has."""
WEIGHT, SU, SV, SUU, SUV, SVV = range(6)
"""Sums over a window: weights, and their first and second moments."""


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
def _darkness(row: Any, i: Any, start: Any, base: Any, rise: Any, across: Any, more: Any) -> Any:
    """Distance `u` of a column from the centre, and its darkness; 0 outside the window.

    `across` are the factors of u², u and 1 in a row of the ellipse, and `more` is the last column.
    """
    one, zero = np.float32(1), np.float32(0)
    u = np.float32(i) + start
    dark = one - np.float32(row[i]) / max(base + rise * u, one)
    inside = ((across[0] * u + across[1]) * u + across[2] <= zero) & (np.int32(i) <= more)
    return dark if inside else zero


@njit(**COMPILED)
def _across(window: Any, height: Any) -> Any:
    """Factors of u², u and 1 of an ellipse in the row at `height` from its centre."""
    return (
        np.float32(window[0]),
        np.float32(2 * window[1] * height),
        np.float32(window[2] * height * height - 1),
    )


@njit(**COMPILED)
def window_contrast(
    picture: Any, width: Any, x0: Any, y0: Any, window: Any, plane: Any, lanes: Any
) -> Any:
    """The mean darkness of a window, weighted by darkness; 0 where nothing is dark."""
    left, right, top, bottom = box(window, width, picture.shape[0], x0, y0)
    zero, rise = np.float32(0), np.float32(plane[1])
    mass = square = 0.0
    for first in range(left, right + 1, LANES):
        start, more = np.float32(first - x0), np.int32(right - first)
        for i in range(2 * LANES):
            lanes[i] = zero
        for y in range(top, bottom + 1):
            height = y - y0
            across, base = _across(window, height), np.float32(plane[0] + plane[2] * height)
            row = picture[y, first : first + LANES]
            for i in range(LANES):
                dark = max(_darkness(row, i, start, base, rise, across, more), zero)
                lanes[i] += dark
                lanes[LANES + i] += dark * dark
        for i in range(LANES):
            mass += lanes[i]
            square += lanes[LANES + i]
    return square / mass if mass > 0 else 0.0


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
    """Write the sums (6,) over a window; weights rise from 0 to 1 between two darknesses."""
    left, right, top, bottom = box(window, width, picture.shape[0], x0, y0)
    scale, offset = np.float32(1 / (high - low)), np.float32(low / (high - low))
    one, zero, rise = np.float32(1), np.float32(0), np.float32(plane[1])
    for i in range(SVV + 1):
        sums[i] = 0.0
    for first in range(left, right + 1, LANES):
        start, more = np.float32(first - x0), np.int32(right - first)
        for i in range(QUANTITIES * LANES):
            lanes[i] = zero
        for y in range(top, bottom + 1):
            height = y - y0
            across, base = _across(window, height), np.float32(plane[0] + plane[2] * height)
            v, row = np.float32(height), picture[y, first : first + LANES]
            for i in range(LANES):
                dark = _darkness(row, i, start, base, rise, across, more)
                weight = min(max(dark * scale - offset, zero), one)
                side = weight * v
                lanes[i] += weight
                lanes[LANES + i] += side
                lanes[2 * LANES + i] += side * v
        for i in range(LANES):
            u = first + i - x0
            weight, side = float(lanes[i]), float(lanes[LANES + i])
            sums[WEIGHT] += weight
            sums[SU] += weight * u
            sums[SV] += side
            sums[SUU] += weight * u * u
            sums[SUV] += side * u
            sums[SVV] += lanes[2 * LANES + i]
