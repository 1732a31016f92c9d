"""Where the fold search looks: a coarse grid of candidates, then ever smaller ones.

Three unknowns (mean ray angle, used part of the field of view, mirror angle) are searched on a
coarse grid and then on ever smaller grids around the best candidate of each band of ray angles:
steep and upright views are separate valleys, joined by infeasible folds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold_problem import Array

LOWER = np.array([np.radians(-12.0), 0.25, np.radians(12.0)])
UPPER = np.array([np.radians(58.0), 1.0, np.radians(50.0)])
COARSE = (18, 10, 20)
FINE = 5
SHRINK = 0.7
LEVELS = 26
STARTS = 6
"""Bands into which the coarse grid's mean ray angles are split."""


class Best(NamedTuple):
    """The first best candidate of each grid, (n,) each."""

    mid_rad: Array
    spread: Array
    mirror_rad: Array
    score: Array


BestOfGrids = Callable[[Array, Array, Array, Array], Best]
"""From the three axes (n, k) of n grids, and a score (n,) that no grid's best is above."""


def best_candidates(count: int, best_of_grids: BestOfGrids) -> Best:
    """The best candidate of each of `count` designs; grid i is one of design i % `count`."""
    axes = [np.linspace(lo, hi, n) for lo, hi, n in zip(LOWER, UPPER, COARSE, strict=True)]
    bands = np.repeat(axes[0].reshape(STARTS, -1), count, axis=0)
    rest = [np.broadcast_to(axis, (len(bands), len(axis))) for axis in axes[1:]]
    best = best_of_grids(bands, rest[0], rest[1], np.full(len(bands), np.inf))
    ticks = np.linspace(-1.0, 1.0, FINE)
    width = (UPPER - LOWER) / (np.array(COARSE) - 1)
    for _ in range(LEVELS):
        around = [
            np.clip(middle[:, None] + ticks * w, lower, upper)
            for middle, w, lower, upper in zip(best[:3], width, LOWER, UPPER, strict=True)
        ]
        best = best_of_grids(around[0], around[1], around[2], best.score)
        width = width * SHRINK
    winner = np.argmin(best.score.reshape(STARTS, count), axis=0) * count + np.arange(count)
    return Best(*(values[winner] for values in best))
