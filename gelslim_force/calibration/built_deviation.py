"""Deviation of a built sensor from its design, in numbers."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.camera_deviation import CameraTolerance, deviated_camera
from gelslim_force.calibration.residual_bump import ResidualField
from gelslim_optics.camera.lens_distortion import LensDistortion

if TYPE_CHECKING:
    from gelslim_force.calibration.fit import CameraFit
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class BuiltDeviation:
    """The fitted deviations, and their effects on the gel and in the picture."""

    values: Array
    """(13,) in the order and units of `camera_deviation.PARAMETERS`."""
    sigma: Array
    """(13,) their standard deviations."""
    tolerance: Array
    """(13,) standard deviations that are expected of a built sensor."""
    weak: tuple[tuple[float, Array], ...]
    """See `CameraFit.weak_directions`."""
    rotation_deg: float
    """Angle of the whole rotation."""
    shift_mm: float
    """Length of the pinhole's shift."""
    scale_percent: float
    """Change of the picture's mean scale (px per mm) over the print."""
    distortion_px: float
    """Largest shift of a dot in the picture by the change of the distortion alone."""
    moved_px: float
    """Median distance of the dots from where the designed camera would see them."""
    map_sigma_mm: float
    """Root mean square uncertainty of positions on the gel, per axis, from the camera's fit."""
    lean_sigma_mm_per_mm: float
    """Root mean square uncertainty of the apparent lateral motion per mm of depth."""
    noise_px: float
    """Standard deviation of one dot along one axis: detection and print."""
    own_mm: float
    """The same on the gel in mm, relative to the neighbours."""
    shared_mm: float
    """Root mean square of the displacement that neighbouring dots have in common."""


def built_deviation(
    fit: CameraFit,
    design: VirtualCamera,
    rest_mm: Array,
    points_mm: Array,
    residuals: ResidualField,
) -> BuiltDeviation:
    """Derive the numbers from a fit, which may have started from a measured lens.

    `rest_mm` (n, 2) are the positions of the dots as seen, `points_mm` (n, 3) those in the print.
    """
    built = fit.camera
    was, now = (np.sqrt(np.abs(np.linalg.det(c.jacobian(points_mm)))) for c in (design, built))
    position_sigma, apparent_sigma = _uncertainty(fit, points_mm)
    seen = built.project(np.column_stack([rest_mm, points_mm[:, 2]]))
    moved = seen - design.project(points_mm)
    return BuiltDeviation(
        values=np.append(fit.values[:6], _lens_deviation(design, built)),
        sigma=fit.sigma,
        tolerance=fit.tolerance if design is fit.design else CameraTolerance().sigma(design),
        weak=tuple(fit.weak_directions),
        rotation_deg=float(np.linalg.norm(fit.values[:3])),
        shift_mm=float(np.linalg.norm(fit.values[3:6])),
        scale_percent=float(100 * (np.mean(now) / np.mean(was) - 1)),
        distortion_px=_distortion_px(design, built, points_mm),
        moved_px=float(np.median(np.hypot(*moved.T))),
        map_sigma_mm=position_sigma,
        lean_sigma_mm_per_mm=apparent_sigma,
        noise_px=fit.noise_px,
        own_mm=residuals.own_mm,
        shared_mm=residuals.shared_mm,
    )


def apparent_motion_per_mm(camera: VirtualCamera, flat_mm: Array) -> Array:
    """(n, 2) apparent lateral motion, in mm, of points that move by 1 mm along z."""
    motion = camera.jacobian_3d(flat_mm)
    return np.asarray(np.linalg.solve(motion[:, :, :2], motion[:, :, 2:])[:, :, 0], dtype=float)


def _uncertainty(fit: CameraFit, flat: Array) -> tuple[float, float]:
    """Root mean square standard deviations of positions on the gel and of the apparent motion."""
    to_gel = np.linalg.inv(fit.camera.jacobian(flat))
    position_slopes, apparent_slopes = [], []
    for k, unit in enumerate(fit.tolerance):
        step = np.zeros(len(fit.tolerance))
        step[k] = _STEP * unit
        low, high = (deviated_camera(fit.design, fit.values + s * step) for s in (-1, 1))
        moved = (high.project(flat) - low.project(flat)) / (2 * step[k])
        position_slopes.append((to_gel @ moved[:, :, None])[:, :, 0])
        apparent_slopes.append(
            (apparent_motion_per_mm(high, flat) - apparent_motion_per_mm(low, flat)) / (2 * step[k])
        )
    return (
        _spread(np.stack(position_slopes, axis=-1), fit.covariance),
        _spread(np.stack(apparent_slopes, axis=-1), fit.covariance),
    )


def _spread(slopes: Array, covariance: Array) -> float:
    flat = slopes.reshape(-1, slopes.shape[-1])
    return float(np.sqrt(np.einsum("ki,ij,kj->k", flat, covariance, flat).mean()))


def _lens_deviation(design: VirtualCamera, built: VirtualCamera) -> Array:
    """(7,) deviations of focal length, distortion and principal point, see `PARAMETERS`.

    Coefficients of two models of distortion cannot be compared: those of the built lens are
    returned then.
    """
    was, now = (c.lens or LensDistortion() for c in (design, built))
    was = was if was.fisheye == now.fisheye else LensDistortion()
    coefficients = [getattr(now, k) - getattr(was, k) for k in ("k1", "k2", "p1", "p2")]
    moved = np.subtract(built.principal_offset_px, design.principal_offset_px)
    return np.array([100 * (built.focal_px / design.focal_px - 1), *coefficients, *moved])


def _distortion_px(design: VirtualCamera, built: VirtualCamera, flat: Array) -> float:
    """Largest shift of a dot if the built lens replaces the designed one."""
    straight = dataclasses.replace(built, lens=None)
    rays = (straight.project(flat) - straight.principal_px) / straight.focal_px
    was, now = ((c.lens or LensDistortion()).distort(rays) for c in (design, built))
    return float(built.focal_px * np.hypot(*(now - was).T).max())
