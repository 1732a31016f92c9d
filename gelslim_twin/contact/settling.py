"""Forces under a tool that is curved: its planes are put anew where the nodes come to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.contact.coulomb_balance import Balance, balanced
from gelslim_twin.contact.tool import Tool
from gelslim_twin.contact.tool_surface import ToolSurface, tool_surface
from gelslim_twin.contact.turning import EvenTurns, HalvedTurns, Turning
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
GEOMETRY_STEPS = 40
DAMPED_FROM = 8
EDGES_FROM, EDGE = 20, 1e-3
"""Turns after which a node astride an edge may stay this share of the depth off the tool."""
EDGE_MM = 5e-5
"""Off an edge in any case, whatever the tolerance: far below what a cell of the gel resolves."""
BALANCE, OFF, MOST_OFF = 0.5, 0.1, 1e-2
"""Shares of the tolerance: the balance's, and how far off the tool nodes may be over the depth."""
ROUNDING_MM = 1e-8
"""Slopes by differences do not find planes more closely."""
FINER, FINEST = 0.1, 1e-4
LOOSE, AHEAD = 0.1, 0.1
"""Balances on the way: the first one's tolerance, then this share of how far nodes were off."""


@dataclass(frozen=True, eq=False)
class Settling:
    """Nodes (n,) in reach of a tool at a pose, and what they are to find."""

    tool: Tool
    pose: Pose
    block: NDArray[np.float32]
    """(3n, 3n)."""
    points_mm: Array
    """(n, 3) at rest."""
    offset_mm: Array
    """(n, 3) there without forces."""
    target_mm: Array
    """(n, 3) motion of nodes that stick."""
    wanted: NDArray[np.bool_]
    """(n,) those that may touch."""
    friction: float
    tolerance: float
    deepest_mm: float

    @property
    def slack_mm(self) -> float:
        """How far off the tool nodes may be."""
        return slack_mm(self.tolerance, self.deepest_mm)

    @property
    def _edge_mm(self) -> float:
        return max(min(self.tolerance, EDGE) * self.deepest_mm, EDGE_MM)

    def settled(self, surface: ToolSurface, motion_mm: Array, force_n: Array) -> Settled:
        """Forces with the tool's planes where the nodes are, from planes, motion and forces.

        Raises ContactError.
        """
        try:
            return self._settled(surface, motion_mm, force_n, EvenTurns())
        except ContactError:
            return self._settled(surface, motion_mm, force_n, HalvedTurns())

    def _settled(
        self, surface: ToolSurface, motion_mm: Array, force_n: Array, turning: Turning
    ) -> Settled:
        shape, u, force, known = surface, motion_mm, force_n, None
        goal, fine = self.target_mm - self.offset_mm, BALANCE * self.tolerance
        sweeps, worst, within = 0, np.inf, max(fine, LOOSE)
        for turn in range(GEOMETRY_STEPS):
            balance = self._balance(shape, u, goal, force, within, known)
            sweeps += balance.sweeps
            force, known = balance.force_n, balance.motion_mm
            new, used = known + self.offset_mm, shape
            shape = tool_surface(self.tool, self.pose, self.points_mm + new, shape)
            gap = shape.gap_mm(self.points_mm + new)
            before, worst = worst, self._worst(gap, balance)
            slack = self.slack_mm if turn < EDGES_FROM else max(self.slack_mm, self._edge_mm)
            if worst <= slack and (within <= fine or self.friction == 0):
                return Settled(balance, used, gap, sweeps)
            if within <= fine:
                # What the balance leaves keeps nodes off the tool.
                fine = max(FINER * fine, FINEST * self.tolerance)
            # Where balances gain little, it is they that keep the nodes off.
            finer = within * (FINER if worst > FINER * before else 1.0)
            within = max(fine, min(finer, AHEAD * worst / self.deepest_mm))
            u_before, u = u, new
            if turn >= DAMPED_FROM:
                # A node astride an edge goes from one flank to the other and back.
                share = turning.share(shape.normal - used.normal)
                mixed = shape.turned(used, share)
                u = u_before + 0.5 * (u - u_before)
                shape = tool_surface(self.tool, self.pose, self.points_mm + u, mixed)
                shape = ToolSurface(shape.met_mm, mixed.normal)
        raise ContactError(
            f"nodes stay {worst:.2g} mm off the tool's surface after {GEOMETRY_STEPS} turns: its "
            "relief is steeper or finer than the gel's cells can follow"
        )

    def _balance(
        self,
        shape: ToolSurface,
        u: Array,
        goal: Array,
        force: Array,
        within: float,
        known: Array | None,
    ) -> Balance:
        frames = shape.frames
        room = room_to_tool(shape, self.points_mm + u, u - self.offset_mm)
        sticking = goal if frames is None else np.einsum("kab,ka->kb", frames, goal)
        return balanced(
            self.block,
            np.where(self.wanted, room, np.inf),
            np.ascontiguousarray(sticking[:, :2]),
            self.friction,
            force,
            within,
            frames,
            known,
        )

    def _worst(self, gap: Array, balance: Balance) -> float:
        off = np.where(balance.touch > 0, gap, np.minimum(gap, 0.0))
        return float(np.abs(off)[self.wanted].max())


@dataclass(frozen=True, eq=False)
class Settled:
    """Forces, the planes they were found with, gaps (n,) to the tool, and the sweeps it took."""

    balance: Balance
    surface: ToolSurface
    gap_mm: Array
    sweeps: int


def slack_mm(tolerance: float, deepest_mm: float) -> float:
    """How far off the tool nodes may be when a contact counts as found."""
    return max(min(OFF * tolerance, MOST_OFF) * deepest_mm, ROUNDING_MM)


def room_to_tool(surface: ToolSurface, points_mm: Array, moved_mm: Array) -> Array:
    """Motion (n,) along the normals that takes points (n, 3) to the tool, with `moved_mm`."""
    return np.asarray(surface.gap_mm(points_mm) + (surface.normal * moved_mm).sum(axis=1))
