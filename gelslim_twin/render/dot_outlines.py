"""Outlines of the printed dots in the picture, and their true centres.

A few rim points are displaced with the gel and projected exactly; the closed curve through them
is smooth, so its Fourier series is short and gives the many corners of the outline that is
filled. The centre is the centroid of the area, which is not the image of the dot's centre.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.marker_motion import MarkerMotion
    from gelslim_twin.render.printed_dots import PrintedDots
    from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
RIM_POINTS = 8
CORNERS = 48


def outlines_px(
    camera: VirtualCamera,
    dots: PrintedDots,
    motion: SurfaceState | MarkerMotion,
    *,
    rim_points: int = RIM_POINTS,
    corners: int = CORNERS,
) -> Array:
    """Outlines (m, corners, 2) of the dots carried along by the surface; all dots, drawn or not.

    The rim is widened so that the polygon has the ellipse's area and second moments to 1 in
    `corners`⁴. Raises ValueError for dots that the camera cannot project.
    """
    turn = 2 * np.pi / corners
    rim = dots.rim_mm(rim_points, float(np.sqrt(turn / np.sin(turn))))
    points = np.zeros((len(dots) * rim_points, 3))
    points[:, :2] = rim.reshape(-1, 2)
    if motion.moves:
        points += motion.carried(dots.centres_mm, rim).reshape(-1, 3)
    projected = camera.project(points).reshape(len(dots), rim_points, 2)
    if rim_points == corners:
        return projected
    from gelslim_twin.render.outline_kernel import expand

    out = np.empty((len(dots), corners, 2))
    expand(projected, _series(rim_points, corners), out)
    return out


def centroids_px(outlines: Array) -> tuple[Array, Array]:
    """Area centroids (m, 2) and signed areas (m,) of outlines (m, k, 2), by Green's theorem."""
    from gelslim_twin.render.outline_kernel import centroids

    centres, area = np.empty((len(outlines), 2)), np.empty(len(outlines))
    centroids(np.ascontiguousarray(outlines), centres, area)
    return centres, area


def a_priori_bound_px(scale_px_per_mm: float, largest_displacement_mm: float) -> float:
    """Bound of leaving the dots where they were printed: the displacement in px."""
    return scale_px_per_mm * largest_displacement_mm


@cache
def _series(points: int, corners: int) -> Array:
    """Weights (corners, points) of trigonometric interpolation, even number of points."""
    if points % 2 or points < 4:
        raise ValueError(f"{points} rim points: must be an even number, at least 4")
    apart = (
        2 * np.pi * (np.arange(corners)[:, None] / corners - np.arange(points)[None, :] / points)
    )
    orders = np.arange(1, points // 2)
    whole = 1 + 2 * np.cos(orders * apart[..., None]).sum(axis=2) + np.cos(points / 2 * apart)
    weights: Array = whole / points
    return weights
