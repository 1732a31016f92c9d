"""A named indenter that light and markers have to confirm.

The contact patch of a ball of half the radius looks like that of the ball, and the force that
follows from it is twice as large. The estimate for objects of unknown shape uses no name: where
both forces differ by more than their errors, something else than the named indenter touches the
gel. A patch where light and markers show no contact, and whose force is so small that they may not
show it, is none: the blocks of a compressed picture look like that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.uncertainty import with_sigma
from gelslim_force.contact.ball_model import BallModel
from gelslim_force.contact.indenter_source import IndenterSource, SeenPatch
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.joint.fit_state import JointForces
from gelslim_force.joint.rounds import Steps
from gelslim_force.joint.unknown_shape import LARGEST_UNEXPLAINED, UnknownShape

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_SIGMAS = 2.0
_MODEL_ERROR, _BALL_ERROR = 0.15, 0.1
"""Error of the named indenter's force by outline, mesh and friction, over the larger force; that of
a ball by the exact solution of a layer."""
_MOST_NAMED = 0.05
"""Largest standard deviation of the named indenter's force that counts, over the larger force: the
patch of another shape may have any size."""
_FRAMES = 10
"""Frames of a contact after which it is compared again."""
_SOLUTIONS = 2
"""Of the unknown shape in each frame of a comparison that goes on over several, the look at the
light being the first. A comparison ends in the frame after the one that it is of, or in the next
but one."""
_WAITS = 3
"""Most frames in a row in which a comparison leaves the time to a search for the patch."""
_GROWN = 0.1
"""Change of the patch's size from which it is compared before that."""
_ANOTHER = (
    "light and markers show a force of {seen} N, the indenter as named would "
    "press with {named:.2g} N: another shape or size touches the gel; name that, or leave the "
    "indenter out"
)
_NO_CONTACT = (
    "the light is not that of a contact with the indenter as named: light and markers show none, "
    "where it would press with {named:.2g} N"
)


@dataclass(frozen=True, eq=False)
class SeenIndenter:
    """What one frame shows.

    Attributes:
        patch: The contact patch.
        witness: The forces of an unknown shape, None without contact, or why there are none.
        compared: Whether `witness` was looked for in this frame.
        shown: (c,) nodes whose slope the light shows; None where no marker is lost.
    """

    patch: ContactPatch
    witness: JointForces | str | None
    compared: bool
    shown: Mask | None


@dataclass(eq=False)
class _Comparison:
    """A comparison that goes on over several frames.

    Attributes:
        seen: The frame that it is of.
        steps: Look for its forces.
        reading: What the named indenter reads in it; None where that is not known.
        witness: The forces found, as in `SeenIndenter`.
        ended: Whether they are.
    """

    seen: SeenIndenter
    steps: Steps[JointForces | str | None]
    reading: NormalReading | None = None
    witness: JointForces | str | None = None
    ended: bool = False

    def go_on(self) -> None:
        """The solutions of one frame."""
        for _ in range(_SOLUTIONS):
            try:
                next(self.steps)
            except StopIteration as end:
                self.witness, self.ended = end.value, True
                return


@dataclass(frozen=True)
class _Verdict:
    """Why the indenter is not the one named, empty if it may be; whether no contact is seen."""

    problem: str = ""
    untouched: bool = False


