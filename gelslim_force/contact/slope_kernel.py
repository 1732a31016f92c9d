"""Compiled law of the slope under and beside an indenter. Import only where it runs: numba.

Under it the slope grows evenly to the rim. Beside it, Hertz's half-space, for a disc
(2/π)(ρ asin 1/ρ - √(1 - 1/ρ²)) and for a strip ρ - √(ρ² - 1), times exp(-decay (ρ - 1)) for the
nearness of the layer's base; what that misses is a second term, (ρ - 1) exp(-(1 + decay)(ρ - 1)).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
GAUSS_AT = 0.7745966692414834
GAUSS_OUTER, GAUSS_MIDDLE = 5 / 18, 8 / 18
TABLE, STEP = 160, 0.015
"""Steps of the table, to a ratio of 6.8."""
RIM_SINKING = 0.1
MIDDLE_SINKING = 0.6
"""Sinking at the rim and in the middle, in a²/R: rough, to place what is seen."""


@njit(**COMPILED)
def law(ratio: Any, decay: Any, strip: Any) -> Any:
    """The slope's two terms at a distance `ratio` from the middle, over the patch's size."""
    if ratio < 1.0:
        return ratio, 0.0
    if strip:
        free = ratio - math.sqrt(ratio * ratio - 1)
    else:
        over = 1.0 / ratio
        free = 2 / math.pi * (ratio * math.asin(over) - math.sqrt(1 - over * over))
    beyond = ratio - 1
    fade = math.exp(-decay * beyond)
    return free * fade, beyond * math.exp(-beyond) * fade


@njit(**COMPILED)
def _tabulated(decay: Any, strip: Any) -> Any:
    """Both terms and the rim's sinking (n, 3) at even steps of √(ratio - 1), in which they are
    smooth."""
    table = np.empty((TABLE + 2, 3))
    for k in range(TABLE + 2):
        beyond = (k * STEP) ** 2
        table[k, 0], table[k, 1] = law(1.0 + beyond, decay, strip)
        table[k, 2] = math.exp(-2 * beyond)
    return table


@njit(**COMPILED)
def _looked_up(ratio: Any, table: Any, column: Any) -> Any:
    """A column by linear interpolation, its end beyond; `ratio` from 1."""
    at = min(math.sqrt(ratio - 1) * (1 / STEP), TABLE)
    k = int(at)
    return table[k, column] + (at - k) * (table[k + 1, column] - table[k, column])


@njit(**COMPILED)
def _both(ratio: Any, table: Any) -> Any:
    if ratio < 1.0:
        return ratio, 0.0
    at = min(math.sqrt(ratio - 1) * (1 / STEP), TABLE)
    k = int(at)
    part = at - k
    return (
        table[k, 0] + part * (table[k + 1, 0] - table[k, 0]),
        table[k, 1] + part * (table[k + 1, 1] - table[k, 1]),
    )


@njit(**COMPILED)
def slope_basis(
    x: Any, y: Any, lean: Any, theta: Any, strip: Any, curvature: Any, blur: Any, out: Any
) -> None:
    """Write the functions (n, 6) that the shading of bins at x, y (n,) mm is made of to `out`.

    `theta` (4,) are x, y, radius, decay of a disc, or offset, angle, half-width, decay of a strip.
    Where the curvature 1/R of the indenter is known, bins are placed where the line of sight,
    moving by `lean` (n, 2) per mm of height, meets the sunken gel. `blur` (mm) widens the crease
    at the rim. Columns: slope along x and y (a strip: across, 0), the second term of both, the
    slope squared, 1. The law is interpolated to 1e-5 of the slope at the rim.
    """
    size, decay = theta[2], theta[3]
    sine, cosine, over_size = math.sin(theta[1]), math.cos(theta[1]), 1 / size
    table = _tabulated(decay, strip)
    for k in range(len(x)):
        px, py = x[k], y[k]
        for turn in range(2):
            if strip:
                dx, dy = cosine * py - sine * px - theta[0], 0.0
            else:
                dx, dy = px - theta[0], py - theta[1]
            r = math.sqrt(dx * dx + dy * dy)
            if turn == 1 or curvature <= 0:
                break
            ratio = r * over_size
            if ratio < 1:
                sunk = MIDDLE_SINKING - 0.5 * ratio * ratio
            else:
                sunk = RIM_SINKING * _looked_up(ratio, table, 2)
            z = -size * size * curvature * sunk
            px, py = px + lean[k, 0] * z, py + lean[k, 1] * z
        slope, second = _both(r * over_size, table)
        slope, second = slope * GAUSS_MIDDLE, second * GAUSS_MIDDLE
        for side in (-GAUSS_AT, GAUSS_AT):
            one, two = _both(abs(r + side * blur) * over_size, table)
            slope += GAUSS_OUTER * one
            second += GAUSS_OUTER * two
        over_r = 1 / r if r > 1e-9 else 0.0
        ux, uy = dx * over_r, dy * over_r
        out[k, 0], out[k, 1] = slope * ux, slope * uy
        out[k, 2], out[k, 3] = second * ux, second * uy
        out[k, 4] = slope * slope
        out[k, 5] = 1.0
