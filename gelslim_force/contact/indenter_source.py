"""Source of the normal motion under a known indenter: its patch in a frame, and how it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.ball_model import BallModel
from gelslim_force.contact.indenter import Indenter
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_force.contact.shading_change import MOST_FAINT, TOO_FAINT, LostColourError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class UnderReflection:
    """No patch is seen, and a reflection may hide one."""


SeenPatch = ContactPatch | UnderReflection | str | None
"""The patch of a frame, or why none is seen; None without contact."""


@dataclass(frozen=True, eq=False)
class IndenterSource:
    """Patch finder and contact model of one indenter.

    The patch is found where the gel is now, but the model needs its nodes at rest. `motion`
    therefore moves the patch back by the lateral motion of the gel in it.

    Attributes:
        finder: Finds the patch in a picture.
        model: Contact of the indenter on the pad.
        indenter: The shape that touches the gel.
        depth_mm: Known depth, which a flat punch needs; otherwise the patch determines it.
        cap_only: Use the paper's model: the indenter's cap below the rim, and no motion outside.
        varied: Models of a gel with more of a parameter, such as its thickness, and how much more;
            `motion` then gives the derivatives by these parameters.
        hidden_n: Standard deviation of the normal force of a contact that is not seen.
        hidden_mm: That of the height of the whole surface that causes it.
        under_reflection: By how much both are larger where a reflection may hide a contact, which
            only the markers show then.
    """

    finder: PatchFinder
    model: NormalModel | BallModel
    indenter: Indenter
    depth_mm: float | None = None
    cap_only: bool = False
    varied: tuple[tuple[NormalModel | BallModel, float], ...] = ()
    hidden_n: float = 0.0
    hidden_mm: float = 0.0
    under_reflection: float = 1.0

    def prepare(self) -> None:
        """Compute the compliance of the whole pad now, so that no frame waits for it."""
        for model in (self.model, *(varied for varied, _ in self.varied)):
            model.prepare()

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> SeenPatch:
        """The patch of a frame whose markers are at (n, 2), or why none can be seen."""
        try:
            light = self.finder.change(image, markers_px)
        except LostColourError as error:
            return str(error)
        if light.faint > MOST_FAINT:
            return TOO_FAINT
        patch = self.finder.patch_in(light)
        covered = light.hidden is not None and light.hidden.any()
        return UnderReflection() if patch is None and covered else patch

    def motion(self, seen: SeenPatch, lateral_mm: Array | None = None) -> NormalReading:
        """Normal motion for a patch; zero without one, unknown with a reason in its place.

        `lateral_mm` (2,) is the mean lateral motion of the gel in the patch, where it is known.
        """
        count = len(self.model.points_mm)
        if isinstance(seen, str):
            return NormalReading.unknown(count, seen)
        if not isinstance(seen, ContactPatch):
            more = 1.0 if seen is None else self.under_reflection
            return NormalReading.unseen(count, more * self.hidden_n, more * self.hidden_mm)
        at_rest = seen
        if lateral_mm is not None:
            at_rest = replace(seen, centre_mm=seen.centre_mm - lateral_mm)
        if self.cap_only:
            mesh = self.model.mesh if isinstance(self.model, BallModel) else self.model
            found = mesh.cap_only(at_rest, self.indenter)
        else:
            found = self.model.motion(at_rest, self.indenter, self.depth_mm)
        return replace(found, patch=seen, by_gel_mm=self._by_gel(at_rest, found))

    def _by_gel(self, patch: ContactPatch, found: NormalReading) -> Array | None:
        """Derivatives (p, c) of the motion by the parameters of `varied`."""
        if not self.varied or not found.known or self.cap_only:
            return None
        rows = []
        for model, step in self.varied:
            other = model.motion(patch, self.indenter, self.depth_mm)
            rows.append(
                (other.w_mm - found.w_mm) / step if other.known else np.zeros(len(found.w_mm))
            )
        return np.array(rows)
