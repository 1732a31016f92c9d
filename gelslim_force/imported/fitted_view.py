"""The camera of an imported sensor, fitted to the lattice of its dots."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.built_deviation import (
    BuiltDeviation,
    apparent_motion_per_mm,
    built_deviation,
)
from gelslim_force.calibration.camera_deviation import PARAMETERS
from gelslim_force.calibration.checks import MOST_RESIDUAL_PITCH
from gelslim_force.calibration.fit import CameraFit, fit_camera
from gelslim_force.calibration.residual_bump import ResidualField, split_residuals
from gelslim_force.detection.detections import BORDER, Detections
from gelslim_force.imported.description import PointPair, SensorDescription
from gelslim_force.imported.error import ImportSensorError
from gelslim_force.imported.first_view import FirstView
from gelslim_force.imported.marker_lattice import Sites, lattice_shape, moved_frame
from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.lattice_frame import LatticeFrame

Array = NDArray[np.float64]
_FOCAL = PARAMETERS.index("focal_percent")
_ROUNDS_BY_POINTS = 3
_LEAST_DOTS = 20
_USUAL_WINDOW = Layer(3.0, 1.5)
"""Plate between camera and gel that counts as possible where none is given."""


@dataclass(frozen=True, eq=False)
class FittedView:
    """The fitted camera and the n dots that are seen whole.

    Attributes:
        fit: The camera.
        number: (n,) number of each dot in the reference lattice.
        sites: (n, 2) its row and column.
        frame: Lattice of all sites of the reference on the gel, with `shape`.
        shape: Rows and columns of that lattice.
        rest_mm: (n, 2) place of each dot as seen.
        diameter_mm: Median diameter of the dots.
        residuals: What remains of the lattice's fit, on the gel.
        points_px: Root mean square distance of the given points from their images; NaN without.
        window_lean: What an unknown plate changes of the apparent lateral motion of markers per mm
            of depth, root mean square; 0 where the plates are given.
    """

    fit: CameraFit
    number: NDArray[np.int64]
    sites: Sites
    frame: LatticeFrame
    shape: tuple[int, int]
    rest_mm: Array
    diameter_mm: float
    residuals: ResidualField
    points_px: float
    window_lean: float = 0.0

    @property
    def camera(self) -> VirtualCamera:
        """The fitted camera."""
        return self.fit.camera

    @property
    def places_mm(self) -> Array:
        """(n, 2) place of each dot by the lattice."""
        return self.frame.places_mm(self.sites, self.shape)

    def deviation(self) -> BuiltDeviation:
        """Uncertainty of the camera; it is its own design, from which it does not deviate."""
        flat = np.column_stack([self.places_mm, np.zeros(len(self.sites))])
        told = built_deviation(self.fit, self.fit.design, self.rest_mm, flat, self.residuals)
        return dataclasses.replace(
            told,
            values=np.zeros_like(told.values),
            rotation_deg=0.0,
            shift_mm=0.0,
            scale_percent=0.0,
            moved_px=0.0,
            lean_sigma_mm_per_mm=float(np.hypot(told.lean_sigma_mm_per_mm, self.window_lean)),
        )


def fitted_view(
    asked: SensorDescription, first: FirstView, dots: Detections, centres_px: Array
) -> FittedView:
    """Fit the camera.

    Args:
        asked: The description.
        first: Where the fit starts.
        dots: Dots of the reference lattice, in its order.
        centres_px: Their centres, measured for the fit.

    Returns:
        The camera, and the dots that the picture's edge does not cut.

    Raises:
        ImportSensorError: Too few dots are whole, or no camera shows a plane lattice so.
    """
    whole = np.flatnonzero((dots.flags & BORDER) == 0)
    if len(whole) < _LEAST_DOTS:
        raise ImportSensorError(
            "view.reference",
            f"{len(whole)} dots are seen whole, at least {_LEAST_DOTS} are needed: check light and "
            "focus",
        )
    seen, trusted = centres_px[whole], dots.trustworthy[whole]
    sites, shape, frame = first.sites[whole], lattice_shape(first.sites), first.frame
    points = asked.view.points
    off = float("nan")
    for _ in range(1 if points is None else _ROUNDS_BY_POINTS):
        diameter = _diameter_mm(first.camera, frame.places_mm(sites, shape), dots.area_px[whole])
        try:
            places = frame.places_mm(sites, shape)
            sizes = np.full(len(places), diameter)
            fit = fit_camera(first.camera, places, sizes, seen, first.tolerance, trusted)
            if points is not None:
                frame, off = _through_points(fit.camera, frame, points)
        except ValueError as error:
            raise ImportSensorError(
                "view", f"no camera shows a plane lattice so: {error}; check view and lens"
            ) from error
    _require_plane(fit, frame, seen)
    fit = _with_focal_sigma(fit, first.focal_sigma_percent)
    if points is None and asked.view.homography is None and asked.view.pinhole is None:
        fit, frame = _placed(asked, fit, frame)
    places = frame.places_mm(sites, shape)
    slopes = fit.camera.pixel_slopes(seen - fit.offset_px)
    rest = fit.camera.points_along(slopes, np.zeros(len(seen)))[:, :2]
    pitch = float(np.mean(frame.pitches_mm))
    residuals = split_residuals(places[fit.used], (rest - places)[fit.used], pitch)
    lean = 0.0 if asked.windows else _window_lean(fit, first, places, diameter, seen)
    return FittedView(fit, whole, sites, frame, shape, rest, diameter, residuals, off, lean)


def _window_lean(
    fit: CameraFit, first: FirstView, places_mm: Array, diameter_mm: float, seen_px: Array
) -> float:
    """What a plate that is not given changes of the apparent motion per mm of depth.

    The camera is fitted again behind a usual plate; where that fails nothing is added.
    """
    camera, plate = fit.camera, _USUAL_WINDOW
    nearer = plate.thickness_mm * (1 - 1 / plate.index)
    behind = dataclasses.replace(
        camera,
        layers=(plate, *camera.layers),
        window_bottom_z_mm=camera.window_bottom_z_mm - plate.thickness_mm,
        position_mm=camera.position_mm - np.array([0.0, 0.0, nearer]),
    )
    flat = np.column_stack([places_mm, np.zeros(len(places_mm))])
    sizes = np.full(len(places_mm), diameter_mm)
    try:
        other = fit_camera(behind, places_mm, sizes, seen_px, first.tolerance, fit.used)
        change = apparent_motion_per_mm(other.camera, flat) - apparent_motion_per_mm(camera, flat)
    except ValueError:
        return 0.0
    return float(np.sqrt(np.mean(change**2)))


def _diameter_mm(camera: VirtualCamera, places_mm: Array, area_px: Array) -> float:
    """Median diameter of dots with these areas (k,) at these places (k, 2)."""
    flat = np.column_stack([places_mm, np.zeros(len(places_mm))])
    scale = np.abs(np.linalg.det(camera.jacobian(flat)))
    return float(np.median(np.sqrt(4 * area_px / np.pi / scale)))


def _through_points(
    camera: VirtualCamera, frame: LatticeFrame, points: tuple[PointPair, ...]
) -> tuple[LatticeFrame, float]:
    """The lattice moved, turned and scaled so that the camera sees the points where they are.

    Returns also their root mean square distance in the picture. A similarity by least squares
    (S. Umeyama, IEEE TPAMI 13, 1991) has no skew, which four points by hand would give.
    """
    gel = np.array([point.gel_mm for point in points])
    picture = np.array([point.picture_px for point in points])
    seen = camera.backproject(picture)[:, :2]
    apart, target = seen - seen.mean(axis=0), gel - gel.mean(axis=0)
    left, size, right = np.linalg.svd(target.T @ apart)
    flip = np.diag([1.0, np.linalg.det(left @ right)])
    turn = left @ flip @ right * (np.trace(np.diag(size) @ flip) / (apart**2).sum())
    moved = LatticeFrame(
        turn @ frame.row_step_mm,
        turn @ frame.column_step_mm,
        turn @ (frame.middle_mm - seen.mean(axis=0)) + gel.mean(axis=0),
    )
    left_mm = gel - ((apart @ turn.T) + gel.mean(axis=0))
    flat = np.column_stack([seen, np.zeros(len(seen))])
    left_px = np.einsum("kij,kj->ki", camera.jacobian(flat), left_mm)
    return moved, float(np.sqrt((left_px**2).sum(axis=1).mean()))


def _placed(
    asked: SensorDescription, fit: CameraFit, frame: LatticeFrame
) -> tuple[CameraFit, LatticeFrame]:
    """Fit and lattice with the gel's middle at the origin. Flat layers look alike everywhere."""
    middle = asked.view.gel_middle_px
    if middle is None:
        return fit, frame
    shift = -fit.camera.backproject(np.array([middle]))[0, :2]
    cameras = {
        name: dataclasses.replace(
            getattr(fit, name),
            position_mm=getattr(fit, name).position_mm + np.array([*shift, 0.0]),
        )
        for name in ("design", "camera")
    }
    return dataclasses.replace(fit, **cameras), moved_frame(frame, shift)


