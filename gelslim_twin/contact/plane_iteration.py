"""Contact with a curved tool by repeated linearisation: a tangent plane of the tool at each node.

The forces are solved for the present planes, then the planes are moved to the nodes, until no node
is off the tool by more than its share of the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import ContactForces, solve_contact_forces
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool, ToolSurface
from ifem_export.compliance.pad_compliance import NodeCompliance

Array = NDArray[np.float64]
FIRST, GROWTH = 0.5, 1.25
NormalDamping = Callable[[Array], Array]
"""Share (n,) to apply of the changes (n, 3) of the normals in one iteration."""


@dataclass
class AveragedNormals:
    """Every normal becomes the mean of all its values so far."""

    _count: int = 1

    def __call__(self, way: Array) -> Array:
        """Share (n,) to apply of the changes `way` (n, 3)."""
        self._count += 1
        return np.full(len(way), 1 / self._count)


@dataclass
class BisectedNormals:
    """Each node halves its share where the change reverses, and enlarges it where it does not.

    The share stays below its value at the last reversal, so that a node at an edge converges to
    its normal as by bisection (Riedmiller and Braun 1993 for the rule of the signs).
    """

    _share: Array = field(default_factory=lambda: np.zeros(0))
    _most: Array = field(default_factory=lambda: np.zeros(0))
    _way: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __call__(self, way: Array) -> Array:
        """Share (n,) to apply of the changes `way` (n, 3)."""
        if len(self._way) == 0:
            self._share, self._most = np.full(len(way), FIRST), np.ones(len(way))
            self._way = np.zeros_like(way)
        back = (way * self._way).sum(axis=1) < 0
        halved, grown = 0.5 * self._share, np.minimum(GROWTH * self._share, self._most)
        self._share = np.where(back, halved, grown)
        self._most = np.where(back, halved, self._most)
        self._way = way
        return self._share


GEOMETRY_STEPS = 40
DAMPED_FROM = 8
EDGES_FROM, EDGE = 20, 1e-3
"""Iterations after which a node at an edge may keep a gap of this share of the depth."""
EDGE_MM = 5e-5
"""Gap allowed at an edge whatever the tolerance, far below the resolution of the gel's cells."""
BALANCE, OFF, MOST_OFF = 0.5, 0.1, 1e-2
"""Shares of the tolerance: for the residual, and for the gap over the depth, with its maximum."""
ROUNDING_MM = 1e-8
"""Smallest gap tolerance, by the accuracy of slopes from differences."""
FINER, FINEST = 0.1, 1e-4
ONE_NORMAL = 1e-9
"""Difference of unit normals that is rounding."""
LOOSE, AHEAD = 0.1, 0.1
"""Inexact solves: tolerance of the first one, and then the share of the last relative gap."""


class Correction(Protocol):
    """Motion that the compliance among the nodes lacks, found along with the planes."""

    def first_mm(self, force_n: Array) -> Array:
        """The first displacement (n, 3) without contact forces, from initial forces (n, 3)."""

    def corrected(self, force_n: Array, motion_mm: Array, offset_mm: Array) -> tuple[Array, float]:
        """The next displacement without contact forces, and the largest error of the present one.

        `motion_mm` (n, 3) is C f under the forces (n, 3), `offset_mm` (n, 3) the present
        displacement without contact forces.
        """


