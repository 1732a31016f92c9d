"""The thinnest finger that lets the camera see the gel: a deterministic search over folds.

Three unknowns (mean ray angle, used part of the field of view, mirror angle) are searched on a
coarse grid and then on ever smaller grids around the best candidate of each band of ray angles:
steep and upright views are separate valleys, joined by infeasible folds. Infeasible candidates rank
by how far they miss, so that slivers of feasible designs are found and a hopeless design ends at
its least bad fold, which the design rules then report.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions.fold import Fold, fold
from gelslim_cad.dimensions.fold_problem import Array, FoldProblem

LOWER = np.array([np.radians(-12.0), 0.25, np.radians(12.0)])
UPPER = np.array([np.radians(58.0), 1.0, np.radians(50.0)])
COARSE = (18, 10, 20)
FINE = 5
SHRINK = 0.7
LEVELS = 26
STARTS = 6
CHUNK = 64
COMPILED_FROM = 200
"""Designs from which loading the compiled search pays."""
PIECE = 64
"""Designs that a thread searches at a time."""
INFEASIBLE_MM = 1000.0
KEYSTONE_WEIGHT_MM = 0.02
LENGTH_WEIGHT = 0.002

_JOBS: ContextVar[int | None] = ContextVar("fold search threads", default=None)
_AMONG: ContextVar[int] = ContextVar("designs of which this batch is a part", default=0)


@contextmanager
def threads(jobs: int | None, among: int = 0) -> Iterator[None]:
    """Let `solve_fold` use `jobs` threads for batches; None: as many as there are processors.

    `among` says of how many designs a batch is a part, where they come in several batches.
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


def objective(candidates: Fold) -> Array:
    """Depth in mm; among equals the smaller keystone, then the shorter finger."""
    ratio = candidates.far_distance_mm / candidates.near_distance_mm
    keystone = np.maximum(ratio, 1 / ratio)
    tie = KEYSTONE_WEIGHT_MM * (keystone - 1) - LENGTH_WEIGHT * candidates.camera_rear_x_mm
    missed = candidates.worst()
    return np.where(missed > 1e-9, INFEASIBLE_MM * (1 + missed), candidates.depth_mm + tie)


def solve_fold(problem: FoldProblem) -> Fold:
    """Best fold per design, every field (n,); infeasible designs keep violations > 0.

    Batches of COMPILED_FROM designs or more, or part of as many, are searched by the compiled twin
    of the same search, in threads (see `threads`); smaller ones start none.
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

    from gelslim_cad.dimensions.fold_search import search

    kinds, same = _distinct(problem)
    pieces = [kinds.rows(slice(start, start + PIECE)) for start in range(0, len(kinds), PIECE)]
    jobs = min(_JOBS.get() or _processors(), len(pieces))
    if jobs == 1:
        found = [search(piece) for piece in pieces]
    else:
        with ThreadPoolExecutor(jobs) as pool:
            found = list(pool.map(search, pieces))
    chosen = [np.concatenate(axis)[same, None, None] for axis in zip(*found, strict=True)]
    return _squeeze(fold(problem, *chosen))


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
    count, width = len(problem), (UPPER - LOWER) / (np.array(COARSE) - 1)
    mids, spreads, mirrors = (
        np.linspace(lo, hi, n) for lo, hi, n in zip(LOWER, UPPER, COARSE, strict=True)
    )
    spread = np.broadcast_to(spreads, (count, len(spreads)))
    mirror = np.broadcast_to(mirrors, (count, len(mirrors)))
    starts = []
    for band in np.array_split(mids, STARTS):
        mid = np.broadcast_to(band, (count, len(band)))
        starts.append(_best(problem, mid, spread, mirror))
    best = [np.concatenate(values) for values in zip(*starts, strict=True)]
    repeated = problem.rows(np.tile(np.arange(count), STARTS))
    ticks = np.linspace(-1.0, 1.0, FINE)
    for _ in range(LEVELS):
        around = [
            np.clip(b[:, None] + ticks * w, lo, hi)
            for b, w, lo, hi in zip(best, width, LOWER, UPPER, strict=True)
        ]
        best = _best(repeated, *around)
        width = width * SHRINK
    ends = objective(fold(repeated, *(b[:, None, None] for b in best))).reshape(STARTS, count)
    winner = np.argmin(ends, axis=0) * count + np.arange(count)
    chosen = [b[winner][:, None, None] for b in best]
    return _squeeze(fold(problem, *chosen))


def _best(problem: FoldProblem, mid: Array, spread: Array, mirror: Array) -> list[Array]:
    """Best of the grid spanned by three axes (n, k) per design; three arrays (n,).

    Rays depend on the first two axes only: they broadcast against the mirror axis.
    """
    shape = (len(mid), mid.shape[1], spread.shape[1])
    pairs = [
        np.broadcast_to(mid[:, :, None], shape).reshape(len(mid), -1, 1),
        np.broadcast_to(spread[:, None, :], shape).reshape(len(mid), -1, 1),
    ]
    score = objective(fold(problem, pairs[0], pairs[1], mirror[:, None, :]))
    winner = np.argmin(score.reshape(len(mid), -1), axis=1)
    pair, angle = np.divmod(winner, mirror.shape[1])
    row = np.arange(len(mid))
    return [pairs[0][row, pair, 0], pairs[1][row, pair, 0], mirror[row, angle]]


def _squeeze(solved: Fold) -> Fold:
    values = {
        f.name: np.broadcast_to(getattr(solved, f.name), solved.depth_mm.shape)[:, 0, 0]
        for f in fields(Fold)
        if f.name != "violations"
    }
    shape = solved.depth_mm.shape
    missed = {k: np.broadcast_to(v, shape)[:, 0, 0] for k, v in solved.violations.items()}
    return Fold(**values, violations=missed)


def _concatenate(parts: list[Fold]) -> Fold:
    values = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts])
        for f in fields(Fold)
        if f.name != "violations"
    }
    names = parts[0].violations
    missed = {k: np.concatenate([part.violations[k] for part in parts]) for k in names}
    return Fold(**values, violations=missed)
