"""From one reference picture and the known print to the built sensor, or a refusal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration import checks
from gelslim_force.calibration.built_deviation import built_deviation
from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.design import bundle_camera, bundle_grid, marker_heights_mm
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.fine_dots import fine_centres_px
from gelslim_force.calibration.fit import CameraFit, fit_camera
from gelslim_force.calibration.intrinsics import Intrinsics
from gelslim_force.calibration.report import diagnosis_lines, warning_lines
from gelslim_force.calibration.residual_bump import ResidualField, split_residuals
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import BORDER, Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.frames.read_only import read_only
from gelslim_force.frames.upright import upright
from gelslim_force.lattice.growth import LatticeError
from gelslim_force.lattice.registration import Registration, register
from ifem_export.operators.single_thread import single_threaded

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.markers.grid import MarkerGrid

Array = NDArray[np.float64]
_CONTACT_PITCHES = 4.5
"""Distance from a contact within which dots are left out of the fit."""


@single_threaded
def calibrate(
    bundle: Bundle,
    image: NDArray[np.uint8],
    *,
    tolerance: CameraTolerance | None = None,
    allow_contact: bool = False,
    intrinsics: Intrinsics | None = None,
) -> Calibration:
    """Find the built camera and the position of every marker on the gel.

    Args:
        bundle: The sensor's design, with markers and camera.
        image: (h, w) or (h, w, 3) uint8, without contact; of a camera in portrait also on its
            side, as the camera gives it.
        tolerance: Standard deviations of the built camera about its design; by default those of
            `intrinsics`, or of a lens known by its data sheet.
        allow_contact: Accept a region in which neighbouring dots are displaced together, for
            prints that are warped there.
        intrinsics: The lens as measured with this camera.

    Returns:
        The built camera, and every marker's position at rest.

    Raises:
        CalibrationError: The picture does not show this sensor at rest: another size, too few
            dots, another print, a turned or mirrored picture, contact, or a camera far out of
            tolerance. Or the intrinsics are not of this sensor's camera.
        IfemError: The bundle has no markers or no camera.
    """
    grid, design = bundle_grid(bundle), bundle_camera(bundle)
    expected_camera = design if intrinsics is None else intrinsics.camera(design)
    if tolerance is None and intrinsics is not None:
        tolerance = intrinsics.tolerance
    image = upright(image, design)
    checks.require_size(image, design)
    settings = expected_dots(design, grid)
    dots = Detector(settings).detect(image)
    expected = checks.markers_in_view(design, grid)
    checks.require_dots(dots, expected)
    registration = _registered(dots, grid, image, design)
    found = _uncut(registration, dots)
    chosen = dots.take(registration.dots[found])
    points, diameter = grid.positions_mm[found], grid.diameter_mm[found]
    heights = marker_heights_mm(bundle)[found]
    flat = np.column_stack([points, heights])
    checks.require_upright(design.project(flat), chosen.centres_px)
    checks.require_print(registration, dots, expected)
    checks.require_anchors(chosen, design, grid, found)
    fit, rest, residuals = _fitted(
        expected_camera,
        flat,
        diameter,
        fine_centres_px(image, chosen, settings),
        chosen.trustworthy,
        tolerance,
        grid.pitch_mm,
    )
    checks.require_fit(fit, grid.pitch_mm, registration.pitch_px)
    if not allow_contact:
        checks.require_no_contact(residuals)
    deviation = built_deviation(fit, design, rest, flat, residuals)
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
        detector=settings,
        geometry_hash=bundle.geometry_hash,
        deviation=deviation,
        diagnosis=diagnosis_lines(deviation, grid, found, missing, aside, in_view),
        warnings=warning_lines(deviation, residuals, grid, missing, aside, in_view),
        picture=read_only(image.copy()),
    )


def _uncut(registration: Registration, dots: Detections) -> NDArray[np.int64]:
    """Ids of the markers that are found and not cut by the picture's edge."""
    found = np.flatnonzero(registration.found)
    cut = (dots.flags[registration.dots[found]] & BORDER) != 0
    return found[~cut]


def _fitted(
    design: VirtualCamera,
    points_mm: Array,
    diameter_mm: Array,
    centres_px: Array,
    clean: NDArray[np.bool_],
    tolerance: CameraTolerance | None,
    pitch_mm: float,
) -> tuple[CameraFit, Array, ResidualField]:
    """The fit, the positions (n, 2) on the gel and their residuals.

    `points_mm` (n, 3) is the print on the gel at rest, `clean` (n,) are the dots to fit by. Where
    the first fit finds a contact, the second one leaves out the dots near it, so that the contact
    does not distort the camera. Raises CalibrationError where no camera explains the dots.
    """
    points, heights = points_mm[:, :2], points_mm[:, 2]
    used = clean
    for last in (False, True):
        try:
            fit = fit_camera(design, points, diameter_mm, centres_px, tolerance, used, heights)
            slopes = fit.camera.pixel_slopes(centres_px - fit.offset_px)
            rest = fit.camera.points_along(slopes, heights)[:, :2]
            residuals = split_residuals(points[clean], (rest - points)[clean], pitch_mm)
        except ValueError as error:
            raise CalibrationError(
                "fit",
                f"no plausible camera puts the print where the dots are: {error}; use the bundle "
                "of the sensor that took the picture",
            ) from error
        bump = checks.contact_of(residuals)
        if last or bump is None:
            break
        away = np.hypot(points[:, 0] - bump.x_mm, points[:, 1] - bump.y_mm)
        used = clean & (away > _CONTACT_PITCHES * pitch_mm)
        if used.mean() < 0.5:
            break
    return fit, rest, residuals


def _registered(
    dots: Detections, grid: MarkerGrid, image: NDArray[np.uint8], design: VirtualCamera
) -> Registration:
    """Assign dots to markers; by the anchors alone where there are any, as the picture may be
    turned."""
    camera = None if len(grid.anchor_sites) else design
    try:
        return register(dots, grid, image.shape, camera, pose_tolerance_pitch=0.8)
    except LatticeError as error:
        raise CalibrationError(
            "lattice",
            f"the markers cannot be identified: {error}. Is this a picture of another sensor?",
        ) from error


def expected_dots(camera: VirtualCamera, grid: MarkerGrid) -> DetectorSettings:
    """Return a detector's settings for the sizes at which the camera sees the print."""
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    stretch = np.linalg.svd(camera.jacobian(flat), compute_uv=False)
    return DetectorSettings.for_diameters((stretch * grid.diameter_mm[:, None]).ravel())
