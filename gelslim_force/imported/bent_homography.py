"""A plane lattice seen by a lens with radial distortion, before anything else of it is known.

A homography with radial distortion about the middle of the picture is independent of the focal
length: a point at the distance r from the middle, in half diagonals of the picture, is moved to
r (1 + a r² + b r⁴). With the focal length the same distortion has the coefficients k1 and k2 of
Brown's model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from gelslim_force.lattice.homography import fit_homography
from gelslim_optics.camera.lens_distortion import LensDistortion

Array = NDArray[np.float64]
_LEAST_EFFECT_PX = 0.3
"""Distortion at the farthest dot that is not worth a start of its own."""
_SOFT_PX = 1.0
_REACH = 1.1
"""Radius up to which the distortion must be one-to-one, over that of the farthest point."""
_LEAST_SLOPE = 0.15
"""Smallest growth of the distorted radius with the undistorted one within that radius."""
_STIFF_PX = 1e3
"""Misfit for each unit by which the growth is less."""


@dataclass(frozen=True, eq=False)
class BentHomography:
    """A homography followed by radial distortion.

    Attributes:
        matrix: (3, 3) from mm to px, as a lens without distortion would show them.
        bend: Coefficients a and b of the distortion, for radii in half diagonals.
        half_diagonal_px: The unit of these radii.
    """

    matrix: Array
    bend: tuple[float, float]
    half_diagonal_px: float

    def lens(self, focal_px: float) -> LensDistortion | None:
        """The distortion for a focal length; None where there is none."""
        unit = (focal_px / self.half_diagonal_px) ** 2
        lens = LensDistortion(k1=self.bend[0] * unit, k2=self.bend[1] * unit**2)
        return lens if lens.distorts else None


def bent_homography(
    places_mm: Array, seen_px: Array, size_px: tuple[int, int], reach_mm: Array
) -> BentHomography:
    """Fit homography and distortion to dots.

    Args:
        places_mm: (k, 2) on the plane.
        seen_px: (k, 2) in the picture.
        size_px: Width and height of the picture.
        reach_mm: (m, 2) points up to which the distortion has to be one-to-one, such as the corners
            of the gel, which the picture need not show.

    Returns:
        The fit with the least sum of a robust loss; without distortion where it hardly counts.
    """
    half = float(np.hypot(*size_px) / 2)
    middle = (np.array(size_px) - 1) / 2
    target = (seen_px - middle) / half
    start = fit_homography(places_mm, target)
    start = start / start[2, 2]

    def misfit(values: Array) -> Array:
        matrix = np.append(values[:8], 1.0).reshape(3, 3)
        left = (_bent(_flat(matrix, places_mm), values[8:]) - target).ravel() * half
        farthest = np.hypot(*_flat(matrix, reach_mm).T).max()
        squared = (_REACH * farthest * np.linspace(0, 1, 12)) ** 2
        slope = 1 + 3 * values[8] * squared + 5 * values[9] * squared**2
        return np.concatenate([left, _STIFF_PX * np.minimum(slope - _LEAST_SLOPE, 0.0)])

    # Lengths on the gel and in the picture differ in size: each value has a scale of its own.
    scale = np.append(np.maximum(np.abs(start.ravel()[:8]), 1e-4), [0.1, 0.1])
    found = least_squares(
        misfit,
        np.append(start.ravel()[:8], [0.0, 0.0]),
        x_scale=scale,
        loss="soft_l1",
        f_scale=_SOFT_PX,
        max_nfev=200,
    )
    radius = np.hypot(*target.T).max()
    effect = float(np.abs(found.x[8] * radius**3 + found.x[9] * radius**5)) * half
    to_px = np.array([[half, 0, middle[0]], [0, half, middle[1]], [0, 0, 1.0]])
    if effect < _LEAST_EFFECT_PX:
        return BentHomography(fit_homography(places_mm, seen_px), (0.0, 0.0), half)
    matrix = to_px @ np.append(found.x[:8], 1.0).reshape(3, 3)
    return BentHomography(matrix, (float(found.x[8]), float(found.x[9])), half)


def _flat(matrix: Array, points: Array) -> Array:
    """Points (k, 2) of the plane in the picture of an ideal lens."""
    image = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    flat: Array = image[:, :2] / image[:, 2:]
    return flat


def _bent(flat: Array, bend: Array) -> Array:
    squared = (flat**2).sum(axis=1, keepdims=True)
    bent: Array = flat * (1 + bend[0] * squared + bend[1] * squared**2)
    return bent
