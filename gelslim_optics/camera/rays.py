"""Rays between the virtual pinhole and points behind flat layers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.refraction import (
    COMPILED_FROM,
    newton_slope,
    reach_growth,
    reach_per_slope,
)

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]


def as_points(points_mm: ArrayLike) -> Array:
    """Points (n, 3) in mm, or one (3,) as (1, 3). Raises ValueError for another shape."""
    points = np.atleast_2d(np.asarray(points_mm, dtype=float))
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points have shape {np.shape(points_mm)}: give (n, 3), x, y and z in mm")
    return points


def rays_on_axes(camera: VirtualCamera, points_mm: Array) -> Array:
    """Rays (n, 3) in air to the points (n, 3): parts along right, down and forward.

    Scaled to a unit part along the layers' normal. Not finite in, NaN out.
    Raises ValueError for points at or below the pinhole's height.
    """
    _check_above(camera, points_mm[:, 2])
    if len(points_mm) < COMPILED_FROM:
        return newton_rays(camera, points_mm)
    from gelslim_optics.camera.refraction_kernel import solve_rays

    stack = camera.stack
    tops, indices = np.array(stack.tops_mm), np.array(stack.indices)
    return solve_rays(points_mm, camera.position_mm, camera.axes, tops, indices)


def newton_rays(camera: VirtualCamera, points_mm: Array) -> Array:
    """Reference for the compiled loop: `rays_on_axes`, unchecked."""
    planar, _, _ = _planar_rays(camera, points_mm)
    x, y = planar.T
    return np.column_stack([a[0] * x + a[1] * y + a[2] for a in camera.axes])


def air_slopes(camera: VirtualCamera, points_mm: Array) -> Array:
    """Parts along x and y (n, 2) of the rays in air to the points, per unit of height."""
    _check_above(camera, points_mm[:, 2])
    return _planar_rays(camera, points_mm)[0]


def slope_derivatives(camera: VirtualCamera, points_mm: Array) -> tuple[Array, Array]:
    """`air_slopes` (n, 2) and their derivative (n, 2, 3) by the point's x, y and z, per mm.

    With r the reach and t(r, z) the slope in air: along r the slope grows by 1/r'(t), across it
    by t/r; raising the point by dz at the same slope carries the ray on by tan θ in its medium.
    """
    _check_above(camera, points_mm[:, 2])
    planar, slope, unit = _planar_rays(camera, points_mm)
    stack = camera.stack
    z = points_mm[:, 2]
    heights, indices = stack.crossed_mm(z), stack.indices
    across = 1 / reach_per_slope(slope, heights, indices)
    along = 1 / reach_growth(slope, heights, indices)
    n = stack.index_at(z)
    lean = slope / np.sqrt(n * n + (n - 1) * (n + 1) * slope * slope)
    derivative = np.empty((len(z), 2, 3))
    derivative[:, :, :2] = across[:, None, None] * np.eye(2)
    derivative[:, :, :2] += (along - across)[:, None, None] * unit[:, :, None] * unit[:, None, :]
    derivative[:, :, 2] = -(lean * along)[:, None] * unit
    return planar, derivative


def points_along(camera: VirtualCamera, slopes: Array, z_mm: Array) -> Array:
    """Where the rays of `slopes` (n, 2) in air are at height `z_mm` (n,): points (n, 3)."""
    stack = camera.stack
    steepness = np.hypot(slopes[:, 0], slopes[:, 1])
    reach = reach_per_slope(steepness, stack.crossed_mm(z_mm), stack.indices)
    return np.column_stack([camera.position_mm[:2] + slopes * reach[:, None], z_mm])


def _planar_rays(camera: VirtualCamera, points_mm: Array) -> tuple[Array, Array, Array]:
    """Slopes (n, 2) along x and y, their size (n,) and their direction (n, 2; 0 at the foot)."""
    stack = camera.stack
    finite = np.isfinite(points_mm).all(axis=1, keepdims=True)
    points = np.where(finite, points_mm, np.nan)
    lateral = points[:, :2] - camera.position_mm[:2]
    reach = np.sqrt(lateral[:, 0] ** 2 + lateral[:, 1] ** 2)
    media = [np.asarray(n) for n in stack.indices]
    slope = newton_slope(reach, stack.crossed_mm(points[:, 2]), media)
    apart = np.where(reach > 0, reach, 1.0)
    scale = np.where(np.isnan(reach) | (reach > 0), slope / apart, 0.0)
    return lateral * scale[:, None], slope, lateral / apart[:, None]


def _check_above(camera: VirtualCamera, z_mm: Array) -> None:
    low = np.asarray(z_mm <= camera.position_mm[2])
    if low.any():
        raise ValueError(
            f"{int(low.sum())} of {z_mm.size} points lie at or below the virtual pinhole's height "
            f"(z = {np.nanmin(z_mm):g} mm, pinhole at {camera.position_mm[2]:g} mm): they must be "
            "above it, where it looks"
        )
