"""Contact of a linear viscoelastic gel: forces and shape depend on the history of both.

One relaxation function g holds for all moduli, so that the surface moves as the elastic one does
under the forces F of which the contact forces f are the hereditary integral (Christensen, Theory of
Viscoelasticity, 1.2):

    u(t) = C F(t),    f(t) = integral of g(t - s) dF(s).

Over a step in which F runs straight, the internal variables v_i = C q_i of `prony` give

    f = a F + b,    u = C f / a + d,    a = 1 - sum of g_i (1 - m_i),
    d = -(sum of g_i (e_i v_i - m_i u)) / a

with v_i and u at its start. So a step is a contact of the elastic gel under the forces f / a, on a
surface that without forces has the shape d: the dent that is left of former contacts. No force is
assumed to stay at its node: the contact grows, shrinks and moves, and a surface that the tool has
left recovers. The internal variables are displacements of the surface, so that a step multiplies
nothing by C that the elastic contact does not.

The only approximation is the straight course of F over a step. `steps` divides the way to a pose.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.load_steps import even_steps, with_halved_steps
from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurfaceMemory:
    """What the gel keeps of its history.

    Attributes:
        motion_mm: Displacement (c, 3) of the surface.
        internal_mm: Internal variables v_i (k, c, 3), one per term of the series.
    """

    motion_mm: Array
    internal_mm: Array

    @classmethod
    def at_rest(cls, series: PronySeries, nodes: int) -> SurfaceMemory:
        """That of a gel that has not been touched."""
        return cls(np.zeros((nodes, 3)), np.zeros((len(series.fractions), nodes, 3)))

    def unloaded(self, series: PronySeries, step_s: float) -> tuple[float, Array]:
        """Stiffness a over the instantaneous one, and shape d (c, 3), after a step without force.

        A step of 0 s is a jump.
        """
        stiffness, course = 1.0, np.zeros_like(self.motion_mm)
        for (fraction, kept, mean), internal in zip(
            series.factors(step_s), self.internal_mm, strict=True
        ):
            stiffness -= fraction * (1.0 - mean)
            course += fraction * (mean * self.motion_mm - kept * internal)
        return stiffness, course / stiffness

    def after(self, series: PronySeries, step_s: float, motion_mm: Array) -> SurfaceMemory:
        """The memory after a step of `step_s` seconds to the displacement (c, 3)."""
        change = motion_mm - self.motion_mm
        internal = np.empty_like(self.internal_mm)
        for k, (_, kept, mean) in enumerate(series.factors(step_s)):
            internal[k] = kept * self.internal_mm[k] + mean * change
        return SurfaceMemory(motion_mm, internal)


@dataclass(frozen=True, eq=False)
class ViscoelasticState:
    """The elastic contact that stands for the gel, with forces f / a, its a, and the memory."""

    elastic: GelState
    stiffness: float
    memory: SurfaceMemory

    @property
    def gel(self) -> GelState:
        """The gel with the forces f."""
        return replace(self.elastic, force_n=self.stiffness * self.elastic.force_n)


@dataclass(frozen=True)
class ViscoelasticContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, on a gel with memory."""

    solver: ContactSolver
    series: PronySeries
    steps: int = 1
    """Steps to each pose, besides those that friction asks for."""

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        if self.series.is_null:
            yield from self.solver.states(poses)
            return
        state, before = self.at_rest(), None
        for pose in poses:
            state = self.advanced(state, before, pose)
            before = pose
            yield state.gel
        self.solver.compliance.store()

    def at_rest(self) -> ViscoelasticState:
        """A gel that has not been touched."""
        nodes = len(self.solver.points_mm)
        memory = SurfaceMemory.at_rest(self.series, nodes)
        return ViscoelasticState(GelState.at_rest(nodes), 1.0, memory)

    def advanced(
        self, last: ViscoelasticState, before: Pose | None, pose: Pose
    ) -> ViscoelasticState:
        """State at `pose` from the state `last` at `before`; raises ContactError.

        A gel at rest whose tool stands still changes nevertheless. Without a pose before, the tool
        jumps to the first one.
        """
        if before is None:
            return self._step(last, None, pose)
        state, start = last, before
        for middle in self.solver.steps_to(last.elastic, before, pose):
            for end in even_steps(start, middle, self.steps):
                state = with_halved_steps(
                    self._step, state, start, end, self.solver.settings.halvings
                )
                start = end
        return state

    def _step(self, last: ViscoelasticState, before: Pose | None, pose: Pose) -> ViscoelasticState:
        step_s = 0.0 if before is None else pose.time_s - before.time_s
        stiffness, shape = last.memory.unloaded(self.series, step_s)
        found = self.solver.step(last.elastic, before, pose, shape, offset_is_free=True)
        memory = last.memory.after(self.series, step_s, found.displacement_mm)
        return ViscoelasticState(found, stiffness, memory)
