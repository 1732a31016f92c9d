"""What a no-contact frame must show before a calibration is believed; each check refuses in words.

Limits are wide: they keep out other sensors, turned pictures and contact, not poor builds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.calibration.camera_deviation import PARAMETERS
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.detection.detection import as_planes
from gelslim_force.detection.picture_turn import picture_turn
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

if TYPE_CHECKING:
    from gelslim_force.calibration.fit import CameraFit
    from gelslim_force.calibration.residual_bump import ResidualBump, ResidualField
    from gelslim_force.detection.detections import Detections
    from gelslim_force.lattice.registration import Registration

LEAST_SEEN = 0.6
"""Share of the markers in view that must be found."""
LEAST_MARKERS = 20
MOST_FOREIGN = 0.2
"""Dots that are no markers, as a share of those that are."""
MOST_SIGMAS = 5.0
"""Tolerances by which one deviation may leave the design."""
MOST_RESIDUAL_PITCH = 0.1
LEAST_USED = 0.7
CONTACT_MM = 0.03
"""Shared motion of a neighbourhood, if local and beyond the noise, that counts as contact."""
_ANCHOR_STEP = 0.5


def require_size(image: NDArray[np.uint8], camera: VirtualCamera) -> None:
    """Refuse what is no picture of the camera's size."""
    try:
        height, width = as_planes(image).shape[:2]
    except ValueError as error:
        raise CalibrationError(f"the reference cannot be used: {error}") from error
    wide, high = camera.image_width_px, camera.image_height_px
    if (width, height) == (wide, high):
        return
    remedy = "give the camera's whole, unscaled picture"
    if (width, height) == (high, wide):
        remedy = "the picture lies on its side: turn it back"
    raise CalibrationError(
        f"the reference is {width} x {height} px, this sensor's camera takes {wide} x {high} px: "
        f"{remedy}, or use the bundle of the sensor that took it"
    )


def markers_in_view(camera: VirtualCamera, grid: MarkerGrid) -> NDArray[np.bool_]:
    """Which markers (m,) the design's camera sees whole."""
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    places = camera.project(flat)
    stretch = np.linalg.norm(camera.jacobian(flat), 2, axis=(1, 2))
    rim = (stretch * grid.diameter_mm / 2)[:, None]
    size = np.array([camera.image_width_px, camera.image_height_px])
    inside: NDArray[np.bool_] = np.all((places >= rim) & (places <= size - 1 - rim), axis=1)
    return inside


def require_dots(dots: Detections, expected: NDArray[np.bool_]) -> None:
    """Refuse a picture with too few dots to be the print."""
    least = max(LEAST_MARKERS, int(np.ceil(LEAST_SEEN * expected.sum())))
    if len(dots) < least:
        raise CalibrationError(
            f"{len(dots)} dots are seen, the print has {int(expected.sum())} in view and at least "
            f"{least} are needed: check light, focus and exposure, or use the bundle of the "
            "sensor that took the picture"
        )


def require_upright(expected_px: ArrayLike, seen_px: ArrayLike) -> None:
    """Refuse a turned or mirrored picture."""
    turn = picture_turn(expected_px, seen_px)
    if turn:
        raise CalibrationError(
            f"the picture is {turn} against what the design's camera takes: undo that in the "
            "camera's settings or in the file, for frames and reference alike"
        )


def require_print(
    registration: Registration, dots: Detections, expected: NDArray[np.bool_]
) -> None:
    """Refuse a lattice that is not this print's: too few of its dots, or too many others."""
    found = int(registration.found.sum())
    least = max(LEAST_MARKERS, int(np.ceil(LEAST_SEEN * expected.sum())))
    if found < least:
        raise CalibrationError(
            f"{found} markers are found of {int(expected.sum())} in view, at least {least} are "
            "needed: clean and light the whole gel, or use the bundle of the sensor that took "
            "the picture"
        )
    others = dots.take(registration.spurious)
    foreign = int(others.trustworthy.sum())
    if foreign > max(MOST_FOREIGN * found, 5):
        raise CalibrationError(
            f"{foreign} clean dots are on no site of this print, against {found} that are: the "
            "picture shows another print; use the bundle of the sensor that took it"
        )


def require_anchors(
    dots: Detections, camera: VirtualCamera, grid: MarkerGrid, found: NDArray[np.int64]
) -> None:
    """Refuse a print whose large dots are elsewhere, or that has dots where this one has none."""
    flat = np.column_stack([grid.positions_mm[found], np.zeros(len(found))])
    plain_px = np.abs(np.linalg.det(camera.jacobian(flat)))
    large = grid.kind[found] == ANCHOR_LARGE
    if not large.any() or large.all():
        return
    size = np.log(dots.area_px / plain_px)
    usual = float(np.median(size[~large]))
    rise = 2 * np.log(
        np.median(grid.diameter_mm[found][large]) / np.median(grid.diameter_mm[found][~large])
    )
    small_anchors = int((size[large] < usual + _ANCHOR_STEP * rise).sum())
    if small_anchors > max(1, large.sum() // 3):
        raise CalibrationError(
            f"{small_anchors} of {int(large.sum())} anchors of this print are ordinary dots in the "
            "picture: it shows another print; use the bundle of the sensor that took it"
        )


def contact_of(residuals: ResidualField) -> ResidualBump | None:
    """Return the bump where it looks like contact."""
    bump = residuals.bump
    if bump is None or not bump.local or bump.shift_mm < CONTACT_MM:
        return None
    return bump


def require_no_contact(residuals: ResidualField) -> None:
    """Refuse a place where neighbouring dots are off together."""
    bump = contact_of(residuals)
    if bump is not None:
        raise CalibrationError(
            f"something touches the gel near x = {bump.x_mm:.1f}, y = {bump.y_mm:.1f} mm: the dots "
            f"there are off by {bump.shift_mm * 1000:.0f} µm together, {bump.sigmas:.0f} times "
            "their noise; take the reference without contact (if the print itself is warped "
            "there: allow contact)"
        )


def require_fit(fit: CameraFit, pitch_mm: float, pitch_px: float) -> None:
    """Refuse a camera that does not explain the dots, or lies far out of its tolerances."""
    off = float(np.sqrt(np.median((fit.residual_px**2).sum(axis=1))))
    share = float(fit.used.mean())
    if off > MOST_RESIDUAL_PITCH * pitch_px or share < LEAST_USED:
        raise CalibrationError(
            f"no camera within reason puts the print where the dots are: half of them are off by "
            f"{off:.1f} px or more and {1 - share:.0%} do not fit (pitch {pitch_px:.0f} px, "
            f"{pitch_mm:g} mm); use the bundle of the sensor that took the picture"
        )
    worst = int(np.argmax(np.abs(fit.values / fit.tolerance)))
    ratio = float(np.abs(fit.values / fit.tolerance)[worst])
    if ratio > MOST_SIGMAS:
        raise CalibrationError(
            f"the camera that explains the dots is not this design's: {PARAMETERS[worst]} is off "
            f"by {fit.values[worst]:.3g}, {ratio:.0f} times its tolerance of "
            f"{fit.tolerance[worst]:g}; use the bundle of the sensor that took the picture, or "
            "look how camera and mirror are mounted"
        )
