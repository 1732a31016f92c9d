"""Compiled steps of a fit of forces at half the pitch. Import only where they run (numba)."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def stencil_columns(
    stencil: Any, at: Any, places: Any, rows: Any, columns: Any, found: Any
) -> None:
    """Add the heights about forces at places (q, 2) of a lattice to their columns.

    Args:
        stencil: (2r + 1, 2r + 1) height by the distance.
        at: (q, 2).
        places: (nx, ny) number of each place; -1 where there is none.
        rows: (f,) row of `found` of each place; -1 where it has none.
        columns: (q,) of `found`.
        found: (m, k), to which the heights are added.
    """
    reach = stencil.shape[0] // 2
    for n in range(len(at)):
        row, column = at[n, 0] - reach, at[n, 1] - reach
        for a in range(max(-row, 0), min(stencil.shape[0], places.shape[0] - row)):
            for b in range(max(-column, 0), min(stencil.shape[1], places.shape[1] - column)):
                place = places[row + a, column + b]
                if place >= 0 and rows[place] >= 0:
                    found[rows[place], columns[n]] += stencil[a, b]


@njit(**COMPILED)
def project(force: Any, limit: Any) -> None:
    """Bring pulls to 0, and tangential forces within their limits.

    Args:
        force: (q + 2p,) q normal forces, which push where they are negative, and p tangential ones.
        limit: (p,) most of each tangential force.
    """
    count = len(force) - 2 * len(limit)
    for k in range(count):
        force[k] = min(force[k], 0)
    for n in range(len(limit)):
        k = count + 2 * n
        size = math.hypot(force[k], force[k + 1])
        if size > limit[n]:
            force[k] *= limit[n] / size
            force[k + 1] *= limit[n] / size


@njit(**COMPILED)
def descend(
    gram: Any, slope: Any, force: Any, limit: Any, step: Any, tolerance: Any, most: Any
) -> Any:
    """Improve `force` (q + 2p,) in place by accelerated projected gradients with restart.

    Minimises slope·d + d·gram d / 2 over the change d of the force within the limits of `project`.
    It ends after `most` steps, or when the relative change of a step is within `tolerance`.

    Returns:
        The relative change of the last step, and the number of steps.
    """
    start = force.copy()
    project(force, limit)
    ahead = force.copy()
    momentum, change, steps = 1.0, math.inf, 0
    while steps < most and change > tolerance:
        steps += 1
        moved = ahead - step * (slope + gram @ (ahead - start))
        project(moved, limit)
        overshoot = change_square = size = 0.0
        for k in range(len(moved)):
            delta = moved[k] - force[k]
            overshoot += (ahead[k] - moved[k]) * delta
            change_square += delta * delta
            size += moved[k] * moved[k]
        if overshoot > 0:
            momentum = 1.0
        last, momentum = momentum, (1 + math.sqrt(1 + 4 * momentum * momentum)) / 2
        change = math.sqrt(change_square / size) if size > 0 else 0.0
        for k in range(len(moved)):
            ahead[k] = moved[k] + (last - 1) / momentum * (moved[k] - force[k])
            force[k] = moved[k]
    return change, steps
