"""Rays between a pinhole in air and points behind flat layers.

`pinhole_mm` (3,) is the pinhole, `stack` holds the media above it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.refraction import (
    LayerStack,
    reach_growth,
    reach_per_slope,
)
from gelslim_optics.camera.refraction_newton import newton_slope

Array = NDArray[np.float64]

MAX_REACH = 1e150
# Compiling takes about a second and loading compiled code 0.3 s, which only long arrays repay.
COMPILED_FROM = 20_000


def ray_slope(
    reach_mm: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """Slope tan θ0 in air of the rays with a given lateral reach; inverse of `lateral_reach`.

    The slope is exact to a few rounding errors of the reach, up to grazing incidence.

    Args:
        reach_mm: Reach in mm; the slope is an odd function of it, and NaN gives NaN.
        heights_mm: Thickness of each layer in mm, the air (> 0) first, the others >= 0. All
            broadcast together with `reach_mm`.
        indices: Refractive index of each layer, 1 for the air, the others >= 1.

    Returns:
        The slopes, of the broadcast shape. Long arrays use a compiled loop with the same digits.

    Raises:
        ValueError: There is no air gap, an index or a height is out of range, or a reach is more
            than 1e150 times the air gap.
    """
    signed = np.asarray(reach_mm, dtype=float)
    heights = [np.asarray(h, dtype=float) for h in heights_mm]
    media = [np.asarray(n, dtype=float) for n in indices]
    _check_layers(heights, media)
    r = np.abs(signed)
    if np.any(r > MAX_REACH * heights[0]):
        raise ValueError(
            f"a reach of {np.nanmax(r):g} mm is above the limit of {MAX_REACH:g} air gaps"
        )
    shape = np.broadcast_shapes(r.shape, *(a.shape for a in heights + media))
    size = int(np.prod(shape))
    if size >= COMPILED_FROM:
        from gelslim_optics.camera.refraction_kernel import solve_slopes

        slope = solve_slopes(np.broadcast_to(r, shape), heights, media)
    else:
        slope = np.asarray(newton_slope(r, heights, media), dtype=float)
    return np.copysign(slope, np.broadcast_to(signed, slope.shape))


def as_points(points_mm: ArrayLike) -> Array:
    """Points (n, 3) in mm, or one (3,) as (1, 3). Raises ValueError for another shape."""
    points = np.atleast_2d(np.asarray(points_mm, dtype=float))
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points have shape {np.shape(points_mm)}: give (n, 3), x, y and z in mm")
    return points


def rays_on_axes(pinhole_mm: Array, stack: LayerStack, axes: Array, points_mm: Array) -> Array:
    """Rays (n, 3) in air to the points (n, 3), as components along the rows of `axes` (3, 3).

    Each ray has a unit component along the normal of the layers. Points that are not finite give
    NaN. Raises ValueError for points at or below the pinhole.
    """
    check_above(pinhole_mm, points_mm[:, 2])
    if len(points_mm) < COMPILED_FROM:
        return newton_rays(pinhole_mm, stack, axes, points_mm)
    from gelslim_optics.camera.refraction_kernel import solve_rays

    return solve_rays(points_mm, pinhole_mm, axes, np.array(stack.tops_mm), np.array(stack.indices))


def newton_rays(pinhole_mm: Array, stack: LayerStack, axes: Array, points_mm: Array) -> Array:
    """`rays_on_axes` in NumPy; the input is not checked."""
    planar, _, _ = _planar_rays(pinhole_mm, stack, points_mm)
    x, y = planar.T
    return np.column_stack([a[0] * x + a[1] * y + a[2] for a in axes])


def air_slopes(pinhole_mm: Array, stack: LayerStack, points_mm: Array) -> Array:
    """Slopes dx/dz and dy/dz (n, 2) in air of the rays to the points (n, 3)."""
    check_above(pinhole_mm, points_mm[:, 2])
    return _planar_rays(pinhole_mm, stack, points_mm)[0]


def slope_derivatives(
    pinhole_mm: Array, stack: LayerStack, points_mm: Array
) -> tuple[Array, Array]:
    """`air_slopes` (n, 2) and their derivative (n, 2, 3) by the point's x, y and z, per mm.

    With r the reach and t(r, z) the slope in air, the slope changes along r by 1/r'(t) and across
    it by t/r. If the point rises by dz, the same ray reaches tan θ dz further in its medium.
    """
    check_above(pinhole_mm, points_mm[:, 2])
    planar, slope, unit = _planar_rays(pinhole_mm, stack, points_mm)
    z = points_mm[:, 2]
    heights, indices = stack.crossed_mm(z), stack.indices
    across = 1 / reach_per_slope(slope, heights, indices)
    along = 1 / reach_growth(slope, heights, indices)
    n = stack.index_at(z)
    slope_in_medium = slope / np.sqrt(n * n + (n - 1) * (n + 1) * slope * slope)
    derivative = np.empty((len(z), 2, 3))
    derivative[:, :, :2] = across[:, None, None] * np.eye(2)
    derivative[:, :, :2] += (along - across)[:, None, None] * unit[:, :, None] * unit[:, None, :]
    derivative[:, :, 2] = -(slope_in_medium * along)[:, None] * unit
    return planar, derivative


def points_along(pinhole_mm: Array, stack: LayerStack, slopes: Array, z_mm: Array) -> Array:
    """Points (n, 3) in mm at heights `z_mm` (n,) on the rays with `slopes` (n, 2) in air."""
    size = np.hypot(slopes[:, 0], slopes[:, 1])
    reach = reach_per_slope(size, stack.crossed_mm(z_mm), stack.indices)
    x, y = (pinhole_mm[k] + slopes[:, k] * reach for k in (0, 1))
    return np.column_stack([x, y, z_mm])


def check_above(pinhole_mm: Array, z_mm: Array) -> None:
    """Raise ValueError where a height `z_mm` is not above the pinhole."""
    low = np.asarray(z_mm <= pinhole_mm[2])
    if low.any():
        raise ValueError(
            f"{int(low.sum())} of {np.size(z_mm)} points at z = {np.nanmin(z_mm):g} mm are not "
            f"above the virtual pinhole at z = {pinhole_mm[2]:g} mm"
        )


def _planar_rays(
    pinhole_mm: Array, stack: LayerStack, points_mm: Array
) -> tuple[Array, Array, Array]:
    """Slopes (n, 2) along x and y, their size (n,) and direction (n, 2; zero at the foot)."""
    finite = np.isfinite(points_mm).all(axis=1, keepdims=True)
    points = np.where(finite, points_mm, np.nan)
    lateral = points[:, :2] - pinhole_mm[:2]
    reach = np.sqrt(lateral[:, 0] ** 2 + lateral[:, 1] ** 2)
    media = [np.asarray(n) for n in stack.indices]
    slope = newton_slope(reach, stack.crossed_mm(points[:, 2]), media)
    divisor = np.where(reach > 0, reach, 1.0)
    scale = np.where(np.isnan(reach) | (reach > 0), slope / divisor, 0.0)
    return lateral * scale[:, None], slope, lateral / divisor[:, None]


def _check_layers(heights_mm: Sequence[Array], indices: Sequence[Array]) -> None:
    if not heights_mm or len(heights_mm) != len(indices):
        raise ValueError(
            f"{len(heights_mm)} layer heights but {len(indices)} indices: give one of each for "
            "every layer, the air first"
        )
    if not np.all(heights_mm[0] > 0):
        raise ValueError("the air gap between camera and window must be positive")
    if not np.all(indices[0] == 1):
        raise ValueError("layer 0 is the air and must have the index 1")
    for k, (height, index) in enumerate(zip(heights_mm, indices, strict=True)):
        if not (np.all(height >= 0) and np.all(np.isfinite(height))):
            raise ValueError(
                f"layer {k} has a height of {np.min(height):g} mm: it must be finite and at "
                "least zero"
            )
        if not (np.all(index >= 1) and np.all(np.isfinite(index))):
            raise ValueError(
                f"layer {k} has an index of {np.min(index):g}: it must be finite and at least 1"
            )
