"""The built camera from the dots of one reference picture: least squares with tolerances as prior.

The fit minimises the sum of squares of two kinds of terms: the distance of each dot from where the
camera should see it, over the noise, and each deviation from the design, over its tolerance. This
is the most probable camera for normally distributed deviations. One picture of a plane cannot
determine all of them (a longer lens looks like a nearer gel). The tolerances decide these, and
`CameraFit.weak_directions` lists them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from gelslim_force.calibration.camera_deviation import PARAMETERS, CameraTolerance, deviated_camera
from gelslim_force.motion.printed_dots import disc_rims_mm, rim_centroids
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_FIRST_NOISE_PX = 0.5
_LEAST_NOISE_PX = 2e-3
_LOSS_SCALE = 2.0
_OUTLIER_SIGMAS = 4.5
_STEP = 1e-4
_BOUND = 12.0
_ROUNDS = 3
_LEAST_DOTS = 12


@dataclass(frozen=True, eq=False)
class CameraFit:
    """A fitted camera with the residuals of the dots and the uncertainty of each deviation."""

    design: VirtualCamera
    camera: VirtualCamera
    values: Array
    """(13,) deviations, see `PARAMETERS`."""
    covariance: Array
    """(13, 13) of the values, prior included."""
    information: Array
    """(13, 13) inverse covariance from the picture alone, without the prior."""
    tolerance: Array
    """(13,) prior standard deviations."""
    offset_px: Array
    """(n, 2) centroid of each dot's image minus image of the dot's centre."""
    residual_px: Array
    """(n, 2) seen minus expected centroid."""
    used: NDArray[np.bool_]
    """(n,) dots that were used; the others are too far from the fit."""
    noise_px: float
    """Standard deviation of a used dot along one axis: detection and print."""

    @cached_property
    def sigma(self) -> Array:
        """(13,) standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def weak_directions(self) -> list[tuple[float, Array]]:
        """Combinations of deviations that the tolerances determine better than the picture does.

        Each has the share of the prior variance that remains (1/2 ... 1), and its direction (13,),
        a unit vector in units of the tolerances. The least determined one is first.
        """
        scaled = self.information * np.outer(self.tolerance, self.tolerance)
        strength, vectors = np.linalg.eigh((scaled + scaled.T) / 2)
        weak = [(float(1 / (1 + max(s, 0.0))), v) for s, v in zip(strength, vectors.T, strict=True)]
        return [(left, _signed(v)) for left, v in weak if left > 0.5]


def fit_camera(
    design: VirtualCamera,
    points_mm: ArrayLike,
    diameter_mm: ArrayLike,
    centres_px: ArrayLike,
    tolerance: CameraTolerance | None = None,
    trusted: ArrayLike | None = None,
    heights_mm: ArrayLike = 0.0,
) -> CameraFit:
    """Fit the camera to n dots.

    Args:
        design: Where the fit starts.
        points_mm: (n, 2) positions of the dots on the rest plane.
        diameter_mm: (n,) diameters of the dots.
        centres_px: (n, 2) centroids seen.
        tolerance: Standard deviations of the built camera about its design.
        trusted: (n,) dots that may be used; the others only get residuals.
        heights_mm: Scalar or (n,) heights of the gel at the dots.

    Two rounds with a robust loss find the noise and the outliers; the last round is ordinary least
    squares over the other dots. Raises ValueError for shapes that do not fit one another, values
    that are not finite, or fewer than 12 dots.
    """
    points, seen = np.asarray(points_mm, dtype=float), np.asarray(centres_px, dtype=float)
    diameter = np.asarray(diameter_mm, dtype=float)
    if points.shape != seen.shape or points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points {points.shape} and centres {seen.shape}: both must be (n, 2)")
    if len(points) < _LEAST_DOTS or not np.isfinite([points, seen]).all():
        raise ValueError(f"{len(points)} dots: a camera needs at least {_LEAST_DOTS}, all finite")
    heights = np.broadcast_to(np.asarray(heights_mm, dtype=float), len(points))
    solid = np.column_stack([points, heights])
    problem = _Problem(design, solid, (tolerance or CameraTolerance()).sigma(design))
    usable = np.ones(len(points), dtype=bool) if trusted is None else np.array(trusted, bool)
    if usable.sum() < _LEAST_DOTS:
        raise ValueError(f"{int(usable.sum())} dots to fit by: at least {_LEAST_DOTS} are needed")
    unit = np.zeros(len(PARAMETERS))
    used, noise = usable, _FIRST_NOISE_PX
    for number in range(_ROUNDS):
        camera = problem.camera(unit)
        offset = centroid_offset_px(camera, points, diameter)
        last = number == _ROUNDS - 1
        unit = problem.solved(unit, seen - offset, used, noise, robust=not last)
        residual = seen - offset - problem.image(unit)
        if not last:
            noise = max(1.4826 * float(np.median(np.abs(residual[usable]))), _LEAST_NOISE_PX)
            used = usable & (np.hypot(*residual.T) <= _OUTLIER_SIGMAS * noise)
            used = used if used.sum() >= _LEAST_DOTS else usable
    return _with_uncertainty(problem, unit, offset, residual, used, noise)


