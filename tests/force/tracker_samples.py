"""A tracker of drawn frames, and how far its markers are from the truth."""

from __future__ import annotations

import numpy as np
from camera_rig import finger_view
from numpy.typing import NDArray
from synthetic import Frame, Look, grid_of_dots, render

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.lattice.registration import register
from gelslim_force.tracking.tracker import TrackedFrame, Tracker

Array = NDArray[np.float64]
GRID = grid_of_dots()
CAMERA = finger_view()
PITCH_MM = 1.1
PLACE = np.array([1.5, -2.0])


class FullSearch(Tracker):
    """Searches the whole of every frame."""

    def _near(self, image: NDArray[np.uint8], expected: Array) -> None:
        return None


def tracker_for(frame: Frame, kind: type[Tracker] = Tracker) -> Tracker:
    """A tracker whose rest is a drawn frame."""
    detector = Detector(DetectorSettings.for_diameters(frame.diameter_px))
    dots = detector.detect(frame.image)
    registration = register(dots, GRID, frame.image.shape)
    found = np.flatnonzero(registration.found)
    sites = np.column_stack([GRID.row, GRID.column])[found]
    reference = ReferenceLattice.connected(sites, registration.centres_px[found], found)
    return kind(detector, reference, dots.take(registration.dots[reference.markers]), GRID)


def press(amount_pitch: float) -> Array:
    """Motion (m, 2) in mm: shear and spread under a contact of 3 mm."""
    off = GRID.positions_mm - PLACE
    bump = np.exp(-np.sum(off**2, axis=1) / (2 * 3.0**2))[:, None]
    moved = bump * (np.array([0.8, 0.6]) + 0.12 * off)
    return np.asarray(moved * amount_pitch * PITCH_MM / np.hypot(*moved.T).max())


def frame_at(amount_pitch: float, **look: float) -> Frame:
    """A frame of a press, with noise unless said otherwise."""
    return render(GRID, CAMERA, Look(**{"noise": 5, **look}), press(amount_pitch))


def errors(tracker: Tracker, tracked: TrackedFrame, frame: Frame) -> tuple[Array, Array]:
    """Distance (k,) of the tracked markers from their true centres, and which they are."""
    seen = np.flatnonzero(tracked.tracks.tracked)
    markers = tracker.reference.markers[seen]
    true = frame.centres_px[markers]
    return np.hypot(*(tracked.tracks.positions_px[seen] - true).T), markers
