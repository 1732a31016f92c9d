"""Compiled steps of a fit of contact forces. Import only where it runs: numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
POWER_STEPS = 8


@njit(**COMPILED)
def largest(gram: Any) -> Any:
    """Largest eigenvalue of `gram` (3n, 3n), from below, by power steps from a uniform push."""
    size = gram.shape[0]
    x, found = np.empty(size), 0.0
    for k in range(size):
        x[k] = (0.3, 0.2, -1.0)[k % 3]
    for _ in range(POWER_STEPS):
        x /= math.sqrt(x @ x)
        y = gram @ x
        found = max(found, x @ y)
        x = y
    return found


@njit(**COMPILED)
def project(force: Any, friction: Any) -> None:
    """Move forces (3n,) to the nearest that push, F_z <= 0, and keep |F_xy| <= friction |F_z|."""
    for k in range(0, len(force), 3):
        push, side = -force[k + 2], math.hypot(force[k], force[k + 1])
        if math.isinf(friction):
            force[k + 2] = -max(push, 0.0)
            continue
        if side <= friction * push:
            continue
        along = max((push + friction * side) / (1 + friction * friction), 0.0)
        scale = friction * along / side if side > 0 else 0.0
        force[k] *= scale
        force[k + 1] *= scale
        force[k + 2] = -along


@njit(**COMPILED)
def descend(
    gram: Any, slope: Any, force: Any, friction: Any, step: Any, tolerance: Any, most: Any
) -> Any:
    """Improve `force` (3n,) in place; returns the last step's size over the force's, and steps.

    Minimises slope·d + d·gram d / 2 for d from the start, on the cones, by accelerated projected
    gradients with restart, at most `most` of them and until a change is within `tolerance`.
    """
    start, ahead = force.copy(), force.copy()
    pace, change, steps = 1.0, np.inf, 0
    while steps < most and change > tolerance:
        steps += 1
        moved = ahead - step * (slope + gram @ (ahead - start))
        project(moved, friction)
        back = gone = size = 0.0
        for k in range(len(moved)):
            delta = moved[k] - force[k]
            back += (ahead[k] - moved[k]) * delta
            gone += delta * delta
            size += moved[k] * moved[k]
        if back > 0:
            pace = 1.0
        last, pace = pace, (1 + math.sqrt(1 + 4 * pace * pace)) / 2
        change = math.sqrt(gone / size) if size > 0 else 0.0
        for k in range(len(moved)):
            ahead[k] = moved[k] + (last - 1) / pace * (moved[k] - force[k])
            force[k] = moved[k]
    return change, steps
