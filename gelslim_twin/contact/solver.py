"""Contact of a rigid tool with a linear gel: who touches, and with which force.

With u = C f, n the normal into the tool where a node is now and t across it, at each pose

    n·u <= h,  n·f <= 0,  no force across a gap
    |f_t| <= μ |n·f|;  slip against the tool is 0 inside the cone and opposed to f_t on it

(Kalker 1990; for the forces see `coulomb_balance`). Normals and heights h follow the nodes: the
tool is a plane at each of them, put anew until no node is off its surface. Nodes in reach grow
until none outside them touches. A pose that is not reached in one step is approached in halves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.contact.coulomb_balance import STICK
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.halved_path import between, reached, rests
from gelslim_twin.contact.held_state import HeldState, held_mm
from gelslim_twin.contact.settling import Settled, Settling, room_to_tool, slack_mm
from gelslim_twin.contact.tool import Tool
from gelslim_twin.contact.tool_surface import ToolSurface, clearance_mm, tool_surface
from gelslim_twin.scene.pose import Pose

Nodes = NDArray[np.intp]
SPARE = 1.5
"""How much larger than needed a kept block may be before a smaller one is gathered."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Nodes (n,) in reach, in the order they came, and their compliance (3n, 3n)."""

    nodes: Nodes
    block: NDArray[np.float32]

    def including(self, wanted: NDArray[np.bool_], compliance: SurfaceCompliance) -> Reach:
        """One that has all `wanted` (c,) nodes, and not too many others."""
        count = int(wanted.sum())
        inside = np.zeros(len(wanted), dtype=bool)
        inside[self.nodes] = True
        new = np.flatnonzero(wanted & ~inside)
        if len(self.nodes) + len(new) > SPARE * count:
            return reach_of(wanted, compliance)
        if len(new) == 0:
            return self
        nodes = np.concatenate([self.nodes, new])
        return Reach(nodes, compliance.block(nodes, self.block))


def reach_of(wanted: NDArray[np.bool_], compliance: SurfaceCompliance) -> Reach:
    """One that has the `wanted` (c,) nodes only."""
    nodes = np.flatnonzero(wanted)
    return Reach(nodes, compliance.block(nodes))


__all__ = ["ContactError", "ContactSettings", "ContactSolver"]

Array = NDArray[np.float64]
REACH = 0.2
"""Share of the depth by which the tool may stand over a node in reach: the gel bulges."""
GROWTH_STEPS = 12
MOST_SUBSTEPS = 200


@dataclass(frozen=True)
class ContactSettings:
    """When a contact counts as found."""

    tolerance: float = 1e-3
    """Largest error of the field of forces, relative (root of the sums of squares). See
    `settling` for what balance and geometry may use of it."""
    friction: float = 0.0
    longest_step: float = 1.0
    """Farthest that a touched node may be dragged in one step with friction, in cell sizes."""
    halvings: int = 6