@dataclass(frozen=True, eq=False)
class PlaneIteration:
    """The contact problem of the n candidate nodes at one pose."""

    tool: Tool
    pose: Pose
    block: NodeCompliance
    """Compliance (3n, 3n) in mm/N."""
    points_mm: Array
    """Nodes (n, 3) at rest."""
    offset_mm: Array
    """Displacement (n, 3) without contact forces."""
    target_mm: Array
    """Displacement (n, 3) of nodes that stick."""
    wanted: NDArray[np.bool_]
    """Whether (n,) a node may be in contact."""
    friction: float | Array
    tolerance: float
    deepest_mm: float
    correction: Correction | None = None
    """What the compliance lacks; None where it is exact."""

    @property
    def gap_tolerance_mm(self) -> float:
        """Largest gap of a node in contact."""
        return gap_tolerance_mm(self.tolerance, self.deepest_mm)

    @property
    def _edge_mm(self) -> float:
        return max(min(self.tolerance, EDGE) * self.deepest_mm, EDGE_MM)

    def solve(self, surface: ToolSurface, motion_mm: Array, force_n: Array) -> PlaneSolution:
        """Iterate from initial planes, displacements and forces. Raises ContactError."""
        try:
            return self._solve(surface, motion_mm, force_n, AveragedNormals())
        except ContactError:
            return self._solve(surface, motion_mm, force_n, BisectedNormals())

    def fixed(self, surface: ToolSurface, motion_mm: Array, force_n: Array) -> PlaneSolution:
        """The balance with planes that stay. Raises ContactError.

        No gaps show the error of the forces here, so their residual is made smaller instead.
        """
        fine = FINER * BALANCE * self.tolerance
        balance = self._balance(surface, motion_mm, self.offset_mm, force_n, fine, None)
        gap = surface.gap_mm(self.points_mm + balance.motion_mm + self.offset_mm)
        return PlaneSolution(balance, surface, gap, balance.sweeps)

    def _solve(
        self, surface: ToolSurface, motion_mm: Array, force_n: Array, turning: NormalDamping
    ) -> PlaneSolution:
        shape, u, force, known = surface, motion_mm, force_n, None
        offset, missing, fine = self.offset_mm, 0.0, BALANCE * self.tolerance
        if self.correction is not None:
            offset = self.correction.first_mm(force_n)
        sweeps, worst = 0, np.inf
        flat = self._is_flat(surface)
        # Planes of a flat tool do not turn, so that loose forces would only be solved again. A node
        # beside the tool may come under it, after which they are solved again anyway.
        once = flat and bool(surface.is_met[self.wanted].all())
        inner_tolerance = FINER * fine if once else max(fine, LOOSE)
        for turn in range(GEOMETRY_STEPS):
            balance = self._balance(shape, u, offset, force, inner_tolerance, known)
            sweeps += balance.sweeps
            force, known = balance.force_n, balance.motion_mm
            if self.correction is not None:
                offset, missing = self.correction.corrected(force, known, offset)
            new, used = known + offset, shape
            shape = self.tool.surface(self.pose, self.points_mm + new, shape)
            gap = shape.gap_mm(self.points_mm + new)
            before, worst = worst, max(self._worst(gap, balance), missing)
            slack = (
                self.gap_tolerance_mm
                if turn < EDGES_FROM
                else max(self.gap_tolerance_mm, self._edge_mm)
            )
            if worst <= slack and (inner_tolerance <= fine or not np.any(self.friction)):
                return PlaneSolution(balance, used, gap, sweeps)
            if inner_tolerance <= fine:
                # The residual of the forces keeps nodes off the tool, so it must become smaller.
                fine = max(FINER * fine, FINEST * self.tolerance)
            # Where the gap decreases slowly, the inexact forces are the cause.
            finer = inner_tolerance * (FINER if worst > FINER * before else 1.0)
            inner_tolerance = max(fine, min(finer, AHEAD * worst / self.deepest_mm))
            if flat and turn == 0:
                inner_tolerance = min(inner_tolerance, FINER * fine)
            u_before, u = u, new
            if turn >= DAMPED_FROM:
                # Damping, because a node at an edge jumps from one flank to the other and back.
                share = turning(shape.normal - used.normal)
                mixed = shape.turned(used, share)
                u = u_before + 0.5 * (u - u_before)
                shape = self.tool.surface(self.pose, self.points_mm + u, mixed)
                shape = ToolSurface(shape.met_mm, mixed.normal)
        raise ContactError(
            f"nodes keep a gap of {worst:.2g} mm to the tool after {GEOMETRY_STEPS} iterations: "
            "its relief is steeper or finer than the gel's cells can follow"
        )

    def _balance(
        self,
        shape: ToolSurface,
        u: Array,
        offset: Array,
        force: Array,
        inner_tolerance: float,
        known: Array | None,
    ) -> ContactForces:
        frames = shape.frames
        room = allowed_motion_mm(shape, self.points_mm + u, u - offset)
        goal = self.target_mm - offset
        sticking = goal if frames is None else np.einsum("kab,ka->kb", frames, goal)
        return solve_contact_forces(
            self.block,
            np.where(self.wanted, room, np.inf),
            np.ascontiguousarray(sticking[:, :2]),
            self.friction,
            force,
            inner_tolerance,
            frames,
            known,
        )

    def _is_flat(self, surface: ToolSurface) -> bool:
        """Whether the nodes that may be in contact have one normal."""
        normal = surface.normal[self.wanted & surface.is_met]
        return not len(normal) or bool(np.ptp(normal, axis=0).max() < ONE_NORMAL)

    def _worst(self, gap: Array, balance: ContactForces) -> float:
        off = np.where(balance.touch > 0, gap, np.minimum(gap, 0.0))
        return float(np.abs(off)[self.wanted].max())


@dataclass(frozen=True, eq=False)
class PlaneSolution:
    """Converged forces, their planes, the gaps (n,) to the tool, and the number of sweeps."""

    balance: ContactForces
    surface: ToolSurface
    gap_mm: Array
    sweeps: int


def gap_tolerance_mm(tolerance: float, deepest_mm: float) -> float:
    """Largest gap of a node in contact when the contact counts as converged."""
    return max(min(OFF * tolerance, MOST_OFF) * deepest_mm, ROUNDING_MM)


def allowed_motion_mm(surface: ToolSurface, points_mm: Array, moved_mm: Array) -> Array:
    """Largest displacement (n,) along the normals before the nodes meet the tool.

    `points_mm` (n, 3) are the nodes after the displacement `moved_mm` (n, 3).
    """
    along = np.einsum("ia,ia->i", surface.normal, moved_mm)
    return np.asarray(surface.gap_mm(points_mm) + along)
