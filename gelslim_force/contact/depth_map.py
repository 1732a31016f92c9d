"""Normal displacement from a supplied depth map, by whatever method it was made."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.contact.normal_motion import NormalMotion
from gelslim_optics.camera.height_field import HeightGrid
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
STEPS = 8
SETTLED_MM = 1e-6


def motion_from_image(
    height_mm: ArrayLike,
    camera: VirtualCamera,
    points_mm: ArrayLike,
    *,
    sigma_mm: float = 0.0,
    touched_below_mm: float | None = None,
) -> NormalMotion:
    """Motion of surface nodes (c, 2 or 3) from heights (h, w) registered to the picture.

    `height_mm` is the surface's height in the sensor frame at each pixel, 0 at rest and negative
    where pressed; NaN where unknown. A node is looked up where the camera sees it at its own
    height. Nodes that nothing is known of are NaN. `touched_below_mm` is the height under which
    a node counts as touched; None claims no contact. Raises ValueError for a map of another size
    than the camera's picture, or for points beyond the camera's view model.
    """
    heights = np.asarray(height_mm, dtype=float)
    expected = (camera.image_height_px, camera.image_width_px)
    if heights.shape != expected:
        raise ValueError(
            f"the depth map has shape {heights.shape}, the camera's picture {expected}: "
            "register it to the picture, or give a height grid on the gel"
        )
    points = _planar(points_mm)
    w = np.zeros(len(points))
    for _ in range(STEPS):
        places = camera.project(np.column_stack([points, np.nan_to_num(w)]))
        new = _sampled(heights, places)
        change = np.nanmax(np.abs(new - w), initial=0.0)
        w = new
        if change < SETTLED_MM:
            break
    return _motion(w, sigma_mm, touched_below_mm)


def motion_from_grid(
    height: HeightGrid,
    points_mm: ArrayLike,
    *,
    sigma_mm: float = 0.0,
    touched_below_mm: float | None = None,
) -> NormalMotion:
    """The same from heights on a grid over the gel, in mm; nodes beside the grid are NaN."""
    x, y = _planar(points_mm).T
    w = np.where(height.contains(x, y, 1e-6), height(x, y), np.nan)
    return _motion(w, sigma_mm, touched_below_mm)


def _planar(points_mm: ArrayLike) -> Array:
    points = np.asarray(points_mm, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
        raise ValueError(f"points of shape {points.shape}: give (c, 2) or (c, 3) finite, in mm")
    return points[:, :2]


def _sampled(heights: Array, places_px: Array) -> Array:
    """Bilinear values at places (c, 2); NaN beyond the picture or next to an unknown pixel."""
    rows, columns = heights.shape
    x, y = places_px.T
    within = (x >= 0) & (y >= 0) & (x <= columns - 1) & (y <= rows - 1)
    x, y = np.where(within, x, 0.0), np.where(within, y, 0.0)
    j, i = np.minimum(x.astype(int), columns - 2), np.minimum(y.astype(int), rows - 2)
    u, v = x - j, y - i
    low = heights[i, j] * (1 - u) + heights[i, j + 1] * u
    high = heights[i + 1, j] * (1 - u) + heights[i + 1, j + 1] * u
    return np.where(within, low * (1 - v) + high * v, np.nan)


def _motion(w: Array, sigma_mm: float, touched_below_mm: float | None) -> NormalMotion:
    if not (np.isfinite(sigma_mm) and sigma_mm >= 0):
        raise ValueError(f"sigma_mm = {sigma_mm}: must be finite, 0 or more")
    known = np.isfinite(w)
    touched = np.zeros(len(w), dtype=bool)
    if touched_below_mm is not None:
        touched = known & (w < touched_below_mm)
    none = np.full(len(w), np.nan)
    if not known.any():
        problem = "the depth map knows nothing about the pad's surface nodes"
        return NormalMotion(w, none, touched, np.nan, np.nan, none, problem)
    depth = max(0.0, float(-np.nanmin(w)))
    return NormalMotion(w, np.where(known, sigma_mm, np.nan), touched, depth, sigma_mm, none)
