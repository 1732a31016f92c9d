"""The normal motion of each frame from the contact patch of a known indenter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.indenter import Indenter
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch

if TYPE_CHECKING:
    from gelslim_force.pipeline import ForcePipeline

Array = NDArray[np.float64]


class Finder(Protocol):
    """Sees the contact patch in a frame."""

    def find(
        self, image: NDArray[np.uint8], markers_px: Array | None = None
    ) -> ContactPatch | None:
        """Return the patch, None where nothing touches; ink at the markers does not count."""


@dataclass(frozen=True, eq=False)
class NormalReading:
    """Normal motion of the c surface nodes in one frame."""

    w_mm: Array
    """(c,) negative for a press."""
    sigma_mm: Array
    """(c,)."""
    touched: NDArray[np.bool_] | None
    """(c,) nodes in contact, None where the source does not tell."""
    patch: ContactPatch | None = None
    """Where the light changed; None where nothing touches."""
    depth_mm: float = 0.0
    """Of the indenter's lowest point."""
    problem: str = ""
    """Why the motion is unknown; its arrays are then NaN."""

    @property
    def known(self) -> bool:
        """Whether there is a motion."""
        return not self.problem

    def summary(self) -> dict[str, object]:
        """Patch and depth as plain numbers."""
        if self.patch is None:
            return {"touched": False}
        return {
            "touched": True,
            "kind": self.patch.kind,
            "centre_mm": [float(v) for v in self.patch.centre_mm],
            "size_mm": float(self.patch.size_mm),
            "size_sigma_mm": self.patch.sigma_mm,
            "angle_deg": float(self.patch.angle_deg),
            "depth_mm": float(self.depth_mm) if self.known else None,
        }


@dataclass(frozen=True, eq=False)
class IndenterSource:
    """Patch finder and contact model of one indenter.

    A patch is seen where the gel is now; its nodes were elsewhere at rest. `motion` therefore
    takes the lateral motion found in the patch and moves the patch back by it.
    """

    finder: Finder
    model: NormalModel
    indenter: Indenter
    depth_mm: float | None = None
    """Known depth, which a flat punch needs."""
    cap_only: bool = False
    """The paper's model: the indenter's cap below the rim seen, and no motion beside it."""

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> ContactPatch | None:
        """Return the patch of a frame whose markers are at (n, 2)."""
        return self.finder.find(image, markers_px)

    def motion(self, patch: ContactPatch | None, lateral_mm: Array | None = None) -> NormalReading:
        """Normal motion for a patch; zero without one.

        `lateral_mm` (2,) is the mean motion of the gel in the patch, once known.
        """
        count = len(self.model.points_mm)
        if patch is None:
            nothing = np.zeros(count)
            return NormalReading(nothing, nothing, np.zeros(count, dtype=bool))
        at_rest = patch
        if lateral_mm is not None:
            at_rest = replace(patch, centre_mm=patch.centre_mm - lateral_mm)
        found = (
            self.model.cap_only(at_rest, self.indenter)
            if self.cap_only
            else self.model.motion(at_rest, self.indenter, self.depth_mm)
        )
        return NormalReading(
            found.w_mm, found.sigma_mm, found.patch, patch, found.depth_mm, found.problem
        )


def indenter_source(
    pipeline: ForcePipeline,
    reference: NDArray[np.uint8],
    indenter: Indenter,
    depth_mm: float | None = None,
) -> IndenterSource:
    """Source for a pipeline's sensor; `reference` is its no-contact frame.

    Raises ValueError for a reference that cannot show a patch, such as a grey one.
    """
    from gelslim_force.contact.patch_finder import PatchFinder

    built = pipeline.calibration
    followed = built.reference
    radius = np.sqrt(np.abs(built.dots.moments_px2).max(axis=1)) * 2
    index = np.searchsorted(built.markers, followed.markers)
    finder = PatchFinder(
        built.camera,
        reference,
        followed.positions_px,
        marker_radius_px=radius[index],
        surface_mm=pipeline.points_mm,
        indenter=indenter,
    )
    model = NormalModel(pipeline.settings.compliance(pipeline.bundle), pipeline.points_mm)
    return IndenterSource(finder, model, indenter, depth_mm)
