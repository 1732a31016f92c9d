"""The printed dots and their outlines in the picture.

A few points of each rim are displaced with the gel and projected exactly. The closed curve through
them is smooth, so that a short Fourier series gives the corners of the polygon that is filled. The
true centre is the centroid of this area, which is not the image of the dot's centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.surface_state import SurfaceState
    from ifem_export.markers.grid import MarkerGrid


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PrintedDots:
    """Ellipses of ink on the undeformed surface: centres (m, 2), semi-axes (m, 2), angles (m,).

    `opacity` (m,) is the ink of each dot over the usual.
    """

    centres_mm: Array
    semi_axes_mm: Array
    turn_rad: Array
    present: NDArray[np.bool_]
    opacity: NDArray[np.float32]

    @classmethod
    def nominal(cls, grid: MarkerGrid) -> PrintedDots:
        """A print of a marker grid without faults."""
        half = np.asarray(grid.diameter_mm, dtype=float) / 2
        return cls(
            centres_mm=np.array(grid.positions_mm, dtype=float),
            semi_axes_mm=np.column_stack([half, half]),
            turn_rad=np.zeros(len(half)),
            present=np.ones(len(half), dtype=bool),
            opacity=np.ones(len(half), dtype=np.float32),
        )

    def __len__(self) -> int:
        return len(self.centres_mm)

    def rim_mm(self, count: int, scale: float = 1.0) -> Array:
        """Points (m, count, 2) on the rims, whose semi-axes are stretched by `scale`."""
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        u = self.semi_axes_mm[:, :1] * np.cos(angle) * scale
        v = self.semi_axes_mm[:, 1:] * np.sin(angle) * scale
        c, s = np.cos(self.turn_rad)[:, None], np.sin(self.turn_rad)[:, None]
        offset = np.stack([c * u - s * v, s * u + c * v], axis=2)
        rim: Array = self.centres_mm[:, None, :] + offset
        return rim


RIM_POINTS = 8
CORNERS = 48


def outlines_px(
    camera: VirtualCamera,
    dots: PrintedDots,
    surface: SurfaceState,
    *,
    rim_points: int = RIM_POINTS,
    corners: int = CORNERS,
) -> Array:
    """Outlines (m, corners, 2) of all dots on the displaced surface, drawn or not.

    The rim is scaled so that area and second moments of the polygon equal those of the ellipse up
    to a relative error of the order `corners`⁻⁴. Raises ValueError for dots that the camera
    cannot project.
    """
    rim = dots.rim_mm(rim_points, rim_scale(corners)).reshape(-1, 2)
    points = surface.at(rim)
    points[:, :2] += rim
    projected = camera.project(points).reshape(len(dots), rim_points, 2)
    if rim_points == corners:
        return projected
    from gelslim_twin.render.dot_kernel import expand

    out = np.empty((len(dots), corners, 2))
    expand(projected, series(rim_points, corners), out)
    return out


def centroids_px(outlines: Array) -> tuple[Array, Array]:
    """Area centroids (m, 2) and signed areas (m,) of outlines (m, k, 2), by Green's theorem."""
    from gelslim_twin.render.dot_kernel import moments

    centres, area = np.empty((len(outlines), 2)), np.empty(len(outlines))
    moments(np.ascontiguousarray(outlines, dtype=float), centres, area)
    return centres, area


def rim_scale(corners: int) -> float:
    """Scale of the rim of a disc at which a polygon of `corners` has the disc's area."""
    turn = 2 * np.pi / corners
    return float(np.sqrt(turn / np.sin(turn)))


@cache
def series(points: int, corners: int) -> Array:
    """Weights (corners, points) of trigonometric interpolation for an even number of points."""
    apart = (
        2 * np.pi * (np.arange(corners)[:, None] / corners - np.arange(points)[None, :] / points)
    )
    orders = np.arange(1, points // 2)
    whole = 1 + 2 * np.cos(orders * apart[..., None]).sum(axis=2) + np.cos(points / 2 * apart)
    weights: Array = whole / points
    return weights
