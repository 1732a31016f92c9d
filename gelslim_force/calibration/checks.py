"""What a reference picture must show before a calibration is trusted.

Every check raises a CalibrationError that says what is wrong. The limits are wide: they reject
other sensors, turned pictures and contact, not poor builds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.calibration.camera_deviation import PARAMETERS
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.detection.detection import as_planes
from gelslim_force.lattice.picture_turn import picture_turn
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

if TYPE_CHECKING:
    from gelslim_force.calibration.fit import CameraFit
    from gelslim_force.calibration.residual_bump import ResidualBump, ResidualField
    from gelslim_force.detection.detections import Detections
    from gelslim_force.lattice.registration import Registration

LEAST_SEEN = 0.6
"""Smallest share of the markers in view that must be found."""
LEAST_MARKERS = 20
MOST_FOREIGN = 0.2
"""Largest number of dots that are no markers, over the number of those that are."""
MOST_SIGMAS = 5.0
"""Largest deviation from the design, over its tolerance."""
MOST_RESIDUAL_PITCH = 0.1
LEAST_USED = 0.7
CONTACT_MM = 0.03
"""Common displacement of neighbouring dots that counts as contact, if it is local and larger than
the noise."""
_ANCHOR_STEP = 0.5


def require_size(image: NDArray[np.uint8], camera: VirtualCamera) -> None:
    """Reject what is not a picture of the camera's size. Raises CalibrationError."""
    try:
        height, width = as_planes(image).shape[:2]
    except ValueError as error:
        raise CalibrationError("size", f"the reference cannot be used: {error}") from error
    wide, high = camera.image_width_px, camera.image_height_px
    if (width, height) == (wide, high):
        return
    remedy = "give the camera's full, unscaled picture"
    if (width, height) == (high, wide):
        remedy = "the picture lies on its side: turn it back"
    raise CalibrationError(
        "size",
        f"the reference is {width} x {height} px, this sensor's camera takes {wide} x {high} px: "
        f"{remedy}, or use the bundle of the sensor that took it",
    )


def markers_in_view(camera: VirtualCamera, grid: MarkerGrid) -> NDArray[np.bool_]:
    """Which markers (m,) the camera sees without a cut by the picture's edge."""
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    positions = camera.project(flat)
    stretch = np.linalg.norm(camera.jacobian(flat), 2, axis=(1, 2))
    rim = (stretch * grid.diameter_mm / 2)[:, None]
    size = np.array([camera.image_width_px, camera.image_height_px])
    inside: NDArray[np.bool_] = np.all((positions >= rim) & (positions <= size - 1 - rim), axis=1)
    return inside


def require_dots(dots: Detections, expected: NDArray[np.bool_]) -> None:
    """Reject a picture with too few dots to be the print. Raises CalibrationError."""
    least = max(LEAST_MARKERS, int(np.ceil(LEAST_SEEN * expected.sum())))
    if len(dots) < least:
        raise CalibrationError(
            "dots",
            f"{len(dots)} dots are seen, the print has {int(expected.sum())} in view and at least "
            f"{least} are needed: check light, focus and exposure, or use the bundle of the "
            "sensor that took the picture",
        )


def require_upright(expected_px: ArrayLike, seen_px: ArrayLike) -> None:
    """Reject a turned or mirrored picture. Raises CalibrationError."""
    turn = picture_turn(expected_px, seen_px)
    if turn:
        raise CalibrationError(
            "orientation",
            f"the picture is {turn} relative to what the design's camera takes: undo that in the "
            "camera's settings or in the file, for frames and reference alike",
        )