class CheckedIndenter:
    """`NormalSource` of a named indenter that another one confirms.

    It compares the forces in the first frame of a contact, when the patch grows or shrinks, and
    every ten frames; the verdict holds in between. A new contact is judged at once, and so is a
    patch that changed while the verdict is against the indenter. The work of the other comparisons
    is spread over the frames after the one that they are of, and waits where the patch is searched
    for anew. Neither depends on time.

    Attributes:
        named: The named indenter.
        witness: Forces of objects of unknown shape on the same sensor, with a linear gel.
    """

    def __init__(self, named: IndenterSource, witness: UnknownShape) -> None:
        self.named, self.witness = named, witness
        self.reset()

    def prepare(self) -> None:
        """Compute what both have of the whole pad, so that no frame waits for it."""
        self.named.prepare()
        self.witness.prepare()

    def reset(self) -> None:
        """Forget the last frame."""
        self.witness.reset()
        self._size_mm, self._age, self._verdict = 0.0, 0, _Verdict()
        self._running: _Comparison | None = None
        self._waited = 0

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> SeenIndenter | SeenPatch:
        """The patch of a frame whose markers are at (n, 2), and what is compared with it.

        Without a patch it is what the named indenter has in its place.
        """
        patch = self.named.look(image, markers_px)
        if not isinstance(patch, ContactPatch):
            self.reset()
            return patch
        lost = bool(np.isnan(markers_px).any())
        shown = self.witness.estimator.shown(image, markers_px) if lost else None
        changed = abs(patch.size_mm - self._size_mm) > _GROWN * self._size_mm
        if self._size_mm == 0.0 or (changed and self._verdict != _Verdict()):
            self._size_mm, self._age, self._running = patch.size_mm, 0, None
            return SeenIndenter(patch, self.witness.look(image, markers_px), True, shown)
        seen = SeenIndenter(patch, None, False, shown)
        self._age += 1
        if self._running is not None and self._running.ended:
            self._running = None
        if self._gives_way():
            return seen
        if self._running is None and (changed or self._age >= _FRAMES):
            self._size_mm, self._age = patch.size_mm, 0
            self._running = _Comparison(seen, self.witness.looking(image, markers_px))
        if self._running is not None:
            self._running.go_on()
        return seen

    def _gives_way(self) -> bool:
        """Whether a comparison waits because the patch was searched for, but not for ever."""
        waits = self.named.finder.searched and self._waited < _WAITS
        self._waited = self._waited + 1 if waits else 0
        return waits

    def motion(self, seen: Any, lateral_mm: Array | None = None) -> NormalReading:
        """Motion under the named indenter; unknown where it is not the one that touches."""
        if not isinstance(seen, SeenIndenter):
            return self.named.motion(seen, lateral_mm)
        reading = self.named.motion(seen.patch, lateral_mm)
        running = self._running
        if running is not None and running.seen is seen and reading.known:
            running.reading = reading
        if running is not None and running.ended and running.reading is not None:
            self._verdict = self._compared(running.reading, running.witness)
        if not reading.known:
            return reading
        if seen.compared:
            self._verdict = self._compared(reading, seen.witness)
        if self._verdict.untouched:
            return replace(self.witness.motion(None), shown=seen.shown)
        return replace(reading, problem=self._verdict.problem, shown=seen.shown)

    def _compared(self, reading: NormalReading, found: JointForces | str | None) -> _Verdict:
        """Whether the reading is that of this indenter."""
        if isinstance(found, str):
            return _Verdict()
        named = -reading.push_n
        if found is None or found.unexplained > LARGEST_UNEXPLAINED:
            if -named > _SIGMAS * self.witness.unseen_n:
                return _Verdict(_NO_CONTACT.format(named=named))
            return _Verdict(untouched=True)
        if abs(found.gain - 1) > self.witness.most_gain:
            return _Verdict()  # The light itself is not the traced one, and is no witness.
        seen, sigma = float(found.force_n[:, 2].sum()), float(np.sqrt(found.covariance[2, 2]))
        larger = max(abs(seen), abs(named))
        own = min(reading.push_sigma_n, _MOST_NAMED * larger)
        exact = isinstance(self.named.model, BallModel)
        model = (_BALL_ERROR if exact else _MODEL_ERROR) * larger
        allowed = _SIGMAS * float(np.hypot(sigma, own)) + model
        if abs(named - seen) <= allowed:
            return _Verdict()
        return _Verdict(_ANOTHER.format(seen=with_sigma(seen, sigma), named=named))
