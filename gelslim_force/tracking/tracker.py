"""Markers followed from frame to frame; the tracker is the only part of detection with a state.

A frame is first searched only near the predicted positions. If too few markers are verified, the
whole of the same frame is searched and matched again; if the anchors contradict the result, the
lattice is registered again. The whole frame is also searched at intervals, which are short while
markers are missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector, as_planes
from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.growth import LatticeError
from gelslim_force.lattice.picture_turn import picture_turn
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.lattice.registration import register
from gelslim_force.tracking.matching import match
from gelslim_force.tracking.tracks import MarkerStatus, Tracks
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

_SAME_PX = 1.0
_MIN_COVERAGE = 0.25
"""Share of the markers that a full search must find before the next frame starts from it."""
_LEAST_COVERAGE = 0.97
"""Share of the markers of the last full search that a search near predictions must find."""
_FULL_EVERY = 30
"""Number of frames after which the whole frame is searched while markers are missing."""
_GUARD_EVERY = 300
"""The same where nearly all are seen. It is rarer than one frame in a hundred, so that it does not
set the 99th percentile of the time per frame."""
_FEW_MISSING = 0.01
"""Share of the markers that may be missing with the longer interval, if their places are known."""
_AREA_STEP = 0.45
"""Change of the logarithm of a dot's area that shows another kind of dot: a factor of 1.6."""
_MOST_CHANGED = 0.15
"""Largest share of the dots whose area may change by such a factor where most dots have moved."""
_LITTLE_PITCH = 0.2
"""Motion per coordinate, over the pitch, that half of the markers must have before another marker
can be taken."""
Route = Literal["near", "full", "registered"]
"""How markers were found: near predictions, in the whole frame, or by registration."""


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """The tracks of a frame and the dots they refer to."""

    tracks: Tracks
    detections: Detections
    route: Route
    slipped: bool
    """The sizes of the dots contradict the tracks, and registration did not help."""
    turn: str = ""
    """How the picture is turned or mirrored relative to the reference; empty if it is upright."""

    @property
    def problems(self) -> tuple[str, ...]:
        """What is wrong with the tracks, one sentence each."""
        problems = []
        if self.slipped:
            problems.append("the anchors contradict the lattice: it may be off by a pitch")
        lost = self.tracks.count(MarkerStatus.LOST)
        if lost:
            problems.append(f"{lost} of {len(self.tracks)} markers are lost")
        return tuple(problems)


