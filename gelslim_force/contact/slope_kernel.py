"""Compiled law of the slope under and around an indenter. Import only where it runs: numba.

Inside the patch the slope grows linearly to the rim. Outside, at ρ times the size of the patch, it
is that of Hertz's half-space: (2/π)(ρ asin 1/ρ - √(1 - 1/ρ²)) for a disc and ρ - √(ρ² - 1) for a
strip. A factor exp(-decay (ρ - 1)) accounts for the rigid base of the layer. A second term,
(ρ - 1) exp(-(1 + decay)(ρ - 1)), takes up the remaining difference.

The slope falls off infinitely steeply at the rim. What a bin shows is the mean over its blur, which
is the difference of the integral of the slope at both ends: it has no crease, so that the fit of
the rim is smooth where the rim crosses the middles of bins.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
TABLE, STEP = 80, 0.03
"""Number and size of the table's steps, up to a ratio of 6.8."""
LEAST_BLUR = 1e-3
"""Smallest half-width of the blur, over the size of the patch."""
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
def integrals(decay: Any, strip: Any) -> Any:
    """Integrals from the middle of both terms, and their derivatives (n, 4), outside the rim.

    The steps of √(ratio - 1) are equal, and the derivatives are those for one step: the terms are
    smooth functions of that root. The integrals are Simpson's.
    """
    table = np.empty((TABLE + 1, 4))
    one, two = 0.5, 0.0
    for k in range(TABLE + 1):
        root = k * STEP
        first, second = law(1.0 + root * root, decay, strip)
        weight = 2 * root * STEP
        table[k, 2], table[k, 3] = weight * first, weight * second
        if k > 0:
            root -= STEP / 2
            first, second = law(1.0 + root * root, decay, strip)
            weight = 2 * root * STEP
            one += (table[k - 1, 2] + 4 * weight * first + table[k, 2]) / 6
            two += (table[k - 1, 3] + 4 * weight * second + table[k, 3]) / 6
        table[k, 0], table[k, 1] = one, two
    return table


@njit(**COMPILED)
def _integral(ratio: Any, table: Any) -> Any:
    """Integrals of both terms from the middle, by cubic interpolation; constant after the table."""
    if ratio < 1.0:
        return 0.5 * ratio * ratio, 0.0
    at = math.sqrt(ratio - 1) * (1 / STEP)
    if at >= TABLE:
        return table[TABLE, 0], table[TABLE, 1]
    k = int(at)
    t = at - k
    end = t * t * (3 - 2 * t)
    leaving, arriving = t * (1 - t) * (1 - t), t * t * (t - 1)
    one = table[k, 0] + end * (table[k + 1, 0] - table[k, 0])
    two = table[k, 1] + end * (table[k + 1, 1] - table[k, 1])
    one += leaving * table[k, 2] + arriving * table[k + 1, 2]
    two += leaving * table[k, 3] + arriving * table[k + 1, 3]
    return one, two


@njit(**COMPILED)
def blurred(ratio: Any, blur: Any, table: Any) -> Any:
    """Means of both terms within `blur` of a ratio; the slope has the other sign beyond the middle.

    `table` is that of `integrals`.
    """
    first, second = _integral(ratio + blur, table)
    one, two = _integral(abs(ratio - blur), table)
    return (first - one) / (2 * blur), (second - two) / (2 * blur)


@njit(**COMPILED)
def slope_basis(
    x: Any, y: Any, parallax: Any, theta: Any, strip: Any, curvature: Any, blur: Any, out: Any
) -> None:
    """Write the basis (n, 6) of the shading of bins at x, y (n,) in mm to `out`.

    `theta` (4,) are x, y, radius, decay of a disc, or offset, angle, half-width, decay of a strip.
    Where the curvature 1/R of the indenter is known, bins are moved to where the line of sight
    meets the deformed gel; it moves by `parallax` (n, 2) per mm of height. The slope is the mean
    within `blur` (mm). The columns are: slope along x and y (for a strip: across it, and 0), the
    second term of both, the slope squared, and 1.
    """
    size, decay = theta[2], theta[3]
    sine, cosine, over_size = math.sin(theta[1]), math.cos(theta[1]), 1 / size
    table = integrals(decay, strip)
    wide = max(blur * over_size, LEAST_BLUR)
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
                depth = RIM_SINKING * math.exp(-2 * (ratio - 1))
            z = -size * size * curvature * depth
            px, py = px + parallax[k, 0] * z, py + parallax[k, 1] * z
        slope, second = blurred(r * over_size, wide, table)
        over_r = 1 / r if r > 1e-9 else 0.0
        ux, uy = dx * over_r, dy * over_r
        out[k, 0], out[k, 1] = slope * ux, slope * uy
        out[k, 2], out[k, 3] = second * ux, second * uy
        out[k, 4] = slope * slope
        out[k, 5] = 1.0
