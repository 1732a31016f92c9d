"""Contact of a rigid tool with a linear gel: who touches, and with which force.

At each pose the nodes in reach obey, with u = C f (Kalker 1990; block Gauss-Seidel as in Jourdan,
Alart and Jean 1998):

    u_z <= h,  f_z <= 0,  f_z (u_z - h) = 0     the tool's height h over each node
    |f_t| <= μ |f_z|,  sticking nodes move with the tool

The tool's height is taken where the node is now, so it is evaluated again as the gel moves
sideways. Nodes in reach grow until none outside them touches.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.tool import Tool
from gelslim_twin.scene.pose import Pose
from gelslim_twin.simulation.gel_state import GelState
from ifem_export.errors import IfemError

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
MOST_SWEEPS = 4000
CHECK_EVERY = 4
REACH = 0.15
"""Share of the depth by which the tool may stand over a node in reach: the gel bulges."""
GEOMETRY_STEPS = 3


class ContactError(IfemError):
    """A contact that was not found; the message says how far the solver came."""


@dataclass(frozen=True)
class ContactSettings:
    """When a contact counts as found."""

    tolerance: float = 1e-3
    """Last change of a force over the largest force."""
    friction: float = 0.0


@dataclass(frozen=True, eq=False)
class Reach:
    """Nodes in reach with their compliance."""

    nodes: Nodes
    block: Array
    inverse: Array
    """(n, 3, 3) of the diagonal blocks."""


@dataclass(eq=False)
class ContactSolver:
    """Follows a tool along poses; remembers the last state, nothing else.

    `offset_mm` (c, 3) is a motion that is there without contact forces: how a nonlinear gel
    differs from C, see `nonlinear`.
    """

    compliance: SurfaceCompliance
    tool: Tool
    settings: ContactSettings

    def __post_init__(self) -> None:
        self.points_mm = np.asarray(self.compliance.bundle.mesh.surface_mm)
        self._reach: Reach | None = None

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, from the untouched gel on. Raises ContactError."""
        state, before = GelState.at_rest(len(self.points_mm)), None
        for pose in poses:
            state = self.step(state, before, pose)
            before = pose
            yield state
        self.compliance.store()

    def step(
        self,
        last: GelState,
        before: Pose | None,
        pose: Pose,
        offset_mm: Array | None = None,
        start: GelState | None = None,
    ) -> GelState:
        """State at `pose` after `last` at `before`; `start` has forces to begin with."""
        guess = start or last
        now = guess
        for turn in range(GEOMETRY_STEPS):
            height = self._height(pose, now.displacement_mm)
            lateral = self._lateral(last, before, pose)
            solved = self._solve(height, lateral, now.force_n, offset_mm)
            moved = np.abs((solved.displacement_mm - now.displacement_mm)[:, :2]).max()
            now = solved
            if turn and moved < 1e-4:
                break
        return now

    def _height(self, pose: Pose, moved_mm: Array) -> Array:
        """(c,) height of the tool over each node's rest place, seen where the node is now."""
        places = self.points_mm[:, :2] + moved_mm[:, :2]
        return self.tool.height_mm(pose, places[:, 0], places[:, 1]) - self.points_mm[:, 2]

    def _lateral(self, last: GelState, before: Pose | None, pose: Pose) -> Array:
        """(c, 2) lateral motion of the nodes if they went along with the tool."""
        if before is None:
            return np.asarray(last.displacement_mm[:, :2])
        places = self.points_mm + last.displacement_mm
        carried = self.tool.carried(before, pose, places)
        return np.asarray(last.displacement_mm[:, :2] + (carried - places)[:, :2])

    def _solve(
        self, height: Array, lateral: Array, start_n: Array, offset_mm: Array | None
    ) -> GelState:
        offset = np.zeros_like(self.points_mm) if offset_mm is None else offset_mm
        free_height = height - offset[:, 2]
        deepest = -float(np.min(free_height, initial=0.0))
        count = len(height)
        if deepest <= 0:
            return replace(GelState.at_rest(count), displacement_mm=offset.copy())
        wanted = free_height < REACH * deepest
        for _ in range(6):
            reach = self._reached(np.flatnonzero(wanted))
            f, touch, sweeps, change = self._balanced(
                reach, free_height, lateral - offset[:, :2], start_n
            )
            u = self.compliance.displacement(reach.nodes, f) + offset
            outside = (u[:, 2] > height + 1e-4 * deepest) & ~wanted
            if not outside.any():
                break
            wanted |= outside
        force, touched = np.zeros((count, 3)), np.zeros(count, dtype=np.int8)
        force[reach.nodes], touched[reach.nodes] = f, touch
        gap = height[reach.nodes] - u[reach.nodes, 2]
        push = -f[:, 2]
        scale = max(float(push.max(initial=0.0)) * deepest, 1e-300)
        report = {
            "residual": change,
            "penetration_mm": float(np.max(u[:, 2] - height, initial=0.0)),
            "complementarity": float(np.abs(push * gap)[push > 0].max(initial=0.0) / scale),
            "iterations": float(sweeps),
        }
        return GelState(u, force, touched, report)

    def _balanced(
        self, reach: Reach, height: Array, lateral: Array, start_n: Array
    ) -> tuple[Array, NDArray[np.int8], int, float]:
        """Forces (n, 3), who sticks and slips, sweeps taken and the last relative change."""
        from gelslim_twin.contact.kernel import sweep

        nodes = reach.nodes
        f = np.ascontiguousarray(start_n[nodes]).reshape(-1)
        if self.settings.friction == 0:
            f.reshape(-1, 3)[:, :2] = 0.0
        u = reach.block @ f
        touch = np.zeros(len(nodes), dtype=np.int8)
        target = np.ascontiguousarray(lateral[nodes])
        tops = np.ascontiguousarray(height[nodes])
        change = np.inf
        for done in range(1, MOST_SWEEPS + 1):
            moved = sweep(
                reach.block, reach.inverse, tops, target, self.settings.friction, f, u, touch
            )
            largest = float(np.abs(f).max(initial=0.0))
            change = moved / largest if largest > 0 else 0.0
            if change <= self.settings.tolerance * 0.1:
                return f.reshape(-1, 3), touch, done, change
        raise ContactError(
            f"the contact of {len(nodes)} nodes is not found after {MOST_SWEEPS} sweeps: forces "
            f"still change by {change:.1e} of the largest; take smaller steps, a lower friction "
            "or a larger tolerance"
        )

    def _reached(self, nodes: Nodes) -> Reach:
        if self._reach is None or not np.array_equal(self._reach.nodes, nodes):
            block = np.ascontiguousarray(self.compliance.block(nodes))
            grid = block.reshape(len(nodes), 3, len(nodes), 3)
            own = grid[np.arange(len(nodes)), :, np.arange(len(nodes)), :]
            self._reach = Reach(nodes, block, np.ascontiguousarray(np.linalg.inv(own)))
        return self._reach
