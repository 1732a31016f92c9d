"""Compiled law of the slope under and around an indenter. Import only where it runs: numba.

Inside the patch the slope grows linearly to the rim. Outside, at ρ times the size of the patch, it
is that of Hertz's half-space: (2/π)(ρ asin 1/ρ - √(1 - 1/ρ²)) for a disc and ρ - √(ρ² - 1) for a
strip. A factor exp(-decay (ρ - 1)) accounts for the rigid base of the layer. A second term,
(ρ - 1) exp(-(1 + decay)(ρ - 1)), takes up the remaining difference.
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
"""Number and size of the table's steps, up to a ratio of 6.8."""
RIM_SINKING = 0.1
MIDDLE_SINKING = 0.6
"""Approximate depth of the surface at the rim and in the middle, in a²/R."""


@njit(**COMPILED)
def law(ratio: Any, decay: Any, strip: Any) -> Any:
    """The two terms of the slope, at `ratio` times the patch's size from its middle."""
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
    """Both terms and the decay of the depth outside the rim (n, 3), at equal steps of √(ratio - 1).

    They are smooth functions of that root."""
    table = np.empty((TABLE + 2, 3))
    for k in range(TABLE + 2):
        beyond = (k * STEP) ** 2
        table[k, 0], table[k, 1] = law(1.0 + beyond, decay, strip)
        table[k, 2] = math.exp(-2 * beyond)
    return table


@njit(**COMPILED)
def _looked_up(ratio: Any, table: Any, column: Any) -> Any:
    """A column by linear interpolation, for `ratio` >= 1; constant beyond the table."""
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
    x: Any, y: Any, parallax: Any, theta: Any, strip: Any, curvature: Any, blur: Any, out: Any
) -> None:
    """Write the basis (n, 6) of the shading of bins at x, y (n,) in mm to `out`.

    `theta` (4,) are x, y, radius, decay of a disc, or offset, angle, half-width, decay of a strip.
    Where the curvature 1/R of the indenter is known, bins are moved to where the line of sight
    meets the deformed gel; it moves by `parallax` (n, 2) per mm of height. `blur` (mm) widens the
    crease at the rim. The columns are: slope along x and y (for a strip: across it, and 0), the
    second term of both, the slope squared, and 1. The error of the interpolation is 1e-5 of the
    slope at the rim.
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
                depth = MIDDLE_SINKING - 0.5 * ratio * ratio
            else:
                depth = RIM_SINKING * _looked_up(ratio, table, 2)
            z = -size * size * curvature * depth
            px, py = px + parallax[k, 0] * z, py + parallax[k, 1] * z
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