@dataclass(eq=False)
class ContactSolver:
    """Follows a tool along poses; remembers nothing but which compliance it read last."""

    compliance: SurfaceCompliance
    tool: Tool
    settings: ContactSettings

    def __post_init__(self) -> None:
        mesh = self.compliance.bundle.mesh
        self.points_mm = np.asarray(mesh.surface_mm)
        self._cell = min(mesh.cell_size_mm[:2])
        self._longest = self.settings.longest_step * self._cell
        self._reach: Reach | None = None

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, from the untouched gel on. Raises ContactError."""
        state, before = GelState.at_rest(len(self.points_mm)), None
        for pose in poses:
            if before is None or not rests(before, pose):
                state = self.advanced(state, before, pose)
            before = pose
            yield state
        self.compliance.store()

    def advanced(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        """State at `pose`, in as many steps as the drag and the solver ask for."""
        state = last
        for middle in self.steps_to(last, before, pose):
            if before is None:
                state = self.step(state, None, middle)
            else:
                state = reached(self.step, state, before, middle, self.settings.halvings)
            before = middle
        return state

    def steps_to(self, last: GelState, before: Pose | None, pose: Pose) -> Iterator[Pose]:
        """Poses on the way to `pose`, itself included, that drag no touched node too far at once.

        Without friction the path does not matter: there is one.
        """
        touched = last.touch > 0
        count = 1
        if before is not None and self.settings.friction > 0 and touched.any():
            places = (self.points_mm + last.displacement_mm)[touched]
            dragged = np.hypot(*(self.tool.carried(before, pose, places) - places)[:, :2].T).max()
            count = min(MOST_SUBSTEPS, max(1, math.ceil(dragged / self._longest - 1e-9)))
        return iter((pose,)) if before is None else between(before, pose, count)

    def step(
        self,
        last: GelState,
        before: Pose | None,
        pose: Pose,
        offset_mm: Array | None = None,
        start: GelState | None = None,
    ) -> GelState:
        """State at `pose` after `last` at `before`, in one step; raises ContactError.

        `offset_mm` (c, 3) is a motion that is there without contact forces: how a nonlinear gel
        differs from C. `start` has forces and places to begin with.
        """
        offset = np.zeros_like(self.points_mm) if offset_mm is None else offset_mm
        target, ahead = self.targets(last, before, pose)
        below = clearance_mm(self.tool, pose, self.points_mm + ahead * [1.0, 1.0, 0.0])
        on_tool = np.isfinite(below)
        depth = -float(np.min(below, initial=0.0))
        moved = (last if start is None else start).displacement_mm
        guess = (last if start is None else start).force_n
        wanted = np.zeros(len(moved), dtype=bool)
        for _ in range(GROWTH_STEPS):
            surface, room = self._room(pose, moved, offset, on_tool)
            deepest = -float(np.min(room, initial=0.0))
            if min(deepest, depth) <= 0:
                return replace(GelState.at_rest(len(moved)), displacement_mm=offset.copy())
            wanted |= room < REACH * deepest
            self._reach = self._reached(wanted)
            nodes = self._reach.nodes
            settling = Settling(
                self.tool, pose, self._reach.block, self.points_mm[nodes], offset[nodes],
                target[nodes], wanted[nodes], self.settings.friction, self.settings.tolerance,
                deepest,
            )  # fmt: skip
            found = settling.settled(surface.at(nodes), moved[nodes], guess[nodes])
            state, gap = self._state(nodes, found, pose, offset, target, deepest)
            into = (gap < -slack_mm(self.settings.tolerance, deepest)) & ~wanted
            if not into.any():
                return state
            wanted, on_tool = wanted | into, on_tool | into
            moved, guess = state.displacement_mm, state.force_n
        raise ContactError("the region of contact keeps growing: take smaller steps of the motion")

    def targets(self, last: GelState, before: Pose | None, pose: Pose) -> tuple[Array, Array]:
        """Motion (c, 3) of each node if it stuck from its first touch on, and the likely motion."""
        u = held_mm(last)
        if before is None:
            return u, u
        places = self.points_mm + u
        dragged = self.tool.carried(before, pose, places) - places
        touched = last.touch > 0
        ahead = u + np.where(touched[:, None], dragged, 0.0)
        if self.settings.friction == 0 or not dragged.any():
            return u + dragged, ahead
        # Others go along for the part of the step in which they touch.
        heights = [clearance_mm(self.tool, p, places) for p in (before, pose)]
        share = np.where(np.isfinite(heights[0]), 0.0, 0.5)
        closing = np.isfinite(heights[0]) & np.isfinite(heights[1]) & (heights[1] < 0)
        first = np.maximum(heights[0][closing], 0.0)
        share[closing] = heights[1][closing] / (heights[1][closing] - first)
        share[touched] = 1.0
        return u + share[:, None] * dragged, ahead

    def _room(
        self, pose: Pose, moved: Array, offset: Array, on_tool: NDArray[np.bool_]
    ) -> tuple[ToolSurface, Array]:
        """The tool over all nodes, and how far each may move along its normal by forces (c,)."""
        places = self.points_mm + moved
        # Slopes matter near the gel only, and cost four more looks at the tool.
        surface = tool_surface(self.tool, pose, places, reach_mm=self._cell).only(on_tool)
        return surface, room_to_tool(surface, places, moved - offset)

    def _state(
        self,
        nodes: Nodes,
        found: Settled,
        pose: Pose,
        offset: Array,
        target: Array,
        deepest: float,
    ) -> tuple[HeldState, Array]:
        """The whole surface, and gaps (c,) of all nodes."""
        balance = found.balance
        u = self.compliance.displacement(nodes, balance.force_n, balance.motion_mm) + offset
        gap = clearance_mm(self.tool, pose, self.points_mm + u)
        gap[nodes] = found.gap_mm
        force, touch = np.zeros_like(u), np.zeros(len(u), dtype=np.int8)
        force[nodes], touch[nodes] = balance.force_n, balance.touch
        push = np.linalg.norm(balance.force_n, axis=1)
        most = float(push.max(initial=0.0))
        across = np.abs(push * np.where(push > 0, found.gap_mm, 0.0)).max(initial=0.0)
        report = {
            "residual": balance.residual,
            "penetration_mm": max(0.0, -float(found.gap_mm.min(initial=0.0))),
            "complementarity": float(across / (most * deepest)) if most > 0 else 0.0,
            "iterations": float(found.sweeps),
        }
        held = np.where((touch == STICK)[:, None], target, u)
        return HeldState(u, force, touch, report, held), gap

    def _reached(self, wanted: NDArray[np.bool_]) -> Reach:
        if self._reach is None:
            return reach_of(wanted, self.compliance)
        return self._reach.including(wanted, self.compliance)
