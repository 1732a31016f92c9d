"""How sharply the camera sees a grid on the pad, and how far its picture is from a homography."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.refraction import reach_growth, reach_per_slope
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]


def grid_points(x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0) -> tuple[Array, Array, Array]:
    """The axes x (nx,) and y (ny,) and the points (ny nx, 3) of their grid, x varying fastest.

    Raises ValueError for axes that are not one-dimensional and finite.
    """
    x, y = (np.atleast_1d(np.asarray(a, dtype=float)) for a in (x_mm, y_mm))
    if x.ndim != 1 or y.ndim != 1 or not len(x) or not len(y):
        raise ValueError(f"grid axes of shape {x.shape} and {y.shape} must be one-dimensional")
    if not (np.isfinite(x).all() and np.isfinite(y).all() and np.isfinite(z_mm)):
        raise ValueError("grid axes and height must be finite")
    y_grid, x_grid = np.meshgrid(y, x, indexing="ij")
    points = np.column_stack([x_grid.ravel(), y_grid.ravel(), np.full(x_grid.size, float(z_mm))])
    return x, y, points


def blur_map(
    camera: VirtualCamera,
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    aperture_mm: float,
    focus_mm: float,
    z_mm: float = 0.0,
) -> Array:
    """Largest blur diameter on the gel, A |Z - s| / s, on a grid.

    Flat layers seen at an angle are astigmatic: with r(t) the reach at slope t, rays side by side
    meet at the height r/t above the pinhole, rays above one another at dr/dt. Z is the distance
    along the axis of the image that is less sharp. (`VirtualCamera.blur_on_gel_mm` uses the
    paraxial image.)

    Args:
        camera: The camera.
        x_mm: Coordinates (nx,) of the grid.
        y_mm: Coordinates (ny,) of the grid.
        aperture_mm: Diameter A of the entrance pupil, f/N.
        focus_mm: Distance s in air on which the lens is focused.
        z_mm: Height of the grid.

    Returns:
        Blur diameters (ny, nx) in mm.

    Raises:
        ValueError: Aperture or focus is not positive.
    """
    if not (aperture_mm > 0 and focus_mm > 0):
        raise ValueError(
            f"aperture_mm = {aperture_mm} and focus_mm = {focus_mm}: both must be positive"
        )
    x, y, points = grid_points(x_mm, y_mm, z_mm)
    slopes = camera.air_slopes(points)
    slope = np.hypot(slopes[:, 0], slopes[:, 1])
    heights, indices = camera.stack.crossed_mm(points[:, 2]), camera.stack.indices
    per_height = slopes @ camera.forward[:2] + camera.forward[2]
    defocus = [
        np.abs(image_height(slope, heights, indices) * per_height - focus_mm)
        for image_height in (reach_per_slope, reach_growth)
    ]
    return np.asarray(aperture_mm * np.max(defocus, axis=0) / focus_mm).reshape(len(y), len(x))


@dataclass(frozen=True)
class Homography:
    """Homography from a plane to the image, with its residuals.

    Attributes:
        matrix: (3, 3) from x, y in mm to the image in px; the last element is 1.
        rms_px: Root mean square of the residuals over the grid of the fit.
        max_px: Largest residual.
    """

    matrix: Array
    rms_px: float
    max_px: float


def fit_homography(
    camera: VirtualCamera, x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0
) -> Homography:
    """The homography with the least squared distance in px to the projection of a plane grid.

    Coordinates are centred and scaled for the fit (Hartley 1997).

    Args:
        camera: The camera.
        x_mm: Coordinates (nx,) of the grid, two or more.
        y_mm: Coordinates (ny,) of the grid, two or more.
        z_mm: Height of the plane.

    Returns:
        The homography.

    Raises:
        ValueError: There are fewer than two different x or y.
    """
    from scipy.optimize import least_squares

    x, y, points = grid_points(x_mm, y_mm, z_mm)
    if len(np.unique(x)) < 2 or len(np.unique(y)) < 2:
        raise ValueError("a homography needs a grid of at least two by two points")
    pixels = camera.project(points)
    plane, from_mm = _normalised(points[:, :2])
    image, from_px = _normalised(pixels)
    affine = np.linalg.lstsq(np.column_stack([plane, np.ones(len(plane))]), image, rcond=None)[0]
    start = np.concatenate([affine.T.ravel(), [0.0, 0.0]])
    fit = least_squares(
        lambda h: (_mapped(h, plane) - image).ravel(),
        start,
        lambda h: _derivative(h, plane),
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    matrix = np.linalg.solve(from_px, np.append(fit.x, 1.0).reshape(3, 3) @ from_mm)
    residual = np.linalg.norm(fit.fun.reshape(-1, 2), axis=1) / from_px[0, 0]
    rms = float(np.sqrt(np.mean(residual**2)))
    return Homography(matrix / matrix[2, 2], rms, float(residual.max()))


def _mapped(h: Array, xy: Array) -> Array:
    """Images (n, 2) of points (n, 2) by the homography with elements `h` (8,), the last one 1."""
    return np.asarray((xy @ h[[[0, 3], [1, 4]]] + h[[2, 5]]) / (xy @ h[6:] + 1)[:, None])


def _derivative(h: Array, xy: Array) -> Array:
    """Derivative (2 n, 8) of `_mapped` by `h`."""
    image, terms = _mapped(h, xy), np.column_stack([xy, np.ones(len(xy))])
    rows = np.zeros((len(xy), 2, 8))
    rows[:, 0, :3], rows[:, 1, 3:6] = terms, terms
    rows[:, :, 6:] = -image[:, :, None] * xy[:, None, :]
    return (rows / (xy @ h[6:] + 1)[:, None, None]).reshape(-1, 8)


def _normalised(xy: Array) -> tuple[Array, Array]:
    """Points centred and scaled to a mean distance of √2, and the matrix (3, 3) that does it.

    Both axes have the same scale, so that least squares in these units is least squares in px.
    """
    centre = xy.mean(axis=0)
    scale = np.sqrt(2) / np.linalg.norm(xy - centre, axis=1).mean()
    matrix = np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])
    return (xy - centre) * scale, matrix
