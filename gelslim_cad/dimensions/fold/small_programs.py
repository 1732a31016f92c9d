"""Many small linear programs at once: the least of the largest of linear functions in a box.

Each is solved through its dual by the simplex method, whose first basis is known: one function, the
weight of the limits, and a side of the box for every unknown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_PIVOTS = 60
SMALL, PIVOT = 1e-11, 1e-9


class Largest(NamedTuple):
    """A term w max(f + F d) of n programs."""

    values: Array
    """f (n, a)."""
    slopes: Array
    """F (n, a, u)."""
    worth: Array
    """w (n,), not below 0."""


class Programs(NamedTuple):
    """n programs: make Σ w max(f + F d) + g d + weight max(0, c + C d) least by a step d."""

    largest: tuple[Largest, ...]
    plain: Array
    """g (n, u)."""
    missed: Array
    """c (n, b)."""
    missed_slopes: Array
    """C (n, b, u)."""
    low: Array
    """Least d (n, u), not above 0."""
    high: Array
    """Largest d (n, u), not below 0."""
    weight: float
    """Of the largest missed limit."""


def solved(p: Programs) -> Array:
    """The steps d (n, u) that make the functions of the programs least, within their boxes."""
    n, b, u = p.missed_slopes.shape
    terms = len(p.largest)
    # Rows A z <= r of the unknowns z = (d, t.., s): functions below their t, limits below s,
    # s >= 0, box.
    ends = np.cumsum([0, *(term.values.shape[1] for term in p.largest)])
    limits = slice(ends[-1], ends[-1] + b)
    rows = np.zeros((n, limits.stop + 1 + 2 * u, u + terms + 1))
    growth, first = p.plain, []
    for k, term in enumerate(p.largest):
        rows[:, ends[k] : ends[k + 1], :u], rows[:, ends[k] : ends[k + 1], u + k] = (
            term.slopes,
            -1.0,
        )
        highest = np.argmax(term.values, axis=1)
        first.append(ends[k] + highest)
        growth = growth + term.worth[:, None] * term.slopes[np.arange(n), highest]
    rows[:, limits, :u], rows[:, limits, -1] = p.missed_slopes, -1.0
    rows[:, limits.stop, -1] = -1.0
    rows[:, limits.stop + 1 : limits.stop + 1 + u, :u] = np.eye(u)
    rows[:, limits.stop + 1 + u :, :u] = -np.eye(u)
    values = [-term.values for term in p.largest]
    right = np.concatenate([*values, -p.missed, np.zeros((n, 1)), p.high, -p.low], axis=1)
    worths = [-term.worth[:, None] for term in p.largest]
    wanted = np.concatenate([-p.plain, *worths, np.full((n, 1), -p.weight)], axis=1)
    sides = limits.stop + 1 + np.arange(u) + u * (growth > 0)
    basis = np.column_stack([*first, np.full(n, limits.stop), sides])
    return np.clip(_by_pivots(rows, right, wanted, basis)[:, :u], p.low, p.high)


def objective(p: Programs, d: Array) -> Array:
    """What the steps d (n, u) make of the functions of the programs, (n,)."""
    missed = _moved(p.missed, p.missed_slopes, d).max(axis=1)
    total = np.einsum("nj,nj->n", p.plain, d) + p.weight * np.maximum(missed, 0.0)
    for term in p.largest:
        total = total + term.worth * _moved(term.values, term.slopes, d).max(axis=1)
    return total


def _moved(values: Array, slopes: Array, d: Array) -> Array:
    """Linear functions (n, a) after the steps."""
    return values + np.einsum("nij,nj->ni", slopes, d)


def _by_pivots(rows: Array, right: Array, wanted: Array, basis: NDArray[np.intp]) -> Array:
    """Unknowns z (n, v) with A z <= r that make wanted · z largest, from a dual feasible basis."""
    z = np.zeros((len(rows), rows.shape[2]))
    open_ = every = np.arange(len(rows))
    for _ in range(MOST_PIVOTS):
        try:
            inverse = np.linalg.inv(rows[every[:, None], basis])
        except np.linalg.LinAlgError:
            break
        here = np.matmul(inverse, right[every[:, None], basis][..., None])
        left = right - np.matmul(rows, here)[..., 0]
        entering = np.argmin(left, axis=1)
        z[open_] = here[..., 0]
        going = left[every, entering] < -SMALL
        if not going.any():
            break
        # Multipliers y >= 0 of the active rows: y' active = wanted'.
        both = np.matmul(np.stack([wanted, rows[every, entering]], axis=1), inverse)
        y, way = both[:, 0], both[:, 1]
        ratio = np.where(way > PIVOT, np.maximum(y, 0.0) / np.where(way > PIVOT, way, 1.0), np.inf)
        # Of rows that leave at about the same ratio the largest pivot keeps the basis regular.
        least = ratio.min(axis=1, keepdims=True)
        basis[every, np.argmax(np.where(ratio <= least + PIVOT, way, 0.0), axis=1)] = entering
        if not going.all():
            open_, rows, right, wanted = open_[going], rows[going], right[going], wanted[going]
            basis, every = basis[going], np.arange(len(open_))
    return z
