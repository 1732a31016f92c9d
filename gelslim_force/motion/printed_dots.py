"""Where the centroid of a printed dot moves in the picture as the gel carries and strains the dot.

A detector finds the centroid of a dot's image. Where the strain varies over the dot, that centroid
is not the image of the dot's middle: the parts that widen count more, and a surface that is curved
through the dot carries its middle farther than its rim. For a small dot of radius R whose points
move by u in the picture, the motion of the centroid is, to first order in u,

    1/(π R²) ∮ (x - x₀) (u · n) ds,

which follows from the area centroid of x + u by the divergence theorem. It differs from u at the
middle by about R²/8 (∇²u + 2 ∇ div u). Here it is taken without linearisation: points of the
rim are moved and projected, and the centroid is that of what the curve through them encloses.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_POINTS = 8
"""Points of a rim, with which a motion of second degree is taken exactly."""


def disc_rims_mm(centres_mm: ArrayLike, diameter_mm: ArrayLike) -> Array:
    """Points (n, 8, 2) of the rims of discs in the plane, evenly spaced.

    Args:
        centres_mm: (n, 2).
        diameter_mm: (n,), or one for all discs.

    Raises:
        ValueError: The arrays do not fit.
    """
    centres = np.asarray(centres_mm, dtype=float)
    if centres.ndim != 2 or centres.shape[1] != 2:
        raise ValueError(f"disc centres {centres.shape}: must be (n, 2)")
    radius = np.broadcast_to(np.asarray(diameter_mm, dtype=float) / 2, (len(centres),))
    turn = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)
    unit = np.column_stack([np.cos(turn), np.sin(turn)])
    return np.asarray(centres[:, None, :] + radius[:, None, None] * unit)


def rim_centroids(rims: Array) -> Array:
    """Area centroids (n, 2) of what smooth closed rims (n, k, 2) enclose; k is even.

    By Green's theorem, with the curve between the points by trigonometric interpolation (L. N.
    Trefethen, "Spectral methods in MATLAB", 2000, chapter 3): a few points give what a polygon
    needs hundreds for.
    """
    middle = rims.mean(axis=1)
    x, y = np.moveaxis(rims - middle[:, None], 2, 0)
    by_turn = _derivative(rims.shape[1])
    dx, dy = x @ by_turn.T, y @ by_turn.T
    area = (x * dy - y * dx).sum(axis=1)
    moment = np.column_stack([(x * x * dy).sum(axis=1), -(y * y * dx).sum(axis=1)])
    return np.asarray(middle + moment / area[:, None])


@cache
def _derivative(count: int) -> Array:
    """(k, k) matrix of the derivative of periodic values at k evenly spaced points, k even."""
    step = np.arange(count)
    step[0] = 1
    row = 0.5 * (-1.0) ** step / np.tan(np.pi * step / count)
    row[0] = 0.0
    apart = np.subtract.outer(np.arange(count), np.arange(count)) % count
    matrix = row[apart]
    matrix.setflags(write=False)
    return matrix


@dataclass(frozen=True, eq=False)
class PrintedDots:
    """n dots of the gel as one camera sees them.

    Attributes:
        camera: What sees them.
        rest_mm: (n, 3) their middles at rest.
        diameter_mm: (n,) their diameters at rest.
    """

    camera: VirtualCamera
    rest_mm: Array
    diameter_mm: Array

    @cached_property
    def rims_mm(self) -> Array:
        """(n, k, 3) points of their rims at rest."""
        flat = disc_rims_mm(self.rest_mm[:, :2], self.diameter_mm)
        height = np.broadcast_to(self.rest_mm[:, None, 2:], (*flat.shape[:2], 1))
        return np.concatenate([flat, height], axis=2)

    def shift_px(self, motion_mm: Array) -> Array:
        """Motion (n, 2) of the centroids of the dots in the picture.

        Args:
            motion_mm: (n, k, 3) of the points of their rims.
        """
        return np.asarray(self._centroids_px(self.rims_mm + motion_mm) - self._rest_px)

    @cached_property
    def _rest_px(self) -> Array:
        """(n, 2) centroids at rest."""
        return self._centroids_px(self.rims_mm)

    def _centroids_px(self, rims_mm: Array) -> Array:
        image = self.camera.project(rims_mm.reshape(-1, 3))
        return rim_centroids(image.reshape(*rims_mm.shape[:2], 2))
