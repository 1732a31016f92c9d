"""The normal motion of each frame from the contact patch of a known indenter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.indenter import Indenter
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]


class Finder(Protocol):
    """Finds the contact patch in a frame."""

    def find(
        self, image: NDArray[np.uint8], markers_px: Array | None = None
    ) -> ContactPatch | None:
        """Return the patch, None where nothing touches; pixels at the markers are left out."""


@dataclass(frozen=True, eq=False)
class IndenterSource:
    """Patch finder and contact model of one indenter.

    The patch is found where the gel is now, but the model needs its nodes at rest. `motion`
    therefore moves the patch back by the lateral motion of the gel in it.

    Attributes:
        finder: Finds the patch in a picture.
        model: Contact of a rigid indenter on the pad.
        indenter: The shape that touches the gel.
        depth_mm: Known depth, which a flat punch needs; otherwise the patch determines it.
        cap_only: Use the paper's model: the indenter's cap below the rim, and no motion outside.
    """

    finder: Finder
    model: NormalModel
    indenter: Indenter
    depth_mm: float | None = None
    cap_only: bool = False

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> ContactPatch | None:
        """Return the patch of a frame whose markers are at (n, 2)."""
        return self.finder.find(image, markers_px)

    def motion(self, seen: ContactPatch | None, lateral_mm: Array | None = None) -> NormalReading:
        """Normal motion for a patch; zero without one.

        `lateral_mm` (2,) is the mean lateral motion of the gel in the patch, where it is known.
        """
        count = len(self.model.points_mm)
        if seen is None:
            zero = np.zeros(count)
            return NormalReading(zero, zero, np.zeros(count, dtype=bool))
        at_rest = seen
        if lateral_mm is not None:
            at_rest = replace(seen, centre_mm=seen.centre_mm - lateral_mm)
        found = (
            self.model.cap_only(at_rest, self.indenter)
            if self.cap_only
            else self.model.motion(at_rest, self.indenter, self.depth_mm)
        )
        return NormalReading(
            found.w_mm, found.sigma_mm, found.patch, seen, found.depth_mm, found.problem
        )
