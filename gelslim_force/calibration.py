"""From one no-contact frame and the known print to the built sensor, or a refusal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force import calibration_checks as checks
from gelslim_force.built_deviation import built_deviation
from gelslim_force.bundle_camera import bundle_camera
from gelslim_force.bundle_grid import bundle_grid
from gelslim_force.calibration_error import CalibrationError
from gelslim_force.calibration_fit import fit_camera
from gelslim_force.calibration_report import diagnosis_lines, warning_lines
from gelslim_force.camera_deviation import CameraTolerance
from gelslim_force.detection import Detector
from gelslim_force.lattice_growth import LatticeError
from gelslim_force.lattice_registration import Registration, register
from gelslim_force.residual_bump import split_residuals
from gelslim_force.sensor_calibration import SensorCalibration, expected_dots

if TYPE_CHECKING:
    from gelslim_force.detections import Detections
    from gelslim_optics.virtual_camera import VirtualCamera
    from ifem_export.bundle import Bundle
    from ifem_export.marker_grid import MarkerGrid


def calibrate(
    bundle: Bundle,
    image: NDArray[np.uint8],
    *,
    detector: Detector | None = None,
    tolerance: CameraTolerance | None = None,
    allow_contact: bool = False,
) -> SensorCalibration:
    """Find the built camera and every marker's place on the gel.

    Args:
        bundle: the sensor's design, with markers and camera.
        image: (h, w) or (h, w, 3) uint8, without contact.
        detector: finds the dots; by default set for the sizes that the design's camera sees.
        tolerance: of the built camera about its design.
        allow_contact: accept a place where neighbouring dots are off together, for prints that
            are warped there.

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
    found = np.flatnonzero(registration.found)
    chosen = dots.take(registration.dots[found])
    points, diameter = grid.positions_mm[found], grid.diameter_mm[found]
    flat = np.column_stack([points, np.zeros(len(points))])
    checks.require_upright(design.project(flat), chosen.centres_px)
    checks.require_print(registration, dots, expected)
    checks.require_anchors(chosen, design, grid, found)
    fit = fit_camera(design, points, diameter, chosen.centres_px, tolerance)
    rest = fit.camera.backproject(chosen.centres_px - fit.offset_px)[:, :2]
    residuals = split_residuals(points, rest - points, grid.pitch_mm)
    if not allow_contact:
        checks.require_no_contact(residuals)
    checks.require_fit(fit, grid.pitch_mm, registration.pitch_px)
    deviation = built_deviation(fit, rest, points, residuals)
    missing = np.setdiff1d(np.flatnonzero(expected), found)
    aside = found[~fit.used]
    return SensorCalibration(
        camera=fit.camera,
        grid=grid,
        markers=found,
        dots=chosen,
        residual_px=fit.residual_px,
        rest_mm=rest,
        detector=detector.settings,
        geometry_hash=bundle.geometry_hash,
        deviation=deviation,
        diagnosis=diagnosis_lines(deviation, grid, found, missing, aside),
        warnings=warning_lines(deviation, residuals, grid, expected, missing, aside),
    )


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
