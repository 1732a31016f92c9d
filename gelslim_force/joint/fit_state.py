"""What a fit of contact forces starts from, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light.rows import LightRows
from gelslim_force.joint.light.view import SeenLight
from gelslim_force.joint.markers.rows import MarkerRows
from gelslim_force.joint.markers.taken_drift import TakenDrift
from gelslim_force.joint.normal_equations import Linearised, NormalEquations
from gelslim_force.joint.responses import Responses
from gelslim_force.joint.strained_gel import Excess
from gelslim_force.motion.marker_motion import MarkerRays
from ifem_export.inverse.newton_within import FreeForces

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FrameData:
    """Data of a frame.

    Attributes:
        seen: Its light; None where the markers alone are used.
        markers: Rays of the followed markers.
        noise_px: Standard deviation of their positions.
        taken: What the correction of drift takes off their motion; None where none is corrected.
    """

    seen: SeenLight | None
    markers: MarkerRays
    noise_px: float
    taken: TakenDrift | None = None

    @property
    def noise_mm(self) -> Array:
        """(n,) standard deviation of the markers' places by the noise of the image."""
        return np.asarray(self.noise_px * self.markers.view.mean_mm_per_px)


@dataclass(frozen=True, eq=False)
class GelMotion:
    """Motion of the surface under forces; it is computed when it is asked for.

    Attributes:
        responses: Of the gel.
        nodes: (p,) nodes with forces.
        force_n: (p, 3) on them.
        excess: What a gel at large strain moves further.
    """

    responses: Responses
    nodes: NDArray[np.intp]
    force_n: Array
    excess: Excess

    @cached_property
    def linear_mm(self) -> Array:
        """(c, 3) of a linear gel."""
        return self.responses.displacement(self.nodes, self.force_n)

    @property
    def is_known(self) -> bool:
        """Whether it is computed already."""
        return "linear_mm" in self.__dict__

    @cached_property
    def displacement_mm(self) -> Array:
        """(c, 3) of the gel."""
        return self.linear_mm + self.excess.moved_mm


@dataclass(frozen=True, eq=False)
class SoughtForces:
    """The q forces that equations seek.

    Attributes:
        sums: (6, q) force, and torque about the origin, by 1 N of each.
        free: (q,) those that vary; the others stay 0.
        varied: The same as directions within the limits of the forces, already solved for; None
            where no directions were.
    """

    sums: Array
    free: Mask
    varied: FreeForces | None = None

    def spread_of(self, wanted: Array, equations: NormalEquations) -> Array:
        """Product (k, q) of linear functions (k, q) of the forces with their covariance."""
        if self.varied is not None:
            return self.varied.spread_of(wanted)
        return equations.spread_of(wanted, self.free)


@dataclass(frozen=True, eq=False)
class FitState:
    """An estimate.

    Attributes:
        force_n: (c, 3) on the surface nodes.
        motion: Of the surface nodes.
        gain: Of the light.
        equations: That it solves; None for a start.
        sought: Forces of these equations; None for a start.
        markers: Data of the markers that it explains; None for a start.
        unexplained: Share of the change of light that is left.
        data: Linear data that it solves; None for a start.
        height_mm: (m,) of the nodes in and around the contact; None where all have to be looked at.
        wider_n: (c, 3) forces before the last nodes were removed; None where none were.
        light: Data of the light that it explains; None without light and for a start.
        relief: (c, k) light at the nodes over that of the slopes alone, by heights near these; None
            where it is not known.
    """

    force_n: Array
    motion: GelMotion
    gain: float
    equations: NormalEquations | None = None
    sought: SoughtForces | None = None
    markers: MarkerRows | None = None
    unexplained: float = 0.0
    data: Linearised | None = None
    height_mm: Array | None = None
    wider_n: Array | None = None
    light: LightRows | None = None
    relief: Array | None = None

    @classmethod
    def at_rest(cls, responses: Responses, nodes: int) -> FitState:
        """The gel without contact."""
        still, none = np.zeros((nodes, 3)), np.zeros(0, dtype=np.intp)
        return cls(still, GelMotion(responses, none, still[none], Excess(still)), 1.0)

    @property
    def displacement_mm(self) -> Array:
        """(c, 3) motion of the surface nodes."""
        return self.motion.displacement_mm

    @property
    def near_mm(self) -> Array:
        """Heights (m,) of the nodes in and around the contact, or of all."""
        return self.displacement_mm[:, 2] if self.height_mm is None else self.height_mm

    @property
    def depth_mm(self) -> float:
        """Depth of the contact: how far its lowest node has moved down."""
        return -float(self.near_mm.min(initial=0.0))

    def linear_mm(self, nodes: NDArray[np.intp], near: NDArray[np.bool_]) -> Array:
        """Motion (c, 3) of a linear gel under the forces on some nodes only.

        Most forces act there: where the motion under all is known, that by the others is taken off.

        Args:
            nodes: (p,) the nodes.
            near: (c,) the same as a mask.
        """
        motion, move = self.motion, self.motion.responses.displacement
        others = np.flatnonzero(self.force_n.any(axis=1) & ~near)
        if not len(others):
            return motion.linear_mm
        if not motion.is_known:
            return move(nodes, self.force_n[nodes])
        return motion.linear_mm - move(others, self.force_n[others])

    def share_beside(self, nodes: Mask) -> float:
        """Size of the resultant on all nodes but these (c,), over that on all nodes."""
        beside, whole = self.force_n[~nodes].sum(axis=0), self.force_n.sum(axis=0)
        return float(np.linalg.norm(beside) / max(float(np.linalg.norm(whole)), 1e-12))

    def near(self, other: FitState, share: float) -> bool:
        """Whether the resultant differs from another one by less than a share of it."""
        force, change = self.force_n.sum(axis=0), (self.force_n - other.force_n).sum(axis=0)
        return bool(np.linalg.norm(change) < share * np.linalg.norm(force))


@dataclass(frozen=True, eq=False)
class JointForces:
    """Forces of one frame.

    Attributes:
        force_n: (c, 3) on the surface nodes.
        displacement_mm: (c, 3) of the surface nodes.
        region: (c,) nodes in contact.
        seen: (c,) nodes that the picture showed as possibly in contact.
        covariance: (6, 6) of force and torque about the origin; the gel is taken as specified.
        by_marker: (6, n, 2) their change in N/px and N mm/px where a marker is seen elsewhere.
        by_gel: (p, 6) their change by ln thickness and by Poisson's ratio of the gel; None where it
            is not computed.
        gain: Gain of the light found in this frame.
        unexplained: Share of the change of light in the region that the forces do not explain.
        shown: (c,) nodes whose slope the light shows; none without light.
        motion: Of the surface nodes.
        relief: As that of `FitState`.
        by_linear_law: Whether they are those of a linear gel because the law at large strain
            explains no motion.
    """

    force_n: Array
    displacement_mm: Array
    region: Mask
    seen: Mask
    covariance: Array
    by_marker: Array
    by_gel: Array | None
    gain: float
    unexplained: float
    shown: Mask
    motion: GelMotion
    relief: Array | None = None
    by_linear_law: bool = False

    @property
    def state(self) -> FitState:
        """What the fit of the next frame starts from."""
        return FitState(self.force_n, self.motion, self.gain, relief=self.relief)
