"""The thinnest finger that lets the camera see the gel: a deterministic search over folds.

`grids` says where to look. Infeasible candidates rank by how far they miss, so that slivers of
feasible designs are found and a hopeless design ends at its least bad fold, which the design rules
then report.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold.fold import Fold, fold
from gelslim_cad.dimensions.fold.grids import STARTS, Best, best_of_bands
from gelslim_cad.dimensions.fold.mirror import mirror_angle_rad
from gelslim_cad.dimensions.fold.pieces import measured_by_arrays
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem
from gelslim_cad.dimensions.fold.wishes import closest

CHUNK = 64
COMPILED_FROM = 200
"""Designs from which loading the compiled search pays."""
PIECE = 64
"""Designs that a thread searches at a time."""
_JOBS: ContextVar[int | None] = ContextVar("fold search threads", default=None)
_AMONG: ContextVar[int] = ContextVar("designs of which this batch is a part", default=0)


@contextmanager
def threads(jobs: int | None, among: int = 0) -> Iterator[None]:
    """Let `solve_fold` use `jobs` threads for batches; None: as many as there are processors.

    `among` is the number of all designs, where they come in several batches.
    Raises ValueError for less than one job. The number of jobs never changes a result.
    """
    if jobs is not None and jobs < 1:
        raise ValueError(f"jobs is {jobs}; give 1 or more, or none for all processors")
    token, part = _JOBS.set(jobs), _AMONG.set(among)
    try:
        yield
    finally:
        _AMONG.reset(part)
        _JOBS.reset(token)


def solve_fold(problem: FoldProblem) -> Fold:
    """Best fold per design, every field (n,); infeasible designs keep violations > 0.

    Batches of COMPILED_FROM designs or more, or part of as many, have their candidates scored by
    the same functions compiled, in threads (see `threads`); smaller ones start none.
    """
    if max(len(problem), _AMONG.get()) >= COMPILED_FROM:
        return _solve_compiled(problem)
    parts = [
        _solve_chunk(problem.rows(slice(start, start + CHUNK)))
        for start in range(0, len(problem), CHUNK)
    ]
    return _concatenate(parts)


def _solve_compiled(problem: FoldProblem) -> Fold:
    from concurrent.futures import ThreadPoolExecutor

    from gelslim_cad.dimensions.fold.search import measured, search

    def best_of(piece: FoldProblem) -> Array:
        return closest(piece, search(piece), measured)

    kinds, same = _distinct(problem)
    pieces = [kinds.rows(slice(start, start + PIECE)) for start in range(0, len(kinds), PIECE)]
    jobs = min(_JOBS.get() or _processors(), len(pieces))
    if jobs == 1:
        found = [best_of(piece) for piece in pieces]
    else:
        with ThreadPoolExecutor(jobs) as pool:
            found = list(pool.map(best_of, pieces))
    return _laid_out(problem, np.concatenate(found)[same])


def _distinct(problem: FoldProblem) -> tuple[FoldProblem, NDArray[np.intp]]:
    """Problems that differ, and for each design which is its own: many fields leave it alone."""
    columns = [np.ravel(getattr(problem, f.name)) for f in fields(FoldProblem)]
    _, first, same = np.unique(np.stack(columns, 1), axis=0, return_index=True, return_inverse=True)
    return problem.rows(first), same.ravel()


def _processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _solve_chunk(problem: FoldProblem) -> Fold:
    repeated = problem.rows(np.tile(np.arange(len(problem)), STARTS))
    bands = best_of_bands(len(problem), partial(best_of_grids, repeated))
    return _laid_out(problem, closest(problem, bands, measured_by_arrays))


def best_of_grids(
    problem: FoldProblem, mid: Array, spread: Array, turn: Array, _known: Array
) -> Best:
    """The first best candidate of each grid: one grid of axes (n, k) per design, all at once.

    Rays depend on the first two axes only: they broadcast against the axis of the turn.
    """
    shape = (len(mid), mid.shape[1], spread.shape[1])
    pairs = [
        np.broadcast_to(axis, shape).reshape(len(mid), -1, 1)
        for axis in (mid[:, :, None], spread[:, None, :])
    ]
    mirror = mirror_angle_rad(turn[:, None, :], pairs[0])
    scores = fold(problem, pairs[0], pairs[1], mirror).objective(problem)
    scores = scores.reshape(len(mid), -1)
    winner = np.argmin(scores, axis=1)
    pair, angle = np.divmod(winner, turn.shape[1])
    row = np.arange(len(mid))
    return Best(
        pairs[0][row, pair, 0], pairs[1][row, pair, 0], turn[row, angle], scores[row, winner]
    )


def _laid_out(problem: FoldProblem, best: Array) -> Fold:
    """The folds of the best candidates (n, 3), every field (n,)."""
    return _squeeze(fold(problem, *(best[:, k, None, None] for k in range(3))))


def _squeeze(solved: Fold) -> Fold:
    def flat(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: flat(missed) for name, missed in value.items()}
        return np.broadcast_to(value, solved.depth_mm.shape)[:, 0, 0]

    return Fold(**{f.name: flat(getattr(solved, f.name)) for f in fields(Fold)})


def _concatenate(parts: list[Fold]) -> Fold:
    def joined(values: list[Any]) -> Any:
        if isinstance(values[0], dict):
            return {name: joined([value[name] for value in values]) for name in values[0]}
        return np.concatenate(values)

    return Fold(**{f.name: joined([getattr(part, f.name) for part in parts]) for f in fields(Fold)})
