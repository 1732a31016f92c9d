"""What a source of the normal motion offers to the force pipeline, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]


def pressed_sigma_mm(height_mm: Array, sigma_mm: ArrayLike) -> Array:
    """(c,) standard deviation of heights (c,) that are known to be 0 where the gel is at rest.

    A measured depth is off where the gel is pressed in, and by no more than all of it elsewhere:
    an error of the whole surface would be a force on all of the pad.
    """
    return np.asarray(np.minimum(sigma_mm, np.abs(height_mm)))


@dataclass(frozen=True, eq=False)
class FoundForces:
    """Forces that a source found together with the motion.

    Attributes:
        force_n: (c, 3) on the surface nodes.
        displacement_mm: (c, 3) of the surface nodes.
        covariance: (6, 6) of force and torque about the origin.
        by_marker: (6, n, 2) their change in N/px and N mm/px where a marker is seen elsewhere.
        gain: Gain of the light over the light as traced.
        unexplained: Share of the change of the light that the forces do not explain.
        by_gel: (p, 6) change of force and torque by ln thickness and by Poisson's ratio of the gel;
            None where it is that of forces that follow from the motion.
        by_linear_law: Whether they are those of a linear gel because the law at large strain
            explains no motion.
    """

    force_n: Array
    displacement_mm: Array
    covariance: Array
    by_marker: Array
    gain: float
    unexplained: float
    by_gel: Array | None = None
    by_linear_law: bool = False


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
        by_gel_mm: (p, c) derivative of the motion by ln thickness and by Poisson's ratio of the
            gel; None where it does not depend on them, or is not computed.
        push_n: Normal force of the contact model, positive; NaN without one.
        push_sigma_n: Standard deviation of `push_n` from those of the patch and of the depth.
        hidden_n: Standard deviation of the normal force of a contact that is not seen; 0 where one
            is seen, or would be.
        shown: (c,) nodes whose motion the source sees where their markers are lost; None where it
            sees none.
        errors_mm: (p, c) errors of the motion that do not depend on each other, one standard
            deviation of each at all nodes; None where `sigma_mm` is one such error.
    """

    w_mm: Array
    sigma_mm: Array
    touched: NDArray[np.bool_] | None
    patch: ContactPatch | None = None
    depth_mm: float = 0.0
    problem: str = ""
    forces: FoundForces | None = None
    by_gel_mm: Array | None = None
    push_n: float = float("nan")
    push_sigma_n: float = float("nan")
    hidden_n: float = 0.0
    shown: NDArray[np.bool_] | None = None
    errors_mm: Array | None = None

    @classmethod
    def given(cls, count: int, normal_mm: ArrayLike, sigma_mm: ArrayLike) -> NormalReading:
        """Reading of `count` nodes from motions that are given.

        Args:
            count: c.
            normal_mm: (c,) motion along z.
            sigma_mm: Its standard deviation: of all nodes where the gel is pressed in, or (c,) of
                each node.

        Raises:
            ValueError: A shape is another, or a value is not finite or a deviation negative.
        """
        w, sigma = (np.asarray(values, dtype=float) for values in (normal_mm, sigma_mm))
        if w.shape != (count,) or not np.isfinite(w).all():
            raise ValueError(f"normal motion of shape {w.shape}: must be ({count},) and finite")
        if sigma.shape not in ((), (count,)) or not (np.isfinite(sigma) & (sigma >= 0)).all():
            raise ValueError(
                f"standard deviation of the normal motion, of shape {sigma.shape}: must be a "
                f"number or ({count},), finite and at least 0"
            )
        return cls(w, sigma if sigma.ndim else pressed_sigma_mm(w, sigma), None)

    @classmethod
    def unseen(cls, count: int, hidden_n: float, hidden_mm: float) -> NormalReading:
        """Reading of `count` nodes where no contact is seen.

        Args:
            count: c.
            hidden_n: Standard deviation of the normal force of a contact that is not seen.
            hidden_mm: Standard deviation of the height of all nodes together that causes it.
        """
        free = np.zeros(count, dtype=bool)
        return cls(np.zeros(count), np.full(count, hidden_mm), free, hidden_n=hidden_n)

    @classmethod
    def unknown(cls, count: int, problem: str) -> NormalReading:
        """Reading of `count` nodes whose motion is not known, with the reason."""
        nan = np.full(count, np.nan)
        return cls(nan, nan, None, depth_mm=np.nan, problem=problem)

    @property
    def known(self) -> bool:
        """Whether there is a motion."""
        return not self.problem

    @property
    def common_errors_mm(self) -> Array:
        """(p, c) independent errors of the motion, each at all nodes."""
        return self.sigma_mm[None] if self.errors_mm is None else self.errors_mm

    def with_error(self, error_mm: Array) -> NormalReading:
        """The reading with another independent error, whose standard deviation is (c,)."""
        errors = None if self.errors_mm is None else np.vstack([self.errors_mm, error_mm])
        return replace(self, sigma_mm=np.hypot(self.sigma_mm, error_mm), errors_mm=errors)

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
class Prepared(Protocol):
    """A normal source that computes some things when they are first needed."""

    def prepare(self) -> None:
        """Compute them now, so that no frame waits for them."""


@runtime_checkable
class Remembering(Protocol):
    """A normal source that keeps something from frame to frame."""

    def reset(self) -> None:
        """Forget the last frame."""
