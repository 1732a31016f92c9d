"""What a source of the normal motion offers to the force pipeline, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FoundForces:
    """Forces that a source found together with the motion.

    Attributes:
        force_n: (c, 3) on the surface nodes.
        displacement_mm: (c, 3) of the surface nodes.
        covariance: (6, 6) of force and torque about the origin.
        gain: Gain of the light over the light as traced.
        unexplained: Share of the change of the light that the forces do not explain.
    """

    force_n: Array
    displacement_mm: Array
    covariance: Array
    gain: float
    unexplained: float


@dataclass(frozen=True, eq=False)
class NormalReading:
    """Normal motion of the c surface nodes in one frame.

    Attributes:
        w_mm: (c,) motion along z, negative where the gel is pressed in.
        sigma_mm: (c,) standard deviation of `w_mm`.
        touched: (c,) nodes in contact; None where the source does not know them.
        patch: The contact patch found in the picture; None where nothing touches.
        depth_mm: Depth of the indenter's lowest point below the rest surface.
        problem: Why the motion is unknown; the arrays are then NaN. Empty otherwise.
        forces: Forces found together with the motion; None where they follow from it.
    """

    w_mm: Array
    sigma_mm: Array
    touched: NDArray[np.bool_] | None
    patch: ContactPatch | None = None
    depth_mm: float = 0.0
    problem: str = ""
    forces: FoundForces | None = None

    @classmethod
    def unknown(cls, count: int, problem: str) -> NormalReading:
        """Reading of `count` nodes whose motion is not known, with the reason."""
        nan = np.full(count, np.nan)
        return cls(nan, nan, None, depth_mm=np.nan, problem=problem)

    @property
    def known(self) -> bool:
        """Whether there is a motion."""
        return not self.problem

    def summary(self) -> dict[str, object]:
        """What was found of the contact, as plain numbers."""
        if self.forces is not None:
            return {
                "touched": True,
                "depth_mm": float(self.depth_mm),
                "gain": self.forces.gain,
                "unexplained": self.forces.unexplained,
            }
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


class NormalSource(Protocol):
    """Finds the normal motion of each frame in two steps, as `IndenterSource` does.

    The steps are apart because the motion depends on the lateral motion of the touched gel, which
    is known only once the picture has been looked at; `motion` may be called twice per frame.
    """

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> Any:
        """Take what is needed from the picture.

        Args:
            image: (h, w, 3) or (h, w) the frame.
            markers_px: (n, 2) positions of the markers; NaN for lost ones.

        Returns:
            Anything that `motion` understands; None where the picture shows no contact.
        """

    def motion(self, seen: Any, lateral_mm: Array | None = None) -> NormalReading:
        """Return the normal motion.

        Args:
            seen: What `look` returned for this frame.
            lateral_mm: (2,) lateral motion of the gel where it is touched; None if unknown.
        """


@runtime_checkable
class Remembering(Protocol):
    """A normal source that keeps something from frame to frame."""

    def reset(self) -> None:
        """Forget the last frame."""
