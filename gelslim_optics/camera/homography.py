"""The homography nearest to the exact projection of a plane, and what it leaves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.pad_grid import grid_points

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]

MAX_STEPS = 30


@dataclass(frozen=True)
class Homography:
    """Map from x, y (mm) on the plane z = `z_mm` to the image (px), with its misfit.

    `matrix` (3, 3) has a unit last element; `rms_px` and `max_px` are the size of the misfit
    (root mean square and largest) over the grid it was fitted to.
    """

    matrix: Array
    z_mm: float
    rms_px: float
    max_px: float

    def project(self, xy_mm: ArrayLike) -> Array:
        """Image positions (n, 2) in px of points (n, 2) of the plane."""
        return _mapped(self.matrix, np.atleast_2d(np.asarray(xy_mm, dtype=float)))

    def backproject(self, pixels: ArrayLike) -> Array:
        """Points (n, 2) in mm of the plane at image positions (n, 2)."""
        inverse = np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)
        return _mapped(inverse, np.atleast_2d(np.asarray(pixels, dtype=float)))


def fit_homography(
    camera: VirtualCamera, x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0
) -> Homography:
    """Least squares of the image distance in px over the grid of x and y at height z.

    Starts from the direct linear transform in coordinates centred and scaled (Hartley 1997) and
    ends by Gauss-Newton. Raises ValueError for fewer than two different x or y.
    """
    x, y, points = grid_points(x_mm, y_mm, z_mm)
    if len(np.unique(x)) < 2 or len(np.unique(y)) < 2:
        raise ValueError("a homography needs a grid of at least two by two points")
    pixels = camera.project(points)
    plane, from_mm = _normalised(points[:, :2])
    image, from_px = _normalised(pixels)
    fitted = _refined(_linear(plane, image), plane, image)
    matrix = np.linalg.solve(from_px, fitted @ from_mm)
    matrix = matrix / matrix[2, 2]
    miss = np.linalg.norm(_mapped(matrix, points[:, :2]) - pixels, axis=1)
    return Homography(matrix, float(z_mm), float(np.sqrt(np.mean(miss**2))), float(miss.max()))


def _mapped(matrix: Array, xy: Array) -> Array:
    image = xy @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(image[:, :2] / image[:, 2:])


def _normalised(xy: Array) -> tuple[Array, Array]:
    """Points centred with a mean distance of √2, and the matrix (3, 3) that does it.

    One scale for both axes, so that least squares there is least squares in px.
    """
    centre = xy.mean(axis=0)
    scale = np.sqrt(2) / np.linalg.norm(xy - centre, axis=1).mean()
    matrix = np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])
    return (xy - centre) * scale, matrix


def _linear(plane: Array, image: Array) -> Array:
    x, y = plane.T
    one, none = np.ones_like(x), np.zeros_like(x)
    u, v = image.T
    rows = np.concatenate(
        [
            np.column_stack([x, y, one, none, none, none, -u * x, -u * y, -u]),
            np.column_stack([none, none, none, x, y, one, -v * x, -v * y, -v]),
        ]
    )
    return np.linalg.svd(rows.T @ rows)[2][-1].reshape(3, 3)


def _refined(matrix: Array, plane: Array, image: Array) -> Array:
    """Gauss-Newton on the eight free elements; the last, which centring keeps from 0, is 1."""
    h = (matrix / matrix[2, 2]).ravel()[:8]
    x, y = plane.T
    one, none = np.ones_like(x), np.zeros_like(x)
    for _ in range(MAX_STEPS):
        mapped = _mapped(np.append(h, 1.0).reshape(3, 3), plane)
        w = h[6] * x + h[7] * y + 1
        u, v = mapped.T
        rows = np.concatenate(
            [
                np.column_stack([x, y, one, none, none, none, -u * x, -u * y]) / w[:, None],
                np.column_stack([none, none, none, x, y, one, -v * x, -v * y]) / w[:, None],
            ]
        )
        step = np.linalg.lstsq(rows, (image - mapped).T.ravel(), rcond=None)[0]
        h = h + step
        if np.abs(step).max() <= 1e-14 * np.abs(h).max():
            break
    return np.append(h, 1.0).reshape(3, 3)