@dataclass(frozen=True, eq=False)
class _Problem:
    """The least-squares problem: dots (n, 3) at rest, and a camera in units of its tolerances."""

    design: VirtualCamera
    points_mm: Array
    tolerance: Array

    def camera(self, unit: Array) -> VirtualCamera:
        return deviated_camera(self.design, unit * self.tolerance)

    def image(self, unit: Array) -> Array:
        return self.camera(unit).project(self.points_mm)

    def jacobian(self, unit: Array) -> Array:
        """(2 n, 13) of the image by central differences."""
        columns = []
        for k in range(len(unit)):
            step = np.zeros(len(unit))
            step[k] = _STEP
            columns.append((self.image(unit + step) - self.image(unit - step)) / (2 * _STEP))
        return np.stack(columns, axis=-1).reshape(-1, len(unit))

    def solved(
        self, unit: Array, target: Array, used: NDArray[np.bool_], noise: float, robust: bool
    ) -> Array:
        rows = np.repeat(used, 2)
        count = int(rows.sum())

        def misfit(u: Array) -> Array:
            try:
                left = (self.image(u) - target).ravel()[rows] / noise
            except ValueError:
                # Outside the distortion's domain the residuals are made huge: the step shrinks.
                left = np.full(count, 1e6)
            return np.concatenate([left, u])

        def slopes(u: Array) -> Array:
            return np.vstack([self.jacobian(u)[rows] / noise, np.eye(len(u))])

        def softened(z: Array) -> Array:
            """Pseudo-Huber loss for the dots; the prior stays quadratic."""
            rho = np.vstack([z, np.ones_like(z), np.zeros_like(z)])
            t = 1 + z[:count] / _LOSS_SCALE**2
            rho[:, :count] = [
                2 * _LOSS_SCALE**2 * (np.sqrt(t) - 1),
                1 / np.sqrt(t),
                -0.5 / _LOSS_SCALE**2 * t**-1.5,
            ]
            return rho

        found = least_squares(
            misfit,
            np.clip(unit, -0.99 * _BOUND, 0.99 * _BOUND),
            jac=slopes,
            bounds=(-_BOUND, _BOUND),
            loss=softened if robust else "linear",
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-8,
            max_nfev=60,
        )
        return np.asarray(found.x)


def _with_uncertainty(
    problem: _Problem,
    unit: Array,
    offset: Array,
    residual: Array,
    used: NDArray[np.bool_],
    noise: float,
) -> CameraFit:
    slopes = problem.jacobian(unit)[np.repeat(used, 2)]
    squared = slopes.T @ slopes
    data = squared / noise**2
    effective = float(np.trace(np.linalg.solve(data + np.eye(len(unit)), data)))
    freedom = max(2 * int(used.sum()) - effective, 1.0)
    noise = max(float(np.sqrt((residual[used] ** 2).sum() / freedom)), _LEAST_NOISE_PX)
    scale = np.outer(problem.tolerance, problem.tolerance)
    data = squared / noise**2
    return CameraFit(
        design=problem.design,
        camera=problem.camera(unit),
        values=unit * problem.tolerance,
        covariance=np.linalg.inv(data + np.eye(len(unit))) * scale,
        information=data / scale,
        tolerance=problem.tolerance,
        offset_px=offset,
        residual_px=residual,
        used=used,
        noise_px=noise,
    )


def _signed(vector: Array) -> Array:
    """The direction whose largest part is positive."""
    return vector if vector[np.argmax(np.abs(vector))] > 0 else -vector


def centroid_offset_px(
    camera: VirtualCamera, centres_mm: ArrayLike, diameter_mm: ArrayLike
) -> NDArray[np.float64]:
    """Return the centroid of each disc's image minus the image of its centre, (n, 2) in px.

    Perspective and refraction shrink the far half of a disc more than the near half. The
    difference is proportional to the square of the diameter: about 0.01 px for a dot of 0.5 mm at
    20 px/mm, and alike for all dots.

    Args:
        camera: The camera.
        centres_mm: (n, 2) in the plane z = 0 of the undeformed surface.
        diameter_mm: (n,), or one for all discs.

    Raises:
        ValueError: An array has another shape, or a point has no image.
    """
    rims = disc_rims_mm(centres_mm, diameter_mm)
    count, around, _ = rims.shape
    points = np.zeros((count, around + 1, 3))
    points[:, 0, :2], points[:, 1:, :2] = centres_mm, rims
    image = camera.project(points.reshape(-1, 3)).reshape(count, around + 1, 2)
    return rim_centroids(image[:, 1:]) - image[:, 0]
