"""What a frame's picture and tracks do not allow, one sentence each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.motion.unseen_motion import UnseenMotion
from gelslim_force.tracking.picture_faults import PictureFaults
from gelslim_force.tracking.tracker import TrackedFrame
from gelslim_force.tracking.tracks import Tracks
from gelslim_force.tracking.whole_dots import WholeDots
from gelslim_optics.camera.virtual_camera import VirtualCamera

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

LARGEST_CONTRADICTION = 4.0
"""Apparent motion that the depth should cause, over the motion seen, above which the patch is no
contact. For correct patches the ratio stays below 2."""
CONTRADICTED = "a contact as seen would show {:.0f} times the motion that the markers show"
COVERED = (
    "the markers are not seen in {:.0%} of the contact: clear the camera's view of the gel, or "
    "look for dirt and damage of the print"
)
NO_PATCH = "the markers move, but no contact patch is seen"
_LARGEST_MISFIT = 0.35
_LARGEST_BLUR = 0.4
"""Of the logarithm of the size of most dots."""
_LARGEST_USUAL = 0.25
"""Motion of most markers over the thickness of the gel: a grip of all of it slips before."""
_ALL_MOVED = (
    "most markers have moved by {:.2g} mm, {:.0%} of the gel's thickness, and the gel moves by at "
    "most {:.0%} as a whole: the picture is shifted or torn, or the camera has moved; calibrate "
    "again"
)
_TURNED = (
    "the picture is {} relative to the calibration: correct the camera's orientation, or calibrate "
    "again with pictures in this one"
)
_TOO_FEW = "{:.0%} of the markers are seen: under {:.0%} forces are not given"
_SLIPPED = (
    "the sizes of the dots are not those of the calibration: the picture is turned, mirrored or "
    "shifted, or shows another sensor; correct the camera's orientation or calibrate again"
)
_BLURRED = (
    "the dots are half as large again as in the calibration: the picture is out of focus, or "
    "something is on the lens"
)


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


@dataclass(frozen=True, eq=False)
class FrameCheck:
    """Says which frames of one sensor give no forces.

    Attributes:
        whole: Finds the dots that are seen whole.
        faults: Finds frozen rows and torn pictures.
        unseen: Gaps among the markers.
        mm_per_px: Usual length on the gel per length in the picture.
        least_coverage: Smallest share of the markers seen with which a frame gives forces.
    """

    whole: WholeDots
    faults: PictureFaults
    unseen: UnseenMotion
    mm_per_px: float
    least_coverage: float

    @classmethod
    def of(
        cls,
        bundle: Bundle,
        calibration: Calibration,
        motion: SurfaceMotion,
        least_coverage: float,
    ) -> FrameCheck:
        """Make it for one sensor with its followed markers."""
        followed = calibration.reference
        dots = np.searchsorted(calibration.markers, followed.markers)
        heights_mm = np.asarray(bundle.mesh.nodes_mm)[:, 2]
        return cls(
            WholeDots(followed, calibration.dots.moments_px2[dots]),
            PictureFaults(followed),
            UnseenMotion(
                motion.view.rest_mm[:, :2], motion.points_mm[:, :2], float(np.ptp(heights_mm))
            ),
            motion.view.usual_mm_per_px,
            least_coverage,
        )

    def refusal(self, tracked: TrackedFrame) -> str:
        """Why the tracks of a frame give no forces; empty if they do."""
        tracks = tracked.tracks
        if tracked.turn:
            return _TURNED.format(tracked.turn)
        if tracks.coverage < self.least_coverage:
            return _TOO_FEW.format(tracks.coverage, self.least_coverage)
        if tracked.slipped:
            return _SLIPPED
        from gelslim_force.tracking.median_kernel import median

        growth, _ = self.whole.changes(tracked)
        if median(growth) > _LARGEST_BLUR:
            return _BLURRED
        moved_px = np.where(tracks.tracked[:, None], tracks.displacement_px, np.nan)
        return self.faults.torn(moved_px, growth) or self.unseen.problem(tracks.tracked)

    def moved(self, tracks: Tracks) -> str:
        """Why markers that no drift explains have moved too far; empty if they have not."""
        from gelslim_force.tracking.median_kernel import median

        moved_px = np.ascontiguousarray(tracks.displacement_px[tracks.tracked].T)
        usual_mm = self.mm_per_px * math.hypot(*map(median, moved_px))
        share = usual_mm / self.unseen.thickness_mm
        return _ALL_MOVED.format(usual_mm, share, _LARGEST_USUAL) if share > _LARGEST_USUAL else ""
