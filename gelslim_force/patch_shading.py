"""The contact patch fitted to the slopes that its shading shows.

Under a smooth indenter the slope grows evenly from the middle to the rim; beside it the free
surface levels off steeply. Where the light changes is therefore wider than the patch, but the
crease at the rim is sharp. Each layer of the change of shading is taken to be linear in the slope's
two parts, with one more term in its square; these gains are found anew for every frame, so that no
photometric calibration is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEPS = 12
FIRST_STEPS = 5
LOOK_AT = 300
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class Window:
    """Bins about the patch."""

    x_mm: Array
    """(n,) where the line of sight meets the rest surface."""
    y_mm: Array
    lean: Array
    """(n, 2) motion along x and y per mm of height."""
    change: Array
    """(n, c) over the noise."""
    bin_mm: float
    steps: tuple[NDArray[np.intp], NDArray[np.intp]]
    """Pairs (k,) of bins next to one another on the diagonal."""

    def thinned(self, count: int) -> Window:
        """About `count` of the bins, for a first look."""
        skip = max(1, len(self.x_mm) // count)
        none = np.zeros(0, dtype=np.intp)
        x, y, lean, change = (a[::skip] for a in (self.x_mm, self.y_mm, self.lean, self.change))
        return Window(x, y, lean, change, self.bin_mm, (none, none))


@dataclass(frozen=True, eq=False)
class ShadingFit:
    """`values` (4,): x, y, radius, decay of a disc; offset, angle, half-width, decay of a strip."""

    values: Array
    covariance: Array
    explained: float
    """Share of the change that the fit explains."""


def best_shading_fit(
    window: Window, starts: list[Array], strip: bool, curvature_per_mm: float, blur_mm: float
) -> ShadingFit | None:
    """The fit from the start that leaves least after a few steps on a part of the bins."""
    if len(starts) == 1:
        return fit_shading(window, starts[0], strip, curvature_per_mm, blur_mm)
    part = window.thinned(LOOK_AT)

    def tried(start: Array) -> tuple[float, Array]:
        first = _settle(part, start, strip, curvature_per_mm, blur_mm, FIRST_STEPS)
        return first[1], first[0]

    _, best = min((tried(s) for s in starts), key=lambda t: t[0])
    return fit_shading(window, best, strip, curvature_per_mm, blur_mm)


def fit_shading(
    window: Window, start: Array, strip: bool, curvature_per_mm: float, blur_mm: float
) -> ShadingFit | None:
    """Gauss-Newton with the gains projected out; None where it does not settle.

    `curvature_per_mm` is 1/R of the indenter, 0 where unknown; `blur_mm` widens the crease.
    """
    theta, cost, residual, jacobian = _settle(
        window, start, strip, curvature_per_mm, blur_mm, STEPS
    )
    whole = window.change - window.change.mean(axis=0)
    explained = 1 - cost / max(float((whole**2).sum()), 1e-12)
    if not np.isfinite(theta).all() or theta[2] < 1.5 * window.bin_mm:
        return None
    freedom = max(residual.size - 4 - 7 * residual.shape[1], 1)
    spread = cost / freedom * _together(residual, window)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * spread
    return ShadingFit(theta, covariance, explained)


def _settle(
    window: Window, start: Array, strip: bool, curvature_per_mm: float, blur_mm: float, steps: int
) -> tuple[Array, float, Array, Array]:
    """Levenberg-Marquardt: values, squares left, residual (n, c) and its derivative (n c, 4)."""
    theta = start.copy()
    scale = np.array([1.0, 1.0 if not strip else 0.2, 1.0, 2.0])
    residual = _residual(window, theta, strip, curvature_per_mm, blur_mm)
    cost, damping = float((residual**2).sum()), 1e-3
    jacobian = np.zeros((residual.size, 4))
    for _ in range(steps):
        for k in range(4):
            small = 1e-3 * scale[k] * max(theta[2], 0.1)
            moved = theta.copy()
            moved[k] += small
            ahead = _residual(window, moved, strip, curvature_per_mm, blur_mm)
            jacobian[:, k] = (ahead - residual).ravel() / small
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual.ravel()
        settled = False
        for _ in range(6):
            step = -np.linalg.solve(
                normal + damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(4), gradient
            )
            step = np.clip(step, -0.4 * theta[2] * scale, 0.4 * theta[2] * scale)
            trial = theta + step
            trial[2] = max(trial[2], 0.3 * theta[2])
            trial[3] = min(max(trial[3], 0.0), 5.0)
            tried = _residual(window, trial, strip, curvature_per_mm, blur_mm)
            new = float((tried**2).sum())
            if new <= cost:
                gained = cost - new
                theta, residual, cost = trial, tried, new
                damping = max(damping / 5, 1e-6)
                settled = gained < 1e-3 * cost and bool((np.abs(step[:3]) < 3e-3 * theta[2]).all())
                break
            damping *= 6
        else:
            settled = True
        if settled:
            break
    return theta, cost, residual, jacobian


def _residual(window: Window, theta: Array, strip: bool, curvature: float, blur_mm: float) -> Array:
    """What the best gains leave of the change, (n, c)."""
    from gelslim_force.slope_kernel import slope_basis

    basis = np.empty((len(window.x_mm), 6))
    at = np.array([theta[0], theta[1], max(theta[2], 1e-3), theta[3]])
    slope_basis(window.x_mm, window.y_mm, window.lean, at, strip, curvature, blur_mm, basis)
    normal = basis.T @ basis
    normal[np.diag_indices(6)] += RIDGE * np.trace(normal)
    gains = np.linalg.solve(normal, basis.T @ window.change)
    return np.asarray(window.change - basis @ gains)


def _together(residual: Array, window: Window) -> float:
    """How many bins err as one, from the likeness of neighbours on the diagonal."""
    power = float((residual**2).mean())
    first, second = window.steps
    if power <= 0 or not len(first):
        return 1.0
    diagonal = float((residual[first] * residual[second]).mean()) / power
    # Along a row or column likeness is greater: its square is the diagonal's.
    like = min(max(diagonal, 0.0), 0.9) ** 0.5
    return min(((1 + like) / (1 - like)) ** 2, 200.0)
