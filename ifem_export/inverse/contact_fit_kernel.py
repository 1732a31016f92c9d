"""Compiled steps of a fit of contact forces. Import this module only where they run (numba)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
LANCZOS_STEPS = 16
GOLDEN = 0.6180339887498949


@njit(**COMPILED)
def largest_eigenvalue(gram: Any) -> Any:
    """Largest eigenvalue of `gram` (3n, 3n), estimated from below by Lanczos steps.

    The values at the start differ from node to node: from a uniform force the steps would not meet
    the modes that alternate, and a fit with too long a step diverges. The products are made in the
    precision of `gram`.
    """
    size = gram.shape[0]
    most = min(size, LANCZOS_STEPS)
    matrix = np.zeros((most, most))
    x, before = np.empty(size, dtype=gram.dtype), np.zeros(size, dtype=gram.dtype)
    beta = x.dtype.type(0.0)
    for k in range(size):
        x[k] = (0.3, 0.2, -1.0)[k % 3] + ((k + 1) * GOLDEN) % 1.0 - 0.5
    x /= math.sqrt(x @ x)
    for step in range(most):
        y = gram @ x
        alpha = x @ y
        matrix[step, step] = alpha
        y -= alpha * x + beta * before
        beta = x.dtype.type(math.sqrt(y @ y))
        if step + 1 == most or beta <= 1e-9 * matrix[0, 0]:
            break
        matrix[step, step + 1] = matrix[step + 1, step] = beta
        before, x = x, y / beta
    return np.linalg.eigvalsh(matrix)[-1]


@njit(**COMPILED)
def project(force: Any, friction: Any) -> None:
    """Project forces (3n,) onto the friction cones F_z <= 0, |F_xy| <= friction |F_z|."""
    for k in range(0, len(force), 3):
        normal, tangential = -force[k + 2], math.hypot(force[k], force[k + 1])
        if math.isinf(friction):
            force[k + 2] = -max(normal, 0.0)
            continue
        if tangential <= friction * normal:
            continue
        nearest = max((normal + friction * tangential) / (1 + friction * friction), 0.0)
        scale = friction * nearest / tangential if tangential > 0 else 0.0
        force[k] *= scale
        force[k + 1] *= scale
        force[k + 2] = -nearest


@njit(**COMPILED)
def accelerated(moved: Any, ahead: Any, force: Any, momentum: Any) -> Any:
    """Take a step of an accelerated descent, and look ahead along it.

    Y. Nesterov, Soviet Mathematics Doklady 27, 1983, with the restart of B. O'Donoghue and
    E. Candès, Foundations of Computational Mathematics 15, 2015: it begins anew where the step
    goes against the gradient at the point looked ahead to.

    Args:
        moved: (n,) where the step from `ahead` leads.
        ahead: (n,), which receives the next point to step from.
        force: (n,), which receives `moved`.
        momentum: After the step before; 1 at the start.

    Returns:
        The relative change of the step, and the momentum after it.
    """
    overshoot = change_square = size = 0.0
    for k in range(len(moved)):
        delta = moved[k] - force[k]
        overshoot += (ahead[k] - moved[k]) * delta
        change_square += delta * delta
        size += moved[k] * moved[k]
    last = 1.0 if overshoot > 0 else momentum
    momentum = (1 + math.sqrt(1 + 4 * last * last)) / 2
    for k in range(len(moved)):
        ahead[k] = moved[k] + (last - 1) / momentum * (moved[k] - force[k])
        force[k] = moved[k]
    return math.sqrt(change_square / size) if size > 0 else 0.0, momentum


@njit(**COMPILED)
def descend(
    gram: Any, slope: Any, force: Any, friction: Any, step: Any, tolerance: Any, most: Any
) -> Any:
    """Improve `force` (3n,) in place by accelerated projected gradients with restart.

    Minimises slope·d + d·gram d / 2 over the change d of the force, on the friction cones. It ends
    after `most` steps, or when the relative change of a step is within `tolerance`.

    Returns:
        The relative change of the last step, and the number of steps.
    """
    start, ahead = force.copy(), force.copy()
    momentum, change, steps = 1.0, np.inf, 0
    while steps < most and change > tolerance:
        steps += 1
        moved = ahead - step * (slope + gram @ (ahead - start))
        project(moved, friction)
        change, momentum = accelerated(moved, ahead, force, momentum)
    return change, steps


@njit(**COMPILED)
def project_within(force: Any, limit: Any) -> None:
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
def descend_within(
    gram: Any, slope: Any, force: Any, limit: Any, step: Any, tolerance: Any, most: Any
) -> Any:
    """Improve `force` (q + 2p,) in place by accelerated projected gradients with restart.

    It is `descend` within the limits of `project_within`.

    Returns:
        The relative change of the last step, and the number of steps.
    """
    start = force.copy()
    project_within(force, limit)
    ahead = force.copy()
    momentum, change, steps = 1.0, math.inf, 0
    while steps < most and change > tolerance:
        steps += 1
        moved = ahead - step * (slope + gram @ (ahead - start))
        project_within(moved, limit)
        change, momentum = accelerated(moved, ahead, force, momentum)
    return change, steps
