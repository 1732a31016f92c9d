"""From one no-contact frame and the known print to the built sensor, or a refusal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration import checks
from gelslim_force.calibration.built_deviation import built_deviation
from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.design import bundle_camera, marker_heights_mm
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.fit import CameraFit, fit_camera
from gelslim_force.calibration.report import diagnosis_lines, warning_lines
from gelslim_force.calibration.residual_bump import ResidualField, split_residuals
from gelslim_force.calibration.sensor_calibration import Calibration, expected_dots
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import BORDER, Detections
from gelslim_force.lattice.bundle_grid import bundle_grid
from gelslim_force.lattice.growth import LatticeError
from gelslim_force.lattice.registration import Registration, register
from gelslim_optics.camera.back_projection import pixel_slopes
from gelslim_optics.camera.rays import points_along
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_TOUCHED_PITCHES = 4.5
"""Around a contact, dots within this are not fitted by."""


@single_threaded
def calibrate(
    bundle: Bundle,
    image: NDArray[np.uint8],
    *,
    detector: Detector | None = None,
    tolerance: CameraTolerance | None = None,
    allow_contact: bool = False,
) -> Calibration:
    """Find the built camera and every marker's place on the gel.

    Args:
        bundle: the sensor's design, with markers and camera.
        image: (h, w) or (h, w, 3) uint8, without contact.
        detector: finds the dots; by default set for the sizes that the design's camera sees.
        tolerance: of the built camera about its design.
        allow_contact: accept a place where neighbouring dots are off together, for prints that
            are warped there.

    Returns:
        The built camera, and every marker's position at rest.

    Raises:
        CalibrationError: no such sensor at rest is seen: another size of picture, too few dots,
            another print, a turned or mirrored picture, contact, a camera far out of tolerance.
        IfemError: the bundle has no markers or no camera.
    """
    grid, design = bundle_grid(bundle), bundle_camera(bundle)
    checks.require_size(image, design)
    detector = detector or Detector(expected_dots(design, grid))
    dots = detector.detect(image)
    expected = checks.markers_in_view(design, grid)
    checks.require_dots(dots, expected)
    registration = _registered(dots, grid, image, design)
    found = _whole(registration, dots)
    chosen = dots.take(registration.dots[found])
    points, diameter = grid.positions_mm[found], grid.diameter_mm[found]
    heights = marker_heights_mm(bundle)[found]
    flat = np.column_stack([points, heights])
    checks.require_upright(design.project(flat), chosen.centres_px)
    checks.require_print(registration, dots, expected)
    checks.require_anchors(chosen, design, grid, found)
    try:
        fit, rest, residuals = _fitted(design, flat, diameter, chosen, tolerance, grid.pitch_mm)
    except ValueError as error:
        raise CalibrationError(
            f"no camera within reason puts the print where the dots are: {error}; use the bundle "
            "of the sensor that took the picture"
        ) from error
    checks.require_fit(fit, grid.pitch_mm, registration.pitch_px)
    if not allow_contact:
        checks.require_no_contact(residuals)
    deviation = built_deviation(fit, rest, flat, residuals)
    in_view = checks.markers_in_view(fit.camera, grid)
    missing = np.setdiff1d(np.flatnonzero(in_view), found)
    aside = found[~fit.used]
    return Calibration(
        camera=fit.camera,
        grid=grid,
        markers=found,
        dots=chosen,
        residual_px=fit.residual_px,
        rest_mm=rest,
        detector=detector.settings,
        geometry_hash=bundle.geometry_hash,
        deviation=deviation,
        diagnosis=diagnosis_lines(deviation, grid, found, missing, aside, in_view),
        warnings=warning_lines(deviation, residuals, grid, missing, aside, in_view),
    )


def _whole(registration: Registration, dots: Detections) -> NDArray[np.int64]:
    """Ids of the markers found and not cut by the picture's edge."""
    found = np.flatnonzero(registration.found)
    cut = (dots.flags[registration.dots[found]] & BORDER) != 0
    return found[~cut]


def _fitted(
    design: VirtualCamera,
    points_mm: Array,
    diameter_mm: Array,
    dots: Detections,
    tolerance: CameraTolerance | None,
    pitch_mm: float,
) -> tuple[CameraFit, Array, ResidualField]:
    """Fit, places (n, 2) on the gel and their residuals; a touched place bends no camera.

    `points_mm` (n, 3) are the print on the gel at rest.
    """
    points, heights = points_mm[:, :2], points_mm[:, 2]
    clean = dots.trustworthy
    believed = clean
    for last in (False, True):
        fit = fit_camera(design, points, diameter_mm, dots.centres_px, tolerance, believed, heights)
        slopes = pixel_slopes(fit.camera, dots.centres_px - fit.offset_px)
        rest = points_along(fit.camera, slopes, heights)[:, :2]
        residuals = split_residuals(points[clean], (rest - points)[clean], pitch_mm)
        bump = checks.contact_of(residuals)
        if last or bump is None:
            break
        away = np.hypot(points[:, 0] - bump.x_mm, points[:, 1] - bump.y_mm)
        believed = clean & (away > _TOUCHED_PITCHES * pitch_mm)
        if believed.mean() < 0.5:
            break
    return fit, rest, residuals


def _registered(
    dots: Detections, grid: MarkerGrid, image: NDArray[np.uint8], design: VirtualCamera
) -> Registration:
    """Which dot is which, by the anchors alone where there are any: the picture may be turned."""
    camera = None if len(grid.anchor_sites) else design
    try:
        return register(dots, grid, image.shape, camera, pose_tolerance_pitch=0.8)
    except LatticeError as error:
        raise CalibrationError(
            f"the markers cannot be told apart: {error}. Is this the frame of another sensor?"
        ) from error
