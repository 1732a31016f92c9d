"""A plane lattice seen by a lens with radial distortion, before anything else of it is known.

A homography with radial distortion about the middle of the picture is independent of the focal
length: a point at the distance r from the middle, in half diagonals of the picture, is moved to
r (1 + a r² + b r⁴ + c r⁶). With the focal length the same distortion has the coefficients k1, k2
and k3 of Brown's model.
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
_POOR_PX, _WORTH = 0.6, 0.7
"""Median misfit with two coefficients from which a third is tried, and how much less it must be."""
_REACH = 1.1
"""Radius up to which the distortion must be one-to-one, over that of the farthest point."""
_LEAST_SLOPE = 0.15
"""Smallest growth of the distorted radius with the undistorted one within that radius."""
_USUAL_BEND = np.array([1.0, 2.0, 2.0])
"""Size of the coefficients of a strong distortion: larger ones need dots that ask for them."""
_STIFF_PX = 1e3
"""Misfit for each unit by which the growth is less."""


@dataclass(frozen=True, eq=False)
class BentHomography:
    """A homography followed by radial distortion.

    Attributes:
        matrix: (3, 3) from mm to px, as a lens without distortion would show them.
        bend: Coefficients a, b and c of the distortion, for radii in half diagonals.
        half_diagonal_px: The unit of these radii.
    """

    matrix: Array
    bend: tuple[float, float, float]
    half_diagonal_px: float

    def lens(self, focal_px: float) -> LensDistortion | None:
        """The distortion for a focal length; None where there is none."""
        unit = (focal_px / self.half_diagonal_px) ** 2
        a, b, c = self.bend
        lens = LensDistortion(k1=a * unit, k2=b * unit**2, k3=c * unit**3)
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
    values, left = _fitted(places_mm, target, half, reach_mm, 2)
    if left > _POOR_PX:
        # A third coefficient would follow what refraction and print do to dots of a plain lens.
        more, less = _fitted(places_mm, target, half, reach_mm, 3)
        values = more if less < _WORTH * left else values
    radius = np.hypot(*target.T).max()
    bend = values[8:]
    effect = float(np.abs(bend @ [radius**3, radius**5, radius**7])) * half
    if effect < _LEAST_EFFECT_PX:
        return BentHomography(fit_homography(places_mm, seen_px), (0.0, 0.0, 0.0), half)
    to_px = np.array([[half, 0, middle[0]], [0, half, middle[1]], [0, 0, 1.0]])
    matrix = to_px @ np.append(values[:8], 1.0).reshape(3, 3)
    return BentHomography(matrix, (float(bend[0]), float(bend[1]), float(bend[2])), half)


def _fitted(
    places_mm: Array, target: Array, half_px: float, reach_mm: Array, coefficients: int
) -> tuple[Array, float]:
    """Homography and three coefficients (11,), of which so many are free, and the median misfit.

    `target` (k, 2) are the dots in half diagonals from the middle.
    """
    start = fit_homography(places_mm, target)
    start = start / start[2, 2]

    def whole(free: Array) -> Array:
        return np.append(free, np.zeros(3 - coefficients))

    def misfit(free: Array) -> Array:
        values = whole(free)
        matrix = np.append(values[:8], 1.0).reshape(3, 3)
        left = (_bent(_flat(matrix, places_mm), values[8:]) - target).ravel() * half_px
        farthest = np.hypot(*_flat(matrix, reach_mm).T).max()
        squared = (_REACH * farthest * np.linspace(0, 1, 12)) ** 2
        a, b, c = values[8:]
        slope = 1 + 3 * a * squared + 5 * b * squared**2 + 7 * c * squared**3
        folded = _STIFF_PX * np.minimum(slope - _LEAST_SLOPE, 0.0)
        return np.concatenate([left, folded, values[8:] / _USUAL_BEND])

    # Lengths on the gel and in the picture differ in size: each value has a scale of its own.
    scale = np.maximum(np.abs(start.ravel()[:8]), 1e-4)
    found = least_squares(
        misfit,
        np.append(start.ravel()[:8], np.zeros(coefficients)),
        x_scale=np.append(scale, np.full(coefficients, 0.1)),
        loss="soft_l1",
        f_scale=_SOFT_PX,
        max_nfev=200,
    )
    left = found.fun[: target.size].reshape(-1, 2)
    return whole(found.x), float(np.median(np.hypot(*left.T)))


def _flat(matrix: Array, points: Array) -> Array:
    """Points (k, 2) of the plane in the picture of an ideal lens."""
    image = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    flat: Array = image[:, :2] / image[:, 2:]
    return flat


def _bent(flat: Array, bend: Array) -> Array:
    squared = (flat**2).sum(axis=1, keepdims=True)
    bent: Array = flat * (1 + bend[0] * squared + bend[1] * squared**2 + bend[2] * squared**3)
    return bent
