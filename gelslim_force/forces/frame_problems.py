"""What a frame's picture and tracks do not allow, one sentence each."""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_force.tracking.tracker import TrackedFrame
from gelslim_optics.camera.virtual_camera import VirtualCamera

LARGEST_CONTRADICTION = 4.0
"""Apparent motion that the depth should cause, over the motion seen, above which the patch is no
contact. For correct patches the ratio stays below 2."""
CONTRADICTED = "a contact as seen would show {:.0f} times the motion that the markers show"
NO_PATCH = "the markers move, but no contact patch is seen"
_LARGEST_MISFIT = 0.35


def size_problem(image: Any, camera: VirtualCamera) -> str:
    """Why an object is no picture of this camera; empty if it is one."""
    size = (camera.image_height_px, camera.image_width_px)
    if isinstance(image, np.ndarray) and image.shape[:2] == size:
        return ""
    got = type(image).__name__
    if isinstance(image, np.ndarray) and image.ndim >= 2:
        got = f"{image.shape[1]} x {image.shape[0]} px"
    return f"frame of {got}: this sensor's frames are {size[1]} x {size[0]} px"


def misfit_problem(misfit: float) -> tuple[str, ...]:
    """What a share of motion that the forces do not explain means; empty if it is small."""
    if misfit <= _LARGEST_MISFIT:
        return ()
    return (f"forces on the contact seen leave {misfit:.0%} of the motion unexplained",)


def refusal(tracked: TrackedFrame, least_coverage: float) -> str:
    """Why the tracks of a frame give no forces; empty if they do."""
    if tracked.turn:
        return (
            f"the picture is {tracked.turn} relative to the calibration: correct the camera's "
            "orientation, or calibrate again with pictures in this one"
        )
    coverage = tracked.tracks.coverage
    if coverage < least_coverage:
        return (
            f"{coverage:.0%} of the markers are seen: under {least_coverage:.0%} forces are not "
            "given"
        )
    if tracked.slipped:
        return (
            "the sizes of the dots are not those of the calibration: the picture is turned, "
            "mirrored or shifted, or shows another sensor; correct the camera's orientation or "
            "calibrate again"
        )
    return ""
