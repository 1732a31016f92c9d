"""Compiled fit of a drift. Import it only where it runs, because it loads numba.

Arrays: `motion` (n, 2) and `arms` (n, 2) motion and place of the markers in px, the latter from
their middle, `chosen` (n,) the markers to use, `fit` (4,) shift x, shift y, scale and rotation,
`near` (n, k) neighbours of each marker on the lattice or -1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED


@njit(**COMPILED)
def residuals(motion: Any, arms: Any, chosen: Any, fit: Any, found: Any) -> None:
    """Write the distance (n,) of each motion from the fit; NaN for markers not chosen."""
    for i in range(len(chosen)):
        found[i] = math.nan
        if chosen[i]:
            x = motion[i, 0] - fit[0] - fit[2] * arms[i, 0] + fit[3] * arms[i, 1]
            y = motion[i, 1] - fit[1] - fit[2] * arms[i, 1] - fit[3] * arms[i, 0]
            found[i] = math.sqrt(x * x + y * y)


@njit(**COMPILED)
def least_squares(motion: Any, arms: Any, weights: Any, fit: Any) -> bool:
    """Write the weighted least squares to `fit`; False if the weights do not determine it."""
    total = ax = ay = mx = my = 0.0
    for i in range(len(weights)):
        w = weights[i]
        if w > 0:
            total += w
            ax += w * arms[i, 0]
            ay += w * arms[i, 1]
            mx += w * motion[i, 0]
            my += w * motion[i, 1]
    if not total > 0:
        return False
    ax, ay, mx, my = ax / total, ay / total, mx / total, my / total
    spread = along = across = 0.0
    for i in range(len(weights)):
        w = weights[i]
        if w > 0:
            x, y = arms[i, 0] - ax, arms[i, 1] - ay
            u, v = motion[i, 0] - mx, motion[i, 1] - my
            spread += w * (x * x + y * y)
            along += w * (x * u + y * v)
            across += w * (x * v - y * u)
    if not spread > 0:
        return False
    fit[2], fit[3] = along / spread, across / spread
    fit[0] = mx - fit[2] * ax + fit[3] * ay
    fit[1] = my - fit[2] * ay - fit[3] * ax
    return True


@njit(**COMPILED)
def biweights(off: Any, width: Any, weights: Any) -> int:
    """Write Tukey's weights (n,) of residuals `off` (n,), 0 for NaN; return how many are not 0."""
    count = 0
    for i in range(len(off)):
        weights[i] = 0.0
        if off[i] < width:
            weights[i] = (1 - (off[i] / width) ** 2) ** 2
            count += 1
    return count


@njit(**COMPILED)
def descend(
    motion: Any, arms: Any, chosen: Any, width: Any, widest: Any, least: Any, fit: Any
) -> float:
    """Fit with a width that is halved from `widest` to `width`; `fit` is the start and the end.

    It ends early where fewer than `least` markers have a weight. Returns the share of the chosen
    markers whose residual is larger than the width.
    """
    off, weights = np.empty(len(chosen)), np.empty(len(chosen))
    now = max(widest, width)
    while now > width / 4:
        residuals(motion, arms, chosen, fit, off)
        if biweights(off, max(now, width), weights) < least:
            break
        if not least_squares(motion, arms, weights, fit):
            break
        now /= 2
    residuals(motion, arms, chosen, fit, off)
    far = count = 0
    for i in range(len(chosen)):
        count += chosen[i]
        far += off[i] > width
    return far / max(count, 1)


@njit(**COMPILED)
def around(marked: Any, near: Any, i: Any) -> int:
    """Number of marked neighbours of a marker."""
    count = 0
    for k in range(near.shape[1]):
        if near[i, k] >= 0 and marked[near[i, k]]:
            count += 1
    return count


@njit(**COMPILED)
def free_markers(off: Any, near: Any, width: Any, fewest: Any, touched: Any, free: Any) -> int:
    """Write the touched and the free markers (n,) for residuals (n,), NaN where not seen.

    Touched is a marker that is off by more than the width with at least `fewest` neighbours. A free
    marker is not off and has no touched neighbour. Returns the number of markers that are neither.
    """
    far = off > width
    for i in range(len(off)):
        touched[i] = far[i] and around(far, near, i) >= fewest
    margin = 0
    for i in range(len(off)):
        beside = not touched[i] and around(touched, near, i) > 0
        free[i] = off[i] <= width and not touched[i] and not beside
        margin += beside and not math.isnan(off[i])
    return margin


@njit(**COMPILED)
def solution(arms: Any, weights: Any, found: Any) -> None:
    """Write by how much the least squares depends on each motion, `found` (4, n, 2)."""
    total = ax = ay = 0.0
    for i in range(len(weights)):
        total += weights[i]
        ax += weights[i] * arms[i, 0]
        ay += weights[i] * arms[i, 1]
    ax, ay = ax / total, ay / total
    spread = 0.0
    for i in range(len(weights)):
        spread += weights[i] * ((arms[i, 0] - ax) ** 2 + (arms[i, 1] - ay) ** 2)
    for i in range(len(weights)):
        mean, share = weights[i] / total, weights[i] / spread
        x, y = share * (arms[i, 0] - ax), share * (arms[i, 1] - ay)
        found[2, i, 0], found[2, i, 1] = x, y
        found[3, i, 0], found[3, i, 1] = -y, x
        found[0, i, 0] = mean - x * ax - y * ay
        found[0, i, 1] = x * ay - y * ax
        found[1, i, 0] = y * ax - x * ay
        found[1, i, 1] = mean - y * ay - x * ax