def _with_focal_sigma(fit: CameraFit, sigma_percent: float) -> CameraFit:
    """The fit with at least this standard deviation of the focal length.

    The other deviations follow the focal length so that the dots stay where they are seen: for a
    precision matrix P they change by -P_oo⁻¹ P_of for each percent, and vary by P_oo⁻¹ about that.
    """
    if not fit.sigma[_FOCAL] < sigma_percent:
        return fit
    precision = np.linalg.inv(fit.covariance)
    others = np.delete(np.arange(len(precision)), _FOCAL)
    about = np.linalg.inv(precision[np.ix_(others, others)])
    follow = np.zeros(len(precision))
    follow[_FOCAL] = 1.0
    follow[others] = -about @ precision[others, _FOCAL]
    covariance = sigma_percent**2 * np.outer(follow, follow)
    covariance[np.ix_(others, others)] += about
    return dataclasses.replace(fit, covariance=covariance)


def _require_plane(fit: CameraFit, frame: LatticeFrame, seen_px: Array) -> None:
    """Refuse dots that lie on no plane lattice, as those of a bent gel do."""
    off = float(np.sqrt(np.median((fit.residual_px**2).sum(axis=1))))
    span_mm = float(np.mean(frame.pitches_mm))
    flat = np.zeros((1, 3))
    pitch_px = span_mm * float(np.sqrt(np.abs(np.linalg.det(fit.camera.jacobian(flat)[0]))))
    if off > MOST_RESIDUAL_PITCH * pitch_px:
        raise ImportSensorError(
            "view",
            f"half of the {len(seen_px)} dots are {off:.1f} px or more from a plane lattice of "
            f"{pitch_px:.0f} px: the gel is bent, something touches it, the dots are of no "
            "lattice, or markers.pitch_mm and pitch_across_mm are not as 1 to 1",
        )
