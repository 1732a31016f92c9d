"""Compiled parts of Newton's method for contact forces. Import this module only where they run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gelslim_core.kernel_cache import drop_stale
from ifem_export.inverse.contact_fit_kernel import COMPILED, project_within

drop_stale(["newton_kernel"], ["contact_fit_kernel"], Path(__file__).parent)

_AT_LIMIT = 1e-5
HALVINGS = 3


@njit(**COMPILED)
def free_directions(
    force: Any, gradient: Any, limit: Any, first: Any, second: Any, weights: Any, curvature: Any
) -> int:
    """Directions in which forces can vary within the limits that they keep to.

    A normal force that is 0 and would pull stays 0. A tangential force at its limit that would
    grow moves along the rim, where the multiplier λ of the limit L bends the energy by λ / L;
    with the limit 0 it stays. All others are free.

    Args:
        force: (q + 2p,) as in `project_within`, within the limits.
        gradient: (q + 2p,) of the energy.
        limit: (p,) most of each tangential force.
        first: Receives the number of a force of each direction.
        second: Receives that of another one.
        weights: Receives (r, 2) their weights.
        curvature: Receives the curvature that a limit adds.

    Returns:
        The number of directions.
    """
    count, found = len(force) - 2 * len(limit), 0
    for k in range(count):
        if force[k] >= 0 and gradient[k] < 0:
            continue
        first[found] = second[found] = k
        weights[found, 0], weights[found, 1], curvature[found] = 1, 0, 0
        found += 1
    for n in range(len(limit)):
        k, most = count + 2 * n, limit[n]
        if most <= 0:
            continue
        size = math.hypot(force[k], force[k + 1])
        outward = 0.0
        if size >= most * (1 - _AT_LIMIT):
            outward = -(gradient[k] * force[k] + gradient[k + 1] * force[k + 1]) / size
        if outward > 0:
            first[found], second[found] = k, k + 1
            weights[found, 0], weights[found, 1] = -force[k + 1] / size, force[k] / size
            curvature[found] = outward / most
            found += 1
            continue
        for axis in range(2):
            first[found] = second[found] = k + axis
            weights[found, 0], weights[found, 1], curvature[found] = 1, 0, 0
            found += 1
    return found


@njit(**COMPILED)
def reduced(
    gram: Any,
    gradient: Any,
    first: Any,
    second: Any,
    weights: Any,
    curvature: Any,
    out: Any,
    pull: Any,
) -> None:
    """Write the lower triangle (r, r) of the Hessian, and the gradient (r,), along directions."""
    for a in range(len(out)):
        i, j, u, v = first[a], second[a], weights[a, 0], weights[a, 1]
        pull[a] = u * gradient[i] + v * gradient[j]
        for b in range(a + 1):
            k, w = first[b], weights[b, 0]
            if v == 0 and weights[b, 1] == 0:
                out[a, b] = gram[i, k]
                continue
            m, x = second[b], weights[b, 1]
            out[a, b] = u * (w * gram[i, k] + x * gram[i, m]) + v * (
                w * gram[j, k] + x * gram[j, m]
            )
        out[a, a] += curvature[a]


@njit(**COMPILED)
def stepped(
    gram: Any,
    gradient: Any,
    first: Any,
    second: Any,
    weights: Any,
    step: Any,
    limit: Any,
    force: Any,
) -> Any:
    """Move forces along directions (r,) as far as the energy falls, and their gradient with them.

    The step is halved until the energy falls, a few times at most.

    Returns:
        The change of the forces over their size; 0 where the energy does not fall.
    """
    size = len(force)
    whole = np.zeros(size, dtype=force.dtype)
    for a in range(len(step)):
        whole[first[a]] += weights[a, 0] * step[a]
        if weights[a, 1] != 0:
            whole[second[a]] += weights[a, 1] * step[a]
    part = 1.0
    for _ in range(HALVINGS):
        moved = force + force.dtype.type(part) * whole
        project_within(moved, limit)
        change = moved - force
        bent = gram @ change
        energy = 0.0
        for k in range(size):
            energy += change[k] * (gradient[k] + 0.5 * bent[k])
        if energy < 0:
            moved_square = change_square = 0.0
            for k in range(size):
                force[k] = moved[k]
                gradient[k] += bent[k]
                moved_square += moved[k] * moved[k]
                change_square += change[k] * change[k]
            return part, math.sqrt(change_square / moved_square) if moved_square > 0 else 0.0
        part *= 0.5
    return 0.0, 0.0
