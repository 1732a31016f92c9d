"""Adhesion of a tacky gel: nodes that touch the tool hold it until their bond breaks.

The attraction has no range, as in the theory of Johnson, Kendall and Roberts (1971): the boundary
of the contact is a crack, which opens where that gives off more elastic energy than the work of
adhesion w per area. On a lattice a node opens at the tension (Pohrt and Popov 2015 for an elastic
half-space; here from the compliance of the pad itself)

    t² s / 2 = c w A,

with its area A, its compliance s at a straight boundary of the contact, beyond which all nodes are
held, and a number c for boundaries that are not straight. For tensions up to t the forces f <= t of
bonded nodes are a contact without adhesion of the forces f - t <= 0, on a surface that is pulled by
t at these nodes. So each set of bonds takes one contact without adhesion. Bonds whose nodes have
left the tool are removed. Then the boundary closes as far as it can hold: neighbours of the contact
are bonded for trial, and those that stay away from the tool are released for the rest of the step.

Tensions act along z, not along the tool's normal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.load_steps import with_halved_steps
from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
Bonds = NDArray[np.bool_]
CURVED = 0.94
"""c, fitted to the pull-off of balls on a half-space with 13 and 18 nodes on the radius without
load."""
ROWS, BESIDE = 4, 5
"""Rows of held nodes beyond a straight boundary, and nodes to either side."""
MOST_TURNS = 400


@dataclass(frozen=True, eq=False)
class AdhesiveState:
    """A contact without adhesion on the pulled surface, and the bonded nodes (c,)."""

    elastic: GelState
    bonded: Bonds


@dataclass(eq=False)
class AdhesiveContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, on a tacky gel."""

    solver: ContactSolver
    work_j_m2: float
    """Work of adhesion in J/m², which is 1e-3 N/mm."""

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the untouched gel. Raises ContactError."""
        if self.work_j_m2 == 0:
            yield from self.solver.states(poses)
            return
        state, before = self.at_rest(), None
        for pose in poses:
            state, before = self.advanced(state, before, pose), pose
            yield self.gel(state)
        self.solver.compliance.store()

    def at_rest(self) -> AdhesiveState:
        """The gel without contact."""
        nodes = len(self.solver.points_mm)
        return AdhesiveState(GelState.at_rest(nodes), np.zeros(nodes, dtype=bool))

    def gel(self, state: AdhesiveState) -> GelState:
        """The gel with the forces that act on it: bonded nodes may be pulled."""
        if not state.bonded.any():
            return state.elastic
        force = state.elastic.force_n.copy()
        force[:, 2] += np.where(state.bonded, self.tension_n, 0.0)
        return replace(state.elastic, force_n=force)

    def advanced(self, last: AdhesiveState, before: Pose | None, pose: Pose) -> AdhesiveState:
        """State at `pose` from the state `last` at `before`; raises ContactError."""
        if before is None:
            return self._step(last, None, pose)
        state, start = last, before
        for end in self.solver.steps_to(last.elastic, before, pose):
            halvings = self.solver.settings.halvings
            state = with_halved_steps(self._step, state, start, end, halvings)
            start = end
        return state

    @cached_property
    def tension_n(self) -> Array:
        """Largest tension (c,) of the bond of each node in N."""
        work = 1e-3 * self.work_j_m2
        return np.sqrt(2 * CURVED * work * self._area_mm2 / self._opening_mm_per_n)

    @cached_property
    def _neighbours(self) -> NDArray[np.intp]:
        """(c, 9) surface nodes around each and itself; the number of nodes where there is none."""
        points = self.solver.points_mm[:, :2]
        pitch = np.asarray(self.solver.compliance.bundle.mesh.cell_size_mm[:2])
        site = np.rint((points - points.min(axis=0)) / pitch).astype(int) + 1
        lattice = np.full(site.max(axis=0) + 2, len(points))
        lattice[site[:, 0], site[:, 1]] = np.arange(len(points))
        ways = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        return np.stack([lattice[site[:, 0] + i, site[:, 1] + j] for i, j in ways], axis=1)

    @cached_property
    def _area_mm2(self) -> Array:
        """Area (c,) of the surface that belongs to each node: a quarter of each cell around it."""
        there = self._neighbours < len(self._neighbours)
        cells = [there[:, list(corner)].all(axis=1) for corner in ((0, 1, 3), (1, 2, 5), (3, 6, 7),
                                                                   (5, 7, 8))]  # fmt: skip
        width, depth = self.solver.compliance.bundle.mesh.cell_size_mm[:2]
        return np.asarray(np.sum(cells, axis=0) * width * depth / 4)

    @cached_property
    def _opening_mm_per_n(self) -> float:
        """Compliance s of a node in the middle of the pad with all nodes on one side of it held."""
        points = self.solver.points_mm[:, :2]
        dx, dy = self.solver.compliance.bundle.mesh.cell_size_mm[:2]
        middle = int(np.argmin(np.hypot(*(points - (points.min(0) + points.max(0)) / 2).T)))
        x, y = ((points - points[middle]) / [dx, dy]).T
        held = (x < -0.5) & (x > -ROWS - 0.5) & (np.abs(y) < BESIDE + 0.5)
        nodes = np.concatenate([[middle], np.flatnonzero(held)])
        normal = np.asarray(self.solver.compliance.block(nodes), dtype=float)[2::3, 2::3]
        return float(normal[0, 0] - normal[0, 1:] @ np.linalg.solve(normal[1:, 1:], normal[1:, 0]))

    def _step(self, last: AdhesiveState, before: Pose | None, pose: Pose) -> AdhesiveState:
        bonded, released = last.bonded.copy(), np.zeros_like(last.bonded)
        found: GelState | None = None
        for _ in range(MOST_TURNS):
            found = self.solver.step(
                last.elastic, before, pose, self._pulled(bonded), found, offset_is_free=True
            )
            touches = found.touch > 0
            if (bonded & ~touches).any():
                released |= bonded & ~touches
                bonded &= touches
                continue
            beside = np.append(touches, False)[self._neighbours].any(axis=1)
            closing = beside & ~bonded & ~released
            if not closing.any():
                return AdhesiveState(found, bonded)
            bonded |= closing
        raise ContactError(
            f"the bonds of the contact still change after {MOST_TURNS} contacts: take smaller steps"
        )

    def _pulled(self, bonded: Bonds) -> Array:
        """Displacement (c, 3) under the largest tensions of the bonds."""
        nodes = np.flatnonzero(bonded)
        if len(nodes) == 0:
            return np.zeros_like(self.solver.points_mm)
        force = np.zeros((len(nodes), 3))
        force[:, 2] = self.tension_n[nodes]
        return self.solver.compliance.displacement(nodes, force)
