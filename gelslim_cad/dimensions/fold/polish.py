"""The last hundredths of a millimetre: sequential linear programming from the best of the grids.

The best fold lies where limits meet, and grids creep along the ridge between them. Here goal and
limits are linearised about a candidate, the linear program within a trust region is solved
exactly, and its solution is brought back to limits that curve away. Many candidates at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold.goal import BEYOND_MM, FEASIBLE, LENGTH_TIE
from gelslim_cad.dimensions.fold.grids import LOWER, UPPER
from gelslim_cad.dimensions.fold.mirror import FLATTEST_RAD, STEEPEST_RAD
from gelslim_cad.dimensions.fold.pieces import (
    CLASHES,
    DEPTHS,
    ENVELOPE,
    LENGTHS,
    PIXELS,
    TIE,
    Designs,
    Measure,
    Pieces,
    scores,
)
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem
from gelslim_cad.dimensions.fold.room import SCALE_MM
from gelslim_cad.dimensions.fold.small_programs import Largest, Programs, objective, solved

STEPS = 40
FIRST_RADIUS, LARGEST_RADIUS, LEAST_RADIUS = 0.03, 0.2, 1e-6
"""Half width of the trust region, in radians and parts of the field of view."""
LEAST = np.array([*LOWER[:2], FLATTEST_RAD])
MOST = np.array([*UPPER[:2], STEEPEST_RAD])
DIFFERENCE = 1e-7
RESERVE, DIGITS = 1e-8, 10
"""How far the limits are kept, so that rounding to so many digits does not break them.

Rounded angles are the same on every processor, where the last bits of a solution are not.
"""
WEIGHT = 1e4
"""Of a missed limit, in mm per part: more than any limit can save."""
NEVER_MISSED = -100.0
LEAST_GAIN = 1e-4
"""Steps that promise less, in mm or by their weight in parts of a limit, end the descent."""
HOPELESS = 5
"""A candidate's descent ends if not even so many steps like the last would make it the best."""


class Candidates(NamedTuple):
    """Candidates of designs (n,), and their scores (n,)."""

    design: Designs
    place: Array
    """Mean ray angle, spread of the rays and angle of the mirror, (n, 3)."""
    score: Array

    def rows(self, chosen: Designs | NDArray[np.bool_]) -> Candidates:
        """The candidates in `chosen`."""
        return Candidates(self.design[chosen], self.place[chosen], self.score[chosen])


class _At(NamedTuple):
    """Candidates (n, 3) with what is known of them."""

    place: Array
    measured: Array
    """(n, m)."""
    slopes: Array
    """(n, m, 3)."""
    goal: Array
    """(n,)."""
    missed: Array
    """The limit that is missed most, (n,)."""


def polished(problem: FoldProblem, measure: Measure, start: Candidates) -> Candidates:
    """Move candidates to the optimum next to them.

    A candidate that misses limits is moved until it keeps them all, where there is such a place
    near it. Where there is none, the envelope is missed as little as possible, and all else kept.

    Args:
        problem: The limits and goals of the designs.
        measure: What these limits and goals are at a candidate.
        start: The candidates.

    Returns:
        Candidates whose scores are at most those of `start`.
    """
    found = _Descent(problem, measure, start.design, all_limits=True).run(start)
    short = np.flatnonzero(found.score >= BEYOND_MM)
    if len(short) == 0:
        return found
    tried = start.rows(short)
    tried = _Descent(problem, measure, tried.design, all_limits=False).run(tried)
    better = tried.score < found.score[short]
    for values, new in zip(found, tried, strict=True):
        values[short[better]] = new[better]
    return found


