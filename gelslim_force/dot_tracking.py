"""Tracking in pixels for any sensor with a grid of dots: it needs only one picture at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.lattice.dot_size import DotEstimate, estimate_settings
from gelslim_force.lattice.growth import LatticeError, grow_lattice
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracker import Tracker


@dataclass(frozen=True, eq=False)
class DotsAtRest:
    """The dots in the picture at rest, and the settings with which they are found again."""

    settings: DetectorSettings
    reference: ReferenceLattice
    dots: Detections
    """The dots of the reference, in its order."""
    found: int
    """Number of all dots in the picture, also of those that are not on the lattice."""
    lattice_shape: tuple[int, int]
    """Extent of the lattice; without a print, rows and columns may be exchanged."""
    pitch_px: float
    residual_px: float
    """Median distance of the dots from the positions that their neighbours predict."""
    image_shape: tuple[int, ...]


def dots_at_rest(image: NDArray[np.uint8], settings: DetectorSettings | None = None) -> DotsAtRest:
    """Return the lattice of dots in a picture without contact.

    Without `settings` these are estimated from the picture. Raises LatticeError if no lattice is
    found, ValueError if the array is no picture.
    """
    found = estimate_settings(image) if settings is None else _found(image, settings)
    reference = ReferenceLattice.from_lattice(found.lattice, found.detections)
    own = found.detections.take(found.lattice.dots)
    # The reference leaves out dots without a neighbour, so dots are assigned by their sites.
    index = {tuple(site): k for k, site in enumerate(found.lattice.sites.tolist())}
    order = [index[tuple(site)] for site in reference.sites.tolist()]
    residual = found.lattice.residual_px
    return DotsAtRest(
        settings=found.settings,
        reference=reference,
        dots=own.take(order),
        found=len(found.detections),
        lattice_shape=found.lattice.shape,
        pitch_px=found.lattice.pitch_px,
        residual_px=float(np.nanmedian(residual)) if np.isfinite(residual).any() else np.nan,
        image_shape=image.shape,
    )


def _found(image: NDArray[np.uint8], settings: DetectorSettings) -> DotEstimate:
    dots = Detector(settings).detect(image)
    lattice = grow_lattice(dots)
    if min(lattice.shape) < 3:
        raise LatticeError(f"only a strip of {lattice.shape} dots is found; it has no direction")
    return DotEstimate(settings, dots, lattice, (np.nan, np.nan))


class DotTracking:
    """Follows the dots of one picture at rest through frames, in order."""

    def __init__(self, rest: DotsAtRest) -> None:
        self.rest = rest
        self._tracker = Tracker(Detector(rest.settings), rest.reference, rest.dots)

    def follow(self, image: NDArray[np.uint8] | None, index: int, time_s: float) -> FrameResult:
        """Return the tracks of the next frame; no content of a frame raises an error.

        A frame that is None, or of another size than the picture at rest, has a problem and no
        tracks.
        """
        if image is None:
            return FrameResult(index, time_s, problems=("the frame could not be read",))
        if image.shape[:2] != self.rest.image_shape[:2]:
            size, own = image.shape, self.rest.image_shape
            text = f"frame of {size[1]} x {size[0]} px: the picture at rest has {own[1]} x {own[0]}"
            return FrameResult(index, time_s, problems=(text,))
        try:
            tracked = self._tracker.update(image)
        except ValueError as error:
            return FrameResult(index, time_s, problems=(str(error),))
        return FrameResult(index, time_s, tracks=tracked.tracks)
