"""Compiled fit of a patch's position and size to the change of shading. Import only where it runs.

The fit takes Gauss-Newton steps in four values, with the gains of the light projected out. The
derivative is computed by differences at the start and where a step fails. In between it is updated
by Broyden's rank-one formula: a fit that starts near its solution needs eight evaluations instead
of twenty.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gelslim_core.kernel_cache import drop_stale
from gelslim_force.contact.slope_kernel import COMPILED, slope_basis

drop_stale(["patch_fit_kernel"], ["slope_kernel"], Path(__file__).parent)

GAINS = 6
RIDGE = 1e-9
TRIES = 6
MOST_DECAY = 5.0
SETTLED = 3e-3
"""Change, over the size of the patch, at which the fit ends."""


@njit(**COMPILED)
def settle(
    x: Any,
    y: Any,
    parallax: Any,
    change: Any,
    theta: Any,
    strip: Any,
    curvature: Any,
    blur: Any,
    steps: Any,
    near: Any,
    residual: Any,
    jacobian: Any,
) -> Any:
    """Improve `theta` (4,) in place by up to `steps` steps; returns the remaining sum of squares.

    The bins are at x, y (n,), with `parallax` (n, 2) and `change` (n, c) over the noise. The
    residual is written to `residual` (n, c), its derivative to `jacobian` (n c, 4). Differences
    are computed anew after a change of more than `near`, over the size of the patch.
    """
    scale = np.array([1.0, 0.2 if strip else 1.0, 1.0, 2.0])
    basis = np.empty((len(x), GAINS))
    tried, trial = np.empty_like(residual), theta.copy()
    bins, shape = (x, y, parallax, change), (strip, curvature, blur)
    cost = _residual(bins, shape, theta, basis, residual)
    damping, far, fresh = 1e-3, True, False
    for _ in range(steps):
        if far:
            _differences(bins, shape, theta, scale, basis, residual, tried, jacobian)
            fresh = True
        normal, gradient = _normal(jacobian, residual)
        improved, shortened = False, False
        for _ in range(TRIES):
            move = _bounded_step(normal, gradient, damping, theta, scale, trial)
            new = _residual(bins, shape, trial, basis, tried)
            if new <= cost:
                improved = True
                break
            if not fresh:
                break
            damping *= 6
            shortened = True
        if not improved:
            if fresh:
                break
            _differences(bins, shape, theta, scale, basis, residual, tried, jacobian)
            fresh = True
            continue
        gained, largest = cost - new, 0.0
        for k in range(4):
            move[k] = trial[k] - theta[k]
            if k < 3:
                largest = max(largest, abs(move[k]) / trial[2])
        # A step that had to be shortened may be small far from the solution.
        far = shortened or largest > near
        _broyden(jacobian, residual, tried, move)
        fresh = False
        theta[:] = trial
        residual[:] = tried
        cost = new
        damping = max(damping / 5, 1e-6)
        if gained < 1e-3 * cost and largest < SETTLED and not shortened:
            break
    return cost


@njit(**COMPILED)
def squares_left(
    x: Any,
    y: Any,
    parallax: Any,
    change: Any,
    theta: Any,
    strip: Any,
    curvature: Any,
    blur: Any,
    residual: Any,
) -> Any:
    """Squares that a trial of `theta` (4,) leaves; arguments as for `settle`."""
    basis = np.empty((len(x), GAINS))
    return _residual((x, y, parallax, change), (strip, curvature, blur), theta, basis, residual)


@njit(**COMPILED)
def _bounded_step(
    normal: Any, gradient: Any, damping: Any, theta: Any, scale: Any, trial: Any
) -> Any:
    """Write `theta` moved within bounds to `trial`; returns the move before they cut it."""
    move = _damped(normal, gradient, damping, False)
    # At a bound of the decay the others move without it, or its cut step spoils theirs.
    if (theta[3] >= MOST_DECAY and move[3] > 0) or (theta[3] <= 0 and move[3] < 0):
        move = _damped(normal, gradient, damping, True)
    for k in range(4):
        most = 0.4 * theta[2] * scale[k]
        trial[k] = theta[k] + min(max(move[k], -most), most)
    trial[2] = max(trial[2], 0.3 * theta[2])
    trial[3] = min(max(trial[3], 0.0), MOST_DECAY)
    return move


@njit(**COMPILED)
def _residual(bins: Any, shape: Any, theta: Any, basis: Any, out: Any) -> Any:
    """Write what the best gains leave of the change to `out` (n, c); returns its squares.

    `bins` are x, y, parallax and change, `shape` strip, curvature and blur, as for `settle`.
    """
    (x, y, parallax, change), (strip, curvature, blur) = bins, shape
    count, layers = change.shape
    at = theta.copy()
    at[2] = max(at[2], 1e-3)
    slope_basis(x, y, parallax, at, strip, curvature, blur, basis)
    normal, sides = np.zeros((GAINS, GAINS)), np.zeros((GAINS, layers))
    for k in range(count):
        for i in range(GAINS):
            for j in range(i + 1):
                normal[i, j] += basis[k, i] * basis[k, j]
            for c in range(layers):
                sides[i, c] += basis[k, i] * change[k, c]
    trace = 0.0
    for i in range(GAINS):
        trace += normal[i, i]
    for i in range(GAINS):
        normal[i, i] += RIDGE * trace
    _solve(normal, sides)
    squares = 0.0
    for k in range(count):
        for c in range(layers):
            left = change[k, c]
            for i in range(GAINS):
                left -= basis[k, i] * sides[i, c]
            out[k, c] = left
            squares += left * left
    return squares


@njit(**COMPILED)
def _differences(
    bins: Any,
    shape: Any,
    theta: Any,
    scale: Any,
    basis: Any,
    residual: Any,
    ahead: Any,
    jacobian: Any,
) -> None:
    """Write the derivative of `residual` by each value to `jacobian`; `ahead` is scratch."""
    moved = theta.copy()
    count, layers = residual.shape
    for k in range(4):
        small = 1e-3 * scale[k] * max(theta[2], 0.1)
        moved[k] = theta[k] + small
        _residual(bins, shape, moved, basis, ahead)
        moved[k] = theta[k]
        for n in range(count):
            for c in range(layers):
                jacobian[n * layers + c, k] = (ahead[n, c] - residual[n, c]) / small


@njit(**COMPILED)
def _broyden(jacobian: Any, before: Any, after: Any, move: Any) -> None:
    """Change the derivative so that it explains the last move."""
    length = 0.0
    for k in range(4):
        length += move[k] * move[k]
    if length <= 0:
        return
    layers = before.shape[1]
    for n in range(before.shape[0]):
        for c in range(layers):
            row = jacobian[n * layers + c]
            off = after[n, c] - before[n, c]
            for k in range(4):
                off -= row[k] * move[k]
            for k in range(4):
                row[k] += off * move[k] / length


@njit(**COMPILED)
def _normal(jacobian: Any, residual: Any) -> Any:
    normal, gradient = np.zeros((4, 4)), np.zeros(4)
    layers = residual.shape[1]
    for n in range(jacobian.shape[0]):
        left = residual[n // layers, n % layers]
        for i in range(4):
            for j in range(i + 1):
                normal[i, j] += jacobian[n, i] * jacobian[n, j]
            gradient[i] += jacobian[n, i] * left
    return normal, gradient


@njit(**COMPILED)
def _damped(normal: Any, gradient: Any, damping: Any, decay_held: Any) -> Any:
    system, move = normal.copy(), np.empty((4, 1))
    for i in range(4):
        system[i, i] = normal[i, i] * (1 + damping) + 1e-12
        move[i, 0] = -gradient[i]
    if decay_held:
        system[3, :3], system[3, 3], move[3, 0] = 0.0, 1.0, 0.0
    _solve(system, move)
    return move[:, 0].copy()


@njit(**COMPILED)
def _solve(system: Any, sides: Any) -> None:
    """Solve by Cholesky in place; only the lower triangle of `system` is read."""
    size, count = sides.shape
    for j in range(size):
        for k in range(j):
            system[j, j] -= system[j, k] * system[j, k]
        system[j, j] = np.sqrt(max(system[j, j], 1e-300))
        for i in range(j + 1, size):
            for k in range(j):
                system[i, j] -= system[i, k] * system[j, k]
            system[i, j] /= system[j, j]
    for c in range(count):
        for i in range(size):
            for k in range(i):
                sides[i, c] -= system[i, k] * sides[k, c]
            sides[i, c] /= system[i, i]
        for i in range(size - 1, -1, -1):
            for k in range(i + 1, size):
                sides[i, c] -= system[k, i] * sides[k, c]
            sides[i, c] /= system[i, i]