class _Descent:
    """Steps of linear programming for candidates of these designs.

    With all limits the goal of the designs is made least; else what they are outside the envelope,
    under the other limits.
    """

    def __init__(
        self, problem: FoldProblem, measure: Measure, design: Designs, all_limits: bool
    ) -> None:
        self.problem, self.measure, self.design = problem, measure, design
        self.all_limits = all_limits
        self.rows = problem.rows(design)

    def run(self, start: Candidates) -> Candidates:
        """Candidates from which no step promises to gain more."""
        open_ = np.arange(len(start.design))
        here = self._at(open_, start.place)
        radius = np.full(len(open_), FIRST_RADIUS)
        place = start.place.copy()
        best = np.full(len(self.problem), np.inf)
        for _ in range(STEPS):
            there, promised = self._step(open_, here, radius)
            better = _better(there, here)
            place[open_[better]] = there.place[better]
            here = _chosen(better, there, here)
            radius = np.where(better, np.minimum(2 * radius, LARGEST_RADIUS), radius / 4)
            best = self._best_goals(open_, here, best)
            hopeless = (here.missed <= FEASIBLE) & (
                here.goal - HOPELESS * promised > best[self.design[open_]]
            )
            going = (promised > LEAST_GAIN) & (radius > LEAST_RADIUS) & ~hopeless
            if not going.any():
                break
            open_, radius = open_[going], radius[going]
            here = _At(*(values[going] for values in here))
        return self._rounded(start, place)

    def _best_goals(self, open_: Designs, here: _At, best: Array) -> Array:
        """The best goal of each design so far, of candidates that keep all limits."""
        best = best.copy()
        np.minimum.at(
            best, self.design[open_], np.where(here.missed <= FEASIBLE, here.goal, np.inf)
        )
        return best

    def _rounded(self, start: Candidates, place: Array) -> Candidates:
        rounded: Array = np.round(place, DIGITS).astype(float)
        measured = self.measure(self.design, rounded[:, None])[:, 0]
        found = scores(self.problem, self.design, measured)
        gained = found < start.score
        return Candidates(
            start.design,
            np.where(gained[:, None], rounded, start.place),
            np.where(gained, found, start.score),
        )

    def _at(self, open_: Designs, place: Array) -> _At:
        """Measures and, by differences, their slopes."""
        around = place[:, None] + DIFFERENCE * np.concatenate([np.zeros((1, 3)), np.eye(3)])
        # A limit that a candidate cannot miss is minus infinity.
        found = np.maximum(self.measure(self.design[open_], around), NEVER_MISSED)
        values = found[:, 0]
        slopes = np.swapaxes(found[:, 1:] - found[:, :1], 1, 2) / DIFFERENCE
        nowhere = np.zeros_like(place)
        program = self._program(open_, values, slopes, nowhere, nowhere)
        goal = sum(term.worth * term.values.max(axis=1) for term in program.largest)
        if self.all_limits:
            goal = goal + values[:, TIE][:, 0]
        return _At(place, values, slopes, goal, program.missed.max(axis=1) - RESERVE)

    def _program(
        self, open_: Designs, values: Array, slopes: Array, low: Array, high: Array
    ) -> Programs:
        """The linearised problem."""
        p = self.rows.rows(open_)
        at, turned = Pieces.of(p, values[..., None]), Pieces.of(p, values[..., None], slopes)
        view, housing = at.view[..., 0], at.housing[..., 0]
        if self.all_limits:
            largest = _goals(p, values, slopes)
            view = np.concatenate([view, housing / SCALE_MM], axis=1)
            view_slopes = np.concatenate([turned.view, turned.housing / SCALE_MM], axis=1)
        else:
            over = housing[:, ENVELOPE], turned.housing[:, ENVELOPE]
            largest = (_with(*over, np.zeros(len(p)), np.ones(len(p))),)
            view = np.concatenate([view, housing[:, CLASHES] / SCALE_MM], axis=1)
            clashes = turned.housing[:, CLASHES] / SCALE_MM
            view_slopes = np.concatenate([turned.view, clashes], axis=1)
        return Programs(
            largest=largest,
            plain=slopes[:, TIE][:, 0] if self.all_limits else np.zeros_like(low),
            missed=view + RESERVE,
            missed_slopes=view_slopes,
            low=low,
            high=high,
            weight=WEIGHT,
        )

    def _step(self, open_: Designs, here: _At, radius: Array) -> tuple[_At, Array]:
        """The best candidates of the linearised problem, and how much it promises to gain."""
        low = np.maximum(-radius[:, None], np.minimum(LEAST - here.place, 0.0))
        high = np.minimum(radius[:, None], np.maximum(MOST - here.place, 0.0))
        program = self._program(open_, here.measured, here.slopes, low, high)
        d = solved(program)
        promised = objective(program, 0.0 * d) - objective(program, d)
        there = self._at(open_, here.place + d)
        again = np.flatnonzero(~_better(there, here))
        if len(again):
            # The same slopes through the values there: what curves away is made good.
            slopes = here.slopes[again]
            values = there.measured[again] - np.einsum("nij,nj->ni", slopes, d[again])
            corrected = self._program(open_[again], values, slopes, low[again], high[again])
            second = self._at(open_[again], here.place[again] + solved(corrected))
            for all_, new in zip(there, second, strict=True):
                all_[again] = new
        return there, promised


def _goals(p: FoldProblem, values: Array, slopes: Array) -> tuple[Largest, ...]:
    """Depth, length and pixels as terms of the goal."""
    worth = {f: getattr(p, f)[:, 0, 0] for f in ("depth_worth", "length_worth", "pixel_worth_mm")}
    stack = p.guide_stack_mm[:, 0, 0]
    return (
        _with(values[:, DEPTHS], slopes[:, DEPTHS], stack, worth["depth_worth"]),
        Largest(values[:, LENGTHS], slopes[:, LENGTHS], worth["length_worth"] + LENGTH_TIE),
        Largest(-values[:, PIXELS], -slopes[:, PIXELS], worth["pixel_worth_mm"]),
    )


def _with(values: Array, slopes: Array, constant: Array, worth: Array) -> Largest:
    """The largest of functions and a constant."""
    flat = np.zeros((len(values), 1, 3))
    return Largest(
        np.concatenate([values, constant[:, None]], axis=1),
        np.concatenate([slopes, flat], axis=1),
        worth,
    )


def _better(there: _At, here: _At) -> NDArray[np.bool_]:
    """Whether candidates are better: a smaller goal, or, missing limits, a smaller worst miss."""
    kept = (there.missed <= FEASIBLE) & (there.goal < here.goal)
    return np.where(here.missed > FEASIBLE, there.missed < here.missed, kept)


def _chosen(better: NDArray[np.bool_], there: _At, here: _At) -> _At:
    """`there` where it is better, else `here`."""
    return _At(
        *(
            np.where(better.reshape((-1,) + (1,) * (new.ndim - 1)), new, old)
            for new, old in zip(there, here, strict=True)
        )
    )
