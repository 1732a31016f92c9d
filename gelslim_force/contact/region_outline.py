"""A first estimate of the patch, from the outline of the changed region."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import least_squares

from gelslim_force.contact.indenter import Flat, Indenter
from gelslim_force.contact.patch import ContactPatch, flat_patch, strip_covariance, strip_patch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_OUTLINE_ERROR = 0.15
"""Relative error of a size from the outline alone: the light also changes outside the patch."""
_CLOSING = 3
"""Gaps of up to twice as many bins are closed."""
_MOST_STEPS = 50
_SMALL_GAIN = 1e-9
_FEWEST = 6
"""Smallest number of points of an outline that determine its shape."""


def region_patch(
    region: Mask,
    inner: Mask,
    x_mm: Array,
    y_mm: Array,
    indenter: Indenter | None,
) -> ContactPatch | None:
    """Fit a patch to the outline of a region, where the edge of the pad does not cut it.

    Args:
        region: (rows, columns) bins whose light changed.
        inner: (rows, columns) bins on the pad and not at its edge. Where the region ends with the
            pad or the picture, its edge is not the rim of the patch.
        x_mm: (rows, columns) positions of the bins on the gel.
        y_mm: (rows, columns) likewise.
        indenter: Determines the shape of the patch, which is a disc if None.

    Returns:
        The patch with its covariance; None where the outline does not determine it.
    """
    found = ndimage.find_objects(region.astype(np.uint8))
    if not found:
        return None
    # Closing and filling do not leave the box: the rest of the picture costs nothing.
    box = found[0]
    filled = _filled(region[box])
    rim = filled & ~ndimage.binary_erosion(filled) & inner[box]
    points = np.column_stack([x_mm[box][rim], y_mm[box][rim]])
    inside = np.column_stack([x_mm[box][filled], y_mm[box][filled]])
    if len(points) < _FEWEST:
        return None
    if isinstance(indenter, Flat):
        return flat_patch(indenter, points, inside)
    covariance = np.zeros((4, 4))
    try:
        if indenter is not None and indenter.patch_kind == "strip":
            (offset, half, angle), spread = fit_strip(points)
            axis = getattr(indenter, "axis_deg", None)
            angle = angle if axis is None else float(np.deg2rad(axis))
            patch = strip_patch(offset, half, angle, inside.mean(axis=0))
            covariance[:] = strip_covariance(spread, angle)
        else:
            (x, y, half), spread = fit_circle(points)
            patch = ContactPatch("disc", np.array([x, y]), float(half))
            covariance[:3, :3] = spread
    except (ValueError, np.linalg.LinAlgError):
        return None
    if not (np.isfinite(half) and half < 1.2 * np.ptp(inside, axis=0).max()):
        return None
    error = (_OUTLINE_ERROR * float(half)) ** 2
    covariance[2, 2] += error
    covariance[:2, :2] += np.eye(2) * error / 4
    return replace(patch, covariance=covariance, method="outline")


def _filled(region: Mask) -> Mask:
    closed = ndimage.binary_closing(np.pad(region, _CLOSING), iterations=_CLOSING)
    inside = slice(_CLOSING, -_CLOSING)
    return np.asarray(ndimage.binary_fill_holes(closed[inside, inside] | region))


def circle_start(points_mm: Array) -> Array:
    """Centre and radius (3,) by Taubin's algebraic fit (IEEE PAMI 13, 1991).

    For short arcs its radius is less biased than that of the ordinary algebraic fit.

    Raises ValueError for points (n, 2) on a line, or fewer than three.
    """
    if len(points_mm) < 3:
        raise ValueError("a circle needs three points")
    middle = points_mm.mean(axis=0)
    x, y = (points_mm - middle).T
    z = x * x + y * y
    mean = z.mean()
    if mean <= 0:
        raise ValueError("the points coincide")
    data = np.column_stack([(z - mean) / (2 * np.sqrt(mean)), x, y])
    a, b, c = np.linalg.svd(data, full_matrices=False)[2][2]
    if abs(a) < 1e-9:
        raise ValueError("the points lie on a line")
    a = a / (2 * np.sqrt(mean))
    centre = np.array([-b, -c]) / (2 * a)
    radius = np.sqrt(max(centre @ centre + mean, 0.0))
    return np.array([*(centre + middle), radius])


def fit_circle(points_mm: Array) -> tuple[Array, Array]:
    """Centre and radius (3,) by a robust fit of the distances, with covariance (3, 3).

    The loss is that of `scipy.optimize.least_squares(loss="soft_l1")`, Σ 2 c² (√(1 + d²/c²) - 1),
    with c of twice the scatter about the first circle. Damped steps with the curvature of the loss
    take a fifth of its time for three unknowns.
    """
    values = circle_start(points_mm)
    distance = _from_circle(points_mm, values)
    scale = 2 * max(float(1.4826 * np.median(np.abs(distance))), 1e-6)
    loss = _soft_loss(distance / scale)
    damping = 1e-3
    for _ in range(_MOST_STEPS):
        jacobian, gradient = _circle_slope(points_mm, values, distance, scale)
        normal = jacobian.T @ jacobian
        step = -np.linalg.solve(normal + damping * np.diag(normal.diagonal()), gradient)
        trial = _from_circle(points_mm, values + step)
        gain = loss - _soft_loss(trial / scale)
        if gain > 0:
            values, distance, loss, damping = values + step, trial, loss - gain, damping / 10
        else:
            damping *= 10
        if abs(gain) <= _SMALL_GAIN * loss:
            break
    jacobian, _ = _circle_slope(points_mm, values, distance, scale)
    return values, _covariance(jacobian, distance, 3)


def _circle_slope(
    points_mm: Array, values: Array, distance: Array, scale: float
) -> tuple[Array, Array]:
    """Root of the curvature of half the loss (n, 3), and its gradient (3,)."""
    share = 1 + (distance / scale) ** 2
    towards = (values[:2] - points_mm) / (distance + values[2])[:, None]
    slope = np.column_stack([towards, -np.ones(len(towards))])
    return slope * share[:, None] ** -0.75, slope.T @ (distance / np.sqrt(share))


def _soft_loss(relative: Array) -> float:
    return float((np.sqrt(1 + relative**2) - 1).sum())


def _from_circle(points_mm: Array, values: Array) -> Array:
    return np.asarray(np.hypot(*(points_mm - values[:2]).T) - values[2])


def fit_strip(points_mm: Array) -> tuple[Array, Array]:
    """Offset, half-width and angle (rad) (3,) of two parallel lines, with covariance (3, 3).

    The lines are {p : n·p = offset ± half-width}, with n perpendicular to the strip's direction.

    Raises:
        ValueError: There are fewer than four points.
    """
    if len(points_mm) < 4:
        raise ValueError("a strip needs four points")
    spread = points_mm - points_mm.mean(axis=0)
    _, _, axes = np.linalg.svd(spread, full_matrices=False)
    angle = float(np.arctan2(axes[0, 1], axes[0, 0]))
    across = points_mm @ _normal(angle)
    start = np.array([across.mean(), across.std(), angle])

    def distance(p: Array) -> Array:
        return np.asarray(np.abs(points_mm @ _normal(p[2]) - p[0]) - p[1])

    scale = max(float(1.4826 * np.median(np.abs(distance(start)))), 1e-6)
    found = least_squares(distance, start, loss="soft_l1", f_scale=2 * scale, max_nfev=50)
    return found.x, _covariance(found.jac, distance(found.x), 3)


def _normal(angle: float) -> Array:
    return np.array([-np.sin(angle), np.cos(angle)])


def _covariance(jacobian: Array, residual: Array, unknowns: int) -> Array:
    """Covariance of the solution; about two neighbouring points of an outline have one error."""
    variance = 2 * float(residual @ residual) / max(len(residual) - unknowns, 1)
    return np.asarray(np.linalg.pinv(jacobian.T @ jacobian) * variance)
