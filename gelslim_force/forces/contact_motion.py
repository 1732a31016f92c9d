"""Motion of the markers with what the normal source sees of the contact, frame after frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.normal_source import NormalReading, NormalSource, Prepared, Remembering
from gelslim_force.forces import frame_problems
from gelslim_force.forces.frame_clock import FrameClock
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.motion.unseen_motion import UnseenMotion
from gelslim_force.tracking.drift_filter import FrameDrift

Array = NDArray[np.float64]
_SHIFT_MM = 0.03
"""Change of the lateral motion in the contact for which the normal motion need not be redone."""
_MOST_COVERED = 0.25
"""Share of the nodes in contact at which the markers may be missing."""


@runtime_checkable
class SeesDrift(Protocol):
    """A source whose model holds what the correction of drift takes off the motion by a load."""

    def look_corrected(self, image: NDArray[np.uint8], drift: FrameDrift) -> Any:
        """As `NormalSource.look`, of a frame with this drift."""


class ContactMotion:
    """Finds the motion of one sensor's markers; it keeps the lateral motion in the contact.

    Args:
        motion: From positions in the picture to motions.
        unseen: Gaps among the markers.
        normal: Finds the normal motion; None where it stays unknown unless it is given.
    """

    def __init__(
        self, motion: SurfaceMotion, unseen: UnseenMotion, normal: NormalSource | None
    ) -> None:
        self._motion, self._unseen, self._normal = motion, unseen, normal
        self._last_lateral: Array | None = None

    def prepare(self) -> None:
        """Compute what the source would compute for the first contact at a place."""
        if isinstance(self._normal, Prepared):
            self._normal.prepare()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last_lateral = None
        if isinstance(self._normal, Remembering):
            self._normal.reset()

    def of(
        self,
        image: NDArray[np.uint8],
        drift: FrameDrift,
        tracked: NDArray[np.bool_],
        given: NormalReading | None,
        clock: FrameClock,
    ) -> tuple[NormalReading | None, Array]:
        """Normal motion, and the motion (n, 3) of the reference's markers.

        Args:
            image: The frame.
            drift: Of it, with the positions of its markers.
            tracked: (n,) those that were seen.
            given: Normal motion that takes the place of the source's.
            clock: Takes the times of the stages.
        """
        motion_of, normal, positions_px = self._motion.of_markers, self._normal, drift.positions_px
        if given is not None or normal is None:
            motion = motion_of(positions_px, given)
            clock.stage("displace")
            return given, motion
        seen: Any
        if isinstance(normal, SeesDrift):
            seen = normal.look_corrected(image, drift)
        else:
            seen = normal.look(image, positions_px)
        clock.stage("look")
        reading = normal.motion(seen, self._last_lateral)
        clock.stage("normal")
        motion = motion_of(positions_px, reading)
        clock.stage("displace")
        problem = self._contradiction(reading, motion) or self._covered(reading, tracked)
        if problem:
            return replace(reading, problem=problem), motion_of(positions_px, None)
        lateral = self._motion.in_contact(motion, reading)
        used, self._last_lateral = self._last_lateral, lateral
        before = 0.0 if used is None else used
        if lateral is not None and np.hypot(*(lateral - before)) > _SHIFT_MM:
            reading = normal.motion(seen, lateral)
            clock.stage("normal")
            motion = motion_of(positions_px, reading)
            clock.stage("displace")
        return self._with_hidden(reading, tracked), motion

    def _contradiction(self, reading: NormalReading, motion: Array) -> str:
        """Why motion (n, 3) and contact do not agree; empty if they do."""
        free = reading.known and reading.touched is not None and not reading.touched.any()
        if free and self._motion.moved(motion):
            # The gel moves although no patch is seen: zero force would be a false statement.
            return frame_problems.NO_PATCH
        ratio = self._motion.apparent_over_seen(motion, reading)
        if ratio > frame_problems.LARGEST_CONTRADICTION:
            return frame_problems.CONTRADICTED.format(ratio)
        return ""

    def _covered(self, reading: NormalReading, tracked: NDArray[np.bool_]) -> str:
        """Why too much of a contact is not seen; empty if enough is.

        Light around a lost marker shows the gel there.
        """
        touched = reading.touched
        if touched is None or not touched.any() or tracked.all():
            return ""
        unseen = self._unseen.nodes(~tracked)
        if reading.shown is not None:
            unseen = unseen & ~reading.shown
        share = float(unseen[touched].mean())
        return frame_problems.COVERED.format(share) if share > _MOST_COVERED else ""

    def _with_hidden(self, reading: NormalReading, tracked: NDArray[np.bool_]) -> NormalReading:
        """The reading with the depth that gaps among the markers may hide, in its deviation.

        Light around a lost marker shows a dent there.
        """
        if not reading.known or tracked.all():
            return reading
        hidden_mm = self._unseen.hidden_mm(tracked)
        if reading.shown is not None:
            hidden_mm = np.where(reading.shown, 0.0, hidden_mm)
        return reading.with_error(hidden_mm)