class Tracker:
    """Follows the markers of a reference lattice through frames in order.

    With a `grid` whose anchors are large dots it detects and corrects a shift of all markers by
    whole pitches.
    """

    def __init__(
        self,
        detector: Detector,
        reference: ReferenceLattice,
        reference_dots: Detections,
        grid: MarkerGrid | None = None,
    ) -> None:
        """`reference_dots` are the dots of the reference, in its order."""
        if len(reference_dots) != len(reference):
            raise ValueError(
                f"{len(reference_dots)} reference dots for {len(reference)} markers: "
                "give one for each, in the same order"
            )
        self._detector, self._reference, self._grid = detector, reference, grid
        self._area = reference_dots.area_px
        self._large = np.zeros(len(reference), dtype=bool)
        if grid is not None:
            self._large = grid.kind[reference.markers] == ANCHOR_LARGE
        self._rest_moments = reference_dots.moments_px2
        self._little_px = _LITTLE_PITCH * float(np.median(reference.pitch_px))
        self.reset()

    @property
    def reference(self) -> ReferenceLattice:
        """The markers followed."""
        return self._reference

    def reset(self) -> None:
        """Forget all motion; the whole of the next frame is searched."""
        self._positions = self._reference.positions_px.copy()
        self._velocity = np.zeros_like(self._positions)
        self._moments = self._rest_moments.copy()
        self._usual = 0
        self._age = _GUARD_EVERY
        self._every = _FULL_EVERY
        self._before = self._positions, self._moments.copy()

    def undo(self) -> None:
        """Forget the last frame, which does not show what it should; the next is searched whole."""
        self._positions, self._moments = self._before
        self._velocity = np.zeros_like(self._positions)
        self._age = _GUARD_EVERY

    def update(self, image: NDArray[np.uint8]) -> TrackedFrame:
        """Return the markers of the next frame. Raises ValueError if the array is no picture."""
        as_planes(image)
        self._before = self._positions, self._moments.copy()
        expected = self._positions + self._velocity
        result = None
        if self._age < self._every:
            result = self._near(image, expected)
        if result is None:
            result = self._full(image, expected)
            # A frame with hardly any markers does not tell where they are in the next one.
            blind = result.tracks.coverage < _MIN_COVERAGE
            self._age = _GUARD_EVERY if blind else 0
            self._usual = int(result.tracks.tracked.sum())
        self._age += 1
        self._every = _FULL_EVERY if _many_missing(result.tracks) else _GUARD_EVERY
        if result.slipped:
            self.reset()
        else:
            self._remember(result)
        return result

    def _near(self, image: NDArray[np.uint8], expected: NDArray[np.float64]) -> TrackedFrame | None:
        known = np.isfinite(expected).all(axis=1, keepdims=True)
        positions = np.where(known, expected, -1.0)
        dots = self._detector.detect_near(image, positions, self._moments, compare=False)
        dots = dots.take(dots.found)
        tracks = match(self._reference, dots.centres_px, expected)
        if tracks.tracked.sum() < self._usual:
            dots, tracks = self._search_lost(image, dots, tracks, expected)
        if tracks.tracked.sum() < _LEAST_COVERAGE * self._usual:
            return None
        if self._contradicted(tracks, dots):
            return None
        return TrackedFrame(tracks, dots, "near", False)

    def _search_lost(
        self,
        image: NDArray[np.uint8],
        dots: Detections,
        tracks: Tracks,
        expected: NDArray[np.float64],
    ) -> tuple[Detections, Tracks]:
        """Search lost markers where the motion of their neighbours predicts them."""
        lost = np.flatnonzero(~tracks.tracked & tracks.known)
        more = self._detector.detect_near(
            image, tracks.positions_px[lost], self._rest_moments[lost]
        )
        more = more.take(more.found)
        if len(more) and len(dots):
            gap, _ = cKDTree(dots.centres_px).query(more.centres_px)
            more = more.take(gap > _SAME_PX)
        if not len(more):
            return dots, tracks
        dots = dots.joined(more)
        return dots, match(self._reference, dots.centres_px, expected)

    def _full(self, image: NDArray[np.uint8], expected: NDArray[np.float64]) -> TrackedFrame:
        dots = self._detector.detect(image)
        tracks = match(self._reference, dots.centres_px, expected)
        if not self._contradicted(tracks, dots):
            return TrackedFrame(tracks, dots, "full", False)
        places = self._registered(dots, image.shape)
        if places is None:
            return TrackedFrame(tracks, dots, "full", True)
        known = np.isfinite(places).all(axis=1)
        turn = picture_turn(self._reference.positions_px[known], places[known])
        if turn:
            return TrackedFrame(tracks, dots, "full", True, turn)
        registered = match(self._reference, dots.centres_px, places)
        if self._contradicted(registered, dots):
            return TrackedFrame(tracks, dots, "full", True)
        return TrackedFrame(registered, dots, "registered", False)

    def _registered(self, dots: Detections, shape: tuple[int, ...]) -> NDArray[np.float64] | None:
        """Places (n, 2) of the markers by the anchors, NaN for those not found; None without."""
        if self._grid is None or not self._large.any():
            return None
        try:
            found = register(dots, self._grid, shape)
        except LatticeError:
            return None
        return found.centres_px[self._reference.markers]

    def _contradicted(self, tracks: Tracks, dots: Detections) -> bool:
        """Return whether the sizes of the dots show that the tracks are those of other markers."""
        seen = np.flatnonzero(tracks.tracked)
        if not len(seen):
            return False
        change = _area_change(dots.area_px[tracks.dots[seen]], self._area[seen])
        shrunk = change[self._large[seen]] < -_AREA_STEP
        if len(shrunk) >= 2 and 2 * np.count_nonzero(shrunk) > len(shrunk):
            # Most of the large anchors lie on regular dots.
            return True
        moved = np.abs(tracks.displacement_px[seen]) >= self._little_px
        if 2 * np.count_nonzero(moved) < moved.size:
            return False
        # In another part of a tilted view dots are larger or smaller.
        changed = np.count_nonzero(np.abs(change) > _AREA_STEP)
        return bool(changed > _MOST_CHANGED * len(change))

    def _remember(self, result: TrackedFrame) -> None:
        tracks = result.tracks
        step = tracks.positions_px - self._positions
        moved = np.isfinite(step[:, 0] + step[:, 1])
        self._velocity = np.where(moved[:, None], step, 0.0)
        # A lost marker is searched in the next frame where it was last seen.
        self._positions = np.where(tracks.known[:, None], tracks.positions_px, self._positions)
        seen = tracks.tracked
        self._moments[seen] = result.detections.moments_px2[tracks.dots[seen]]


def _many_missing(tracks: Tracks) -> bool:
    """Whether more than a few markers are not seen, or one has not even a predicted place."""
    return tracks.coverage < 1 - _FEW_MISSING or tracks.count(MarkerStatus.LOST) > 0


def _area_change(
    area_px: NDArray[np.float64], before_px: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Logarithm of the relative change of the dots' areas (n,), beyond that of most dots.

    A change that is common to all areas, due to exposure or focus, has no effect.
    """
    change = np.log(area_px / before_px)
    middle = len(change) // 2
    # The upper median serves as well, and np.median takes four times as long.
    return np.asarray(change - np.partition(change, middle)[middle])
