"""Where the fold search looks: a coarse grid of candidates, then ever smaller ones.

Three unknowns (mean ray angle, spread of the rays as a share of the field of view, turn of the view
at the mirror) are searched on a coarse grid and then on ever smaller grids around the best
candidate of each band of ray angles: steep and upright views are separate valleys, joined by
infeasible folds. The best fold often lies where two limits meet, on a ridge along which the turn
hardly changes; an axis therefore keeps its width as long as its best candidate lies at the rim.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold.goal import BEYOND_MM, INFEASIBLE_MM
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem

LOWER = np.array([np.radians(-12.0), 0.25, np.radians(20.0)])
UPPER = np.array([np.radians(58.0), 1.0, np.radians(56.0)])
COARSE = (36, 10, 20)
FINE = 5
SHRINK = 0.7
LEVELS = 8
RIM = 0.6
"""A best candidate beyond this share of the half width lies at the rim of its axis."""
BANDS = 12
"""Into which the coarse grid's mean ray angles are split."""
STARTS = BANDS + 1
"""The last one keeps the view upright, where near and far edge have the same pixels: the most
pixels lie on this narrow ridge, from which the coarse spreads of a band lead away."""
NEAR_DEPTH_MM, NEAR_LENGTH_MM, NEAR_PX, NEAR_BEYOND_MM, NEAR_MISSED = 0.5, 5.0, 1.0, 5.0, 0.1
"""How far the best candidate of a band may be above that of the best band and still be polished: in
mm of depth or length or in pixels of the goal; in mm outside the housing; as a part of the score
where limits of the view are missed."""


class Best(NamedTuple):
    """The first best candidate of each grid, (n,) each."""

    mid_rad: Array
    spread: Array
    turn_rad: Array
    score: Array


BestOfGrids = Callable[[Array, Array, Array, Array], Best]
"""From the three axes (n, k) of n grids, and a score (n,) that no grid's best is above."""


def best_of_bands(count: int, best_of_grids: BestOfGrids) -> Best:
    """The best candidate of each band; candidate and grid i are of design i % `count`."""
    axes = [np.linspace(lo, hi, n) for lo, hi, n in zip(LOWER, UPPER, COARSE, strict=True)]
    mids = np.vstack([axes[0].reshape(BANDS, -1), np.zeros(len(axes[0]) // BANDS)])
    bands = np.repeat(mids, count, axis=0)
    rest = [np.broadcast_to(axis, (len(bands), len(axis))) for axis in axes[1:]]
    best = best_of_grids(bands, rest[0], rest[1], np.full(len(bands), np.inf))
    ticks = np.linspace(-1.0, 1.0, FINE)
    step = (UPPER - LOWER) / (np.array(COARSE) - 1)
    width = np.tile(step[:, None], len(bands))
    width[0, -count:] = 0.0
    for _ in range(LEVELS):
        middle = np.stack(best[:3])
        around = [
            np.clip(m[:, None] + ticks * w[:, None], lower, upper)
            for m, w, lower, upper in zip(middle, width, LOWER, UPPER, strict=True)
        ]
        best = best_of_grids(around[0], around[1], around[2], best.score)
        width = width * np.where(np.abs(np.stack(best[:3]) - middle) > RIM * width, 1.0, SHRINK)
    return best


def contenders(problem: FoldProblem, best: Best) -> NDArray[np.intp]:
    """Bands whose candidate is not far above the best of its design."""
    least = np.tile(best.score.reshape(STARTS, len(problem)).min(axis=0), STARTS)
    goal = (
        NEAR_DEPTH_MM * problem.depth_worth
        + NEAR_LENGTH_MM * problem.length_worth
        + NEAR_PX * problem.pixel_worth_mm
    )
    near = np.where(least < BEYOND_MM, np.tile(np.ravel(goal), STARTS), NEAR_BEYOND_MM)
    allowed = least + np.where(least < INFEASIBLE_MM, near, NEAR_MISSED * least)
    return np.flatnonzero(best.score <= allowed)
