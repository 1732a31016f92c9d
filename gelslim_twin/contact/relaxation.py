"""Viscoelastic relaxation of the nodal forces: a Prony series in recursive internal variables.

The gel is linear viscoelastic with one relaxation function for all moduli, so that for prescribed
displacements the force is the hereditary integral of the elastic one (Christensen, Theory of
Viscoelasticity, 1.2):

    F(t) = F_e(t) - sum of g_i (F_e(t) - q_i(t)),   q_i' = F_e' - q_i / tau_i.

Between two poses the elastic force runs straight, for which the update of q_i is exact (`prony`),
whatever the step. The surface is taken to follow the elastic solution:
exact while nodes in contact stay in contact. A node that the indenter leaves loses its force at
once, although the real surface would follow for a moment; tensile forces are set to zero. For the
shape of such a surface see `viscoelastic_contact`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RelaxationState:
    """Internal variables: elastic force (n, 3) in N and q_i (k, n, 3), one per term."""

    elastic_n: Array
    internal_n: Array


def at_rest(series: PronySeries, nodes: int) -> RelaxationState:
    """The state of a gel that has not been touched."""
    return RelaxationState(np.zeros((nodes, 3)), np.zeros((len(series.fractions), nodes, 3)))


def relax(
    series: PronySeries, state: RelaxationState, elastic_n: ArrayLike, step_s: float
) -> tuple[Array, RelaxationState]:
    """The relaxed force (n, 3) after a step of `step_s` seconds to the elastic force (n, 3).

    A step of 0 s is a jump. Returns the force on the gel and the state for the next step; without
    relaxation the force is the elastic one bit for bit.
    """
    new = np.asarray(elastic_n, dtype=float)
    change = new - state.elastic_n
    internal = np.empty_like(state.internal_n)
    force = new.copy()
    for k, (g, kept, mean) in enumerate(series.factors(step_s)):
        internal[k] = kept * state.internal_n[k] + mean * change
        if g:
            force -= g * (new - internal[k])
    # A zero keeps its sign where nothing decays.
    held = force if series.is_null else _held(force, new)
    return held, RelaxationState(new.copy(), internal)


def _held(force: Array, elastic: Array) -> Array:
    """`force` without nodes that are free, and without tensile forces."""
    pulled = (force[:, 2] > 0) & (elastic[:, 2] <= 0)
    free = ~elastic.any(axis=1)
    force[pulled | free] = 0.0
    return force


@dataclass(frozen=True)
class RelaxingContact:
    """Contacts of an elastic gel whose forces relax."""

    elastic: Any
    """Solver of the elastic contact, with the method `states`."""
    series: PronySeries

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """The elastic states with relaxed forces."""
        memory: RelaxationState | None = None
        before = poses[0]
        for pose, state in zip(poses, self.elastic.states(poses), strict=True):
            memory = memory or at_rest(self.series, len(state.force_n))
            step_s = pose.time_s - before.time_s
            force, memory = relax(self.series, memory, state.force_n, step_s)
            before = pose
            yield replace(state, force_n=force)