def require_print(
    registration: Registration, dots: Detections, expected: NDArray[np.bool_]
) -> None:
    """Reject the lattice of another print: too few of this print's dots, or too many others.

    Raises:
        CalibrationError: The picture shows another print, or too little of this one.
    """
    found = int(registration.found.sum())
    least = max(LEAST_MARKERS, int(np.ceil(LEAST_SEEN * expected.sum())))
    if found < least:
        raise CalibrationError(
            "print",
            f"{found} markers are found of {int(expected.sum())} in view, at least {least} are "
            "needed: clean the gel and light all of it, or use the bundle of the sensor that took "
            "the picture",
        )
    others = dots.take(registration.spurious)
    foreign = int(others.trustworthy.sum())
    if foreign > max(MOST_FOREIGN * found, 5):
        raise CalibrationError(
            "print",
            f"{foreign} clean dots are on no site of this print, and {found} are on one: the "
            "picture shows another print; use the bundle of the sensor that took it",
        )


def require_anchors(
    dots: Detections, camera: VirtualCamera, grid: MarkerGrid, found: NDArray[np.int64]
) -> None:
    """Reject a print whose large dots are elsewhere. Raises CalibrationError."""
    flat = np.column_stack([grid.positions_mm[found], np.zeros(len(found))])
    area_px_per_mm2 = np.abs(np.linalg.det(camera.jacobian(flat)))
    large = grid.kind[found] == ANCHOR_LARGE
    if not large.any() or large.all():
        return
    size = np.log(dots.area_px / area_px_per_mm2)
    usual = float(np.median(size[~large]))
    rise = 2 * np.log(
        np.median(grid.diameter_mm[found][large]) / np.median(grid.diameter_mm[found][~large])
    )
    small_anchors = int((size[large] < usual + _ANCHOR_STEP * rise).sum())
    if small_anchors > max(1, large.sum() // 3):
        raise CalibrationError(
            "anchors",
            f"{small_anchors} of {int(large.sum())} anchors of this print are ordinary dots in the "
            "picture: it shows another print; use the bundle of the sensor that took it",
        )


def contact_of(residuals: ResidualField) -> ResidualBump | None:
    """Return the bump if it looks like contact."""
    bump = residuals.bump
    if bump is None or not bump.local or bump.shift_mm < CONTACT_MM:
        return None
    return bump


def require_no_contact(residuals: ResidualField) -> None:
    """Reject a picture in which neighbouring dots move together. Raises CalibrationError."""
    bump = contact_of(residuals)
    if bump is not None:
        raise CalibrationError(
            "contact",
            f"something touches the gel near x = {bump.x_mm:.1f}, y = {bump.y_mm:.1f} mm: the dots "
            f"there are displaced by {bump.shift_mm * 1000:.0f} µm together, {bump.sigmas:.0f} "
            "times their noise; take the reference without contact (if the print itself is warped "
            "there: allow contact)",
            (bump.x_mm, bump.y_mm),
        )


def require_fit(fit: CameraFit, pitch_mm: float, pitch_px: float) -> None:
    """Reject a camera that does not explain the dots, or is far out of its tolerances.

    Raises:
        CalibrationError: It is such a camera.
    """
    off = float(np.sqrt(np.median((fit.residual_px**2).sum(axis=1))))
    share = float(fit.used.mean())
    if off > MOST_RESIDUAL_PITCH * pitch_px or share < LEAST_USED:
        raise CalibrationError(
            "fit",
            f"no plausible camera puts the print where the dots are: half of them are off by "
            f"{off:.1f} px or more and {1 - share:.0%} do not fit (pitch {pitch_px:.0f} px, "
            f"{pitch_mm:g} mm); use the bundle of the sensor that took the picture",
        )
    worst = int(np.argmax(np.abs(fit.values / fit.tolerance)))
    ratio = float(np.abs(fit.values / fit.tolerance)[worst])
    if ratio > MOST_SIGMAS:
        raise CalibrationError(
            "camera",
            f"the camera that explains the dots is not this design's: {PARAMETERS[worst]} is off "
            f"by {fit.values[worst]:.3g}, {ratio:.0f} times its tolerance of "
            f"{fit.tolerance[worst]:g}; use the bundle of the sensor that took the picture, or "
            "check how camera and mirror are mounted",
        )
