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

GAUSS = (-0.7746, 0.0, 0.7746), (5 / 18, 8 / 18, 5 / 18)
STEPS = 12
RIM_SINKING = 0.1
MIDDLE_SINKING = 0.6
"""Sinking at the rim and in the middle, in a²/R: rough, to place what is seen."""


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
    """Pairs (k,) of neighbouring bins."""


@dataclass(frozen=True, eq=False)
class ShadingFit:
    """`values` (4,) are x, y, radius, decay of a disc; offset, angle, half-width, decay of a strip."""

    values: Array
    covariance: Array
    explained: float
    """Share of the change that the fit explains."""


def disc_slope(ratio: Array, decay: float) -> tuple[Array, Array]:
    """Slope over that at the rim, and the outer correction, at r/a (n,).

    Beside the patch: Hertz's half-space, (2/π)(ρ asin 1/ρ - √(1 - 1/ρ²)), times exp(-decay (ρ-1))
    for the layer's nearness.
    """
    out = np.maximum(ratio, 1.0)
    hertz = (2 / np.pi) * (out * np.arcsin(1 / out) - np.sqrt(1 - 1 / (out * out)))
    return _faded(ratio, out, hertz, decay)


def strip_slope(ratio: Array, decay: float) -> tuple[Array, Array]:
    """The same for a strip: ξ - √(ξ² - 1) beside it."""
    out = np.maximum(ratio, 1.0)
    return _faded(ratio, out, out - np.sqrt(out * out - 1), decay)


def _faded(ratio: Array, out: Array, free: Array, decay: float) -> tuple[Array, Array]:
    fade = np.exp(-decay * (out - 1))
    return np.where(ratio < 1, ratio, free * fade), (out - 1) * np.exp(-(1 + decay) * (out - 1))


def fit_shading(
    window: Window, start: Array, strip: bool, curvature_per_mm: float, blur_mm: float
) -> ShadingFit | None:
    """Gauss-Newton with the gains projected out; None where it does not settle.

    `curvature_per_mm` is 1/R of the indenter, 0 where unknown; `blur_mm` widens the crease.
    """
    theta = start.copy()
    scale = np.array([1.0, 1.0 if not strip else 0.2, 1.0, 2.0])
    residual, _ = _residual(window, theta, strip, curvature_per_mm, blur_mm)
    cost, damping = float((residual**2).sum()), 1e-3
    jacobian = np.zeros((residual.size, 4))
    for _ in range(STEPS):
        for k in range(4):
            small = 1e-3 * scale[k] * max(theta[2], 0.1)
            moved = theta.copy()
            moved[k] += small
            ahead, _ = _residual(window, moved, strip, curvature_per_mm, blur_mm)
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
            trial[3] = min(max(trial[3], 0.0), 8.0)
            tried, explained = _residual(window, trial, strip, curvature_per_mm, blur_mm)
            new = float((tried**2).sum())
            if new <= cost:
                gained = cost - new
                theta, residual, cost = trial, tried, new
                damping = max(damping / 5, 1e-6)
                settled = gained < 1e-5 * cost and bool((np.abs(step[:3]) < 1e-3).all())
                break
            damping *= 6
        else:
            settled = True
        if settled:
            break
    _, explained = _residual(window, theta, strip, curvature_per_mm, blur_mm)
    if not np.isfinite(theta).all() or theta[2] < 1.5 * window.bin_mm:
        return None
    freedom = max(residual.size - 4 - 7 * residual.shape[1], 1)
    spread = cost / freedom * _together(residual, window)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * spread
    return ShadingFit(theta, covariance, explained)


def _residual(
    window: Window, theta: Array, strip: bool, curvature: float, blur_mm: float
) -> tuple[Array, float]:
    """What the best gains leave (n, c), and the share they explain."""
    basis = _basis(window, theta, strip, curvature, blur_mm)
    q, _ = np.linalg.qr(basis)
    left = window.change - q @ (q.T @ window.change)
    whole = window.change - window.change.mean(axis=0)
    return left, 1.0 - float((left**2).sum() / max((whole**2).sum(), 1e-12))


def _basis(window: Window, theta: Array, strip: bool, curvature: float, blur_mm: float) -> Array:
    size = max(float(theta[2]), 1e-3)
    x, y = window.x_mm, window.y_mm
    if curvature > 0:
        # Where the ray meets the gel, sunk in: the sinking changes little over that shift.
        r = _offset(x, y, theta, strip)[0] / size
        inside = MIDDLE_SINKING - 0.5 * r * r
        beside = RIM_SINKING * np.exp(-2 * np.maximum(r - 1, 0))
        z = -size * size * curvature * np.where(r < 1, inside, beside)
        x, y = x + window.lean[:, 0] * z, y + window.lean[:, 1] * z
    r, ux, uy = _offset(x, y, theta, strip)
    slope, outer = np.zeros_like(r), np.zeros_like(r)
    law = strip_slope if strip else disc_slope
    for place, weight in zip(*GAUSS, strict=True):
        # The crease, averaged over the bin and the blur.
        one, two = law(np.abs(r + place * blur_mm) / size, float(theta[3]))
        slope += weight * one
        outer += weight * two
    ones = np.ones_like(r)
    if strip:
        return np.column_stack([slope * ux, outer * ux, slope * slope, ones])
    return np.column_stack([slope * ux, slope * uy, outer * ux, outer * uy, slope * slope, ones])


def _offset(x: Array, y: Array, theta: Array, strip: bool) -> tuple[Array, Array, Array]:
    """Distance from the middle and its direction; of a strip, the side (±1)."""
    if strip:
        across = np.cos(theta[1]) * y - np.sin(theta[1]) * x - theta[0]
        return np.abs(across), np.sign(across), np.zeros_like(across)
    dx, dy = x - theta[0], y - theta[1]
    r = np.hypot(dx, dy)
    safe = np.maximum(r, 1e-9)
    return r, dx / safe, dy / safe


def _together(residual: Array, window: Window) -> float:
    """How many bins err as one, from the likeness of neighbours along rows and columns."""
    power = float((residual**2).mean())
    if power <= 0:
        return 1.0
    factor = 1.0
    for a, b in (window.steps,):
        if len(a):
            like = float((residual[a] * residual[b]).mean()) / power
            like = min(max(like, 0.0), 0.95)
            factor *= ((1 + like) / (1 - like)) ** 2
    return min(factor, 200.0)
