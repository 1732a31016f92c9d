"""From the best of each band of ray angles to the one best fold of a design.

The goal is reached first. Folds that come within EQUAL_MM of it count as equal, and among them the
next wishes decide: the shorter finger (after the goal "shortest", the thinner one), then the use of
the picture, then the smaller keystone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gelslim_cad.dimensions.fold.goal import BEYOND_MM
from gelslim_cad.dimensions.fold.grids import Best, contenders
from gelslim_cad.dimensions.fold.mirror import mirror_angle_rad
from gelslim_cad.dimensions.fold.pieces import DEPTHS, LENGTHS, PIXELS, Designs, Measure, scores
from gelslim_cad.dimensions.fold.polish import Candidates, polished
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem

EQUAL_MM = 0.05
"""Fingers whose thickness (or length) differs by no more count as equal."""
EQUAL_PX = 0.05
SAME_BAND, SAME_PLACE = 0.02, 2e-3
"""Candidates as near to each other, in radians and parts of the view, lead to the same place."""


def closest(problem: FoldProblem, bands: Best, by: Callable[[FoldProblem], Measure]) -> Array:
    """The best candidate of each of n designs: mean ray, spread and angle of the mirror, (n, 3).

    Args:
        problem: The limits and goals of the designs.
        bands: The best candidates of the grids; candidate i is one of design i % n.
        by: How candidates of a problem are measured.
    """
    near = contenders(problem, bands)
    angle = mirror_angle_rad(bands.turn_rad, bands.mid_rad)
    places = np.stack([bands.mid_rad, bands.spread, angle], axis=1)
    start = Candidates(near % len(problem), places[near], bands.score[near])
    measure = by(problem)
    reached = polished(problem, measure, _different(start, SAME_BAND))
    best = reached.rows(_best_of_each(reached))
    weighted = (problem.depth_worth > 0) & (
        (problem.length_worth > 0) | (problem.pixel_worth_mm > 0)
    )
    open_ = (best.score < BEYOND_MM) & ~np.ravel(weighted)
    equal = open_[reached.design] & (reached.score <= best.score[reached.design] + EQUAL_MM)
    if equal.any():
        wish = _next_wish(problem, measure(best.design, best.place[:, None])[:, 0])
        measure = by(wish)
        rest = _different(reached.rows(equal), SAME_PLACE)
        rest = rest._replace(
            score=scores(wish, rest.design, measure(rest.design, rest.place[:, None])[:, 0])
        )
        rest = polished(wish, measure, rest)
        chosen = rest.rows(_best_of_each(rest))
        best.place[chosen.design] = chosen.place
    return best.place


def _different(candidates: Candidates, apart: float) -> Candidates:
    """Of a design's candidates that lie in one cell of the size `apart` only the best."""
    order = np.argsort(candidates.score, kind="stable")
    cells = np.column_stack([candidates.design, np.round(candidates.place / apart)])[order]
    _, first = np.unique(cells, axis=0, return_index=True)
    return candidates.rows(np.sort(order[first]))


def _best_of_each(candidates: Candidates) -> Designs:
    """Indices of the first best candidate of each design that has one, in order of the designs."""
    order = np.lexsort((candidates.score, candidates.design))
    _, first = np.unique(candidates.design[order], return_index=True)
    return order[first]


def _next_wish(problem: FoldProblem, measured: Array) -> FoldProblem:
    """The problem whose limits are the goals that were reached, and whose goal is the next wish."""

    def one(values: Array) -> Array:
        return np.reshape(values, problem.max_depth_mm.shape)

    depth = np.maximum(one(measured[:, DEPTHS].max(axis=1)), problem.guide_stack_mm)
    length = one(measured[:, LENGTHS].max(axis=1))
    px = one(measured[:, PIXELS].min(axis=1))
    thin, short = problem.depth_worth > 0, problem.length_worth > 0
    picture = problem.pixel_worth_mm > 0
    return replace(
        problem,
        max_depth_mm=np.where(thin, _loosened(depth, problem.max_depth_mm), problem.max_depth_mm),
        max_length_mm=np.where(
            short, _loosened(length, problem.max_length_mm), problem.max_length_mm
        ),
        min_px_per_marker=np.where(
            picture, np.maximum(problem.min_px_per_marker, px - EQUAL_PX), problem.min_px_per_marker
        ),
        depth_worth=np.where(short, 1.0, 0.0),
        length_worth=np.where(short, 0.0, 1.0),
        pixel_worth_mm=0 * px,
    )


def _loosened(reached_mm: Array, limit_mm: Array) -> Array:
    """The largest length that counts as equal to the one that was reached.

    Where the one that was reached keeps the limit, so does this.
    """
    return np.minimum(reached_mm + EQUAL_MM, np.maximum(limit_mm, reached_mm + 1e-6))
