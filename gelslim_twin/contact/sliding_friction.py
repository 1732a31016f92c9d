"""Friction whose coefficient depends on the speed of slip, node by node.

Between its values at rest and at large speeds the coefficient follows Stribeck's falling branch in
its exponential form (Bo and Pavelescu 1982),

    mu(w) = mu_k + (mu_s - mu_k) exp(-w / v_s).

A coefficient that fell with the present speed would leave the quasi-static contact without a
unique answer: whatever the length of a step, a part of the contact would jump in it. As in laws of
rate and state (Dieterich 1979, Ruina 1983) the contact therefore remembers. Its w is the mean of
the slip speed v over a memory length L of slip; a node at rest forgets in the time L / v_s,

    dw/dt = (v - w) (v + v_s) / L,

so that steady sliding has mu(v), and what has come to rest has mu_s again. The coefficients of a
step are those of its start. Steps are short against L, which makes their error small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import SLIP
from gelslim_twin.contact.gel_state import AnchoredState, ContactError, GelState
from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SlidingLaw:
    """Coefficient of friction by the speed of slip.

    Attributes:
        static: Coefficient at rest, mu_s.
        kinetic: Coefficient at large speeds, mu_k.
        speed_mm_s: Speed v_s at which 1/e of the difference is left.
        memory_mm: Length L of slip over which the speed is averaged.
    """

    static: float
    kinetic: float
    speed_mm_s: float
    memory_mm: float

    @property
    def is_constant(self) -> bool:
        """Whether the coefficient is the same at all speeds."""
        return self.kinetic == self.static

    def coefficient(self, mean_mm_s: Array) -> Array:
        """mu (n,) at mean slip speeds (n,) in mm/s."""
        fallen = -np.expm1(-mean_mm_s / self.speed_mm_s)
        return np.asarray(self.static + (self.kinetic - self.static) * fallen)

    def mean_after(self, mean_mm_s: Array, slip_mm: Array, step_s: float) -> Array:
        """Mean speeds (n,) after a step with the slips (n,) at a steady speed.

        A step of 0 s is a jump, of which the mean knows nothing.
        """
        if step_s == 0:
            return mean_mm_s
        speed = slip_mm / step_s
        kept = np.exp(-(slip_mm + self.speed_mm_s * step_s) / self.memory_mm)
        return np.asarray(speed + (mean_mm_s - speed) * kept)


@dataclass(frozen=True, eq=False)
class SlidingState(AnchoredState):
    """A state with the mean slip speed (c,) of each node in mm/s; 0 where nothing touches it."""

    slip_mm_s: Array | None = None


@dataclass(eq=False)
class SlidingContact(ContactSolver):
    """`ContactSolver` with coefficients of friction that follow `law`.

    `step_share` is the longest way of the tool in one step over the memory length.
    """

    law: SlidingLaw
    step_share: float = 0.25

    def __post_init__(self) -> None:
        """Raises ContactError for a coefficient at rest other than that of the settings."""
        super().__post_init__()
        if not math.isclose(self.law.static, self.settings.friction):
            raise ContactError(
                f"friction at rest is {self.law.static:g} in the law of sliding and "
                f"{self.settings.friction:g} in the contact; give the same"
            )
        if not self.law.is_constant:
            self._longest = min(self._longest, self.step_share * self.law.memory_mm)
        self._coefficient = np.full(len(self.points_mm), self.law.static)

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """As `ContactSolver.states`; a contact at rest forgets its speed meanwhile."""
        if self.law.is_constant:
            yield from super().states(poses)
            return
        state, before = GelState.at_rest(len(self.points_mm)), None
        for pose in poses:
            state, before = self.advanced(state, before, pose), pose
            yield state
        self.compliance.store()

    def _begin(self, last: GelState, offset_mm: Array) -> None:
        self._coefficient = self.law.coefficient(mean_slip_mm_s(last))

    def _completed(
        self, found: GelState, last: GelState, before: Pose | None, pose: Pose
    ) -> GelState:
        """The state with the mean speed of each node's slip."""
        if not isinstance(found, AnchoredState):
            return found
        step_s = 0.0 if before is None else pose.time_s - before.time_s
        mean = self.law.mean_after(mean_slip_mm_s(last), _slip_mm(found), step_s)
        given = {f.name: getattr(found, f.name) for f in fields(AnchoredState)}
        return SlidingState(**given, slip_mm_s=np.where(found.touch > 0, mean, 0.0))

    def _friction(self, nodes: NDArray[np.intp]) -> Array:
        return self._coefficient[nodes]


def mean_slip_mm_s(state: GelState) -> Array:
    """Mean slip speed (c,) of the nodes of a state; 0 where none is known."""
    known = state.slip_mm_s if isinstance(state, SlidingState) else None
    return np.zeros(len(state.touch)) if known is None else known


def _slip_mm(state: AnchoredState) -> Array:
    """Way (c,) of the slipping nodes along the tool in the last step."""
    slip = np.zeros(len(state.touch))
    if state.touched is None:
        return slip
    nodes, normal = state.touched.nodes, state.touched.normal
    way = state.displacement_mm[nodes] - state.touched.targets.target_mm
    along = way - (way * normal).sum(axis=1)[:, None] * normal
    slips = state.touch[nodes] == SLIP
    slip[nodes] = np.where(slips, np.linalg.norm(along, axis=1), 0.0)
    return slip
