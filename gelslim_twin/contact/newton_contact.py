"""Contact of a neo-Hookean gel by Newton's method on the whole gel.

About a displacement U with inner forces F(U) and tangent K, forces f on the surface move it by
K⁻¹ (E f - F(U)). What the surface does under that is a linear contact, with K's compliance in the
place of the linear one and -K⁻¹ F(U) as the motion that is there without forces.

Nearly incompressible gel is stiff against errors of the volume only: a displacement that is off
by little has pressures that are off by far. K therefore takes pressures that are unknowns of
their own: what the last step predicts, or what was found at the last poses. Without that, K is
indefinite far from balance, and rounding decides where the steps go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.anderson import Anderson
from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.contact.coulomb_contact import FREE, STICK, ContactForces, solve_contact_forces
from gelslim_twin.contact.gel_body import GelBody, Tangent
from gelslim_twin.contact.gel_state import AnchoredState, GelState
from gelslim_twin.contact.plane_iteration import allowed_motion_mm, gap_tolerance_mm
from gelslim_twin.contact.solver import CANDIDATE_SHARE, ContactSolver
from gelslim_twin.contact.tool_surface import ToolSurface, clearance_mm, tool_surface
from gelslim_twin.scene.pose import Pose
from ifem_export.finite_strain.neo_hookean import FiniteStrainError

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
MOST_STEPS = 40
STALE, NEAR = 0.3, 0.1
"""Gain of a step, and residual over the forces, above which the tangent is made anew."""
SHORTEST = 1 / 32
MOST_AHEAD = 2.0
"""Longest step, of the last one, that is begun on along it."""
ARM_MM = 3.0
MOST_PULLS, PULLED = 20, 0.3
BALANCE = (0.01, 1.0)
"""Tolerances of the linear contact within a step, of that of the whole."""


@dataclass(frozen=True, eq=False)
class SolidState(AnchoredState):
    """A state of the surface, with displacement (n, 3) and pressure (m,) of the whole gel."""

    whole_mm: Array | None = None
    pressure_mpa: Array | None = None
    """None for the cells' own under that displacement."""


@dataclass(eq=False)
class NewtonContact:
    """Steps from pose to pose; keeps the last tangent."""

    solver: ContactSolver
    body: GelBody
    tolerance: float

    def __post_init__(self) -> None:
        self._tangent: Tangent | None = None
        self._last_step: tuple[SolidState, Pose, SolidState] | None = None

    def released(self) -> SolidState:
        """Nothing touches."""
        still = np.zeros((self.body.bundle.mesh.n_nodes, 3))
        rest = GelState.at_rest(len(self.body.surface))
        none = np.zeros(len(self.body.pad.mesh.hexes))
        return SolidState(rest.displacement_mm, rest.force_n, rest.touch, {}, None, still, none)

    def step(self, last: SolidState, before: Pose, pose: Pose) -> SolidState:
        """State at `pose` after `last` at `before`.

        Raises ContactError where it is not found, FiniteStrainError where `last` is impossible.
        """
        state = self._solved(last, before, pose)
        self._last_step = (last, before, state)
        return state

    def _solved(self, last: SolidState, before: Pose, pose: Pose) -> SolidState:
        ahead = self._ahead(last, before, pose)
        if ahead is not None:
            try:
                return self._converged(_NewtonSolve(self, last, before, pose, ahead))
            except (ContactError, FiniteStrainError):
                pass
        return self._converged(_NewtonSolve(self, last, before, pose, self._start(last)))

    def _converged(self, solve: _NewtonSolve) -> SolidState:
        if solve.deepest_mm <= 0:
            self._tangent = None
            return self.released()
        for done in range(1, MOST_STEPS + 1):
            if self._tangent is None or solve.stale:
                least = 0.0 if self._tangent is None else self._tangent.share
                self._tangent = self.body.tangent(solve.whole, solve.pressure, solve.held, least)
            found = solve.forward(self._tangent, done)
            if found is not None:
                return found
        raise ContactError(
            f"the neo-Hookean gel is off balance by {solve.rest:.1e} of the forces and "
            f"{solve.off_mm:.1e} mm off the tool after {MOST_STEPS} steps",
            solve.rest,
        )

    def _start(self, state: SolidState) -> _Start:
        assert state.whole_mm is not None
        pressure = state.pressure_mpa
        if pressure is None:
            still = np.zeros_like(state.whole_mm)
            pressure = self.body.pad.predicted_pressure_mpa(state.whole_mm, still)
        return _Start(state.whole_mm, state.force_n, pressure)

    def _ahead(self, last: SolidState, before: Pose, pose: Pose) -> _Start | None:
        """Where the gel would be on along the last step, where this one goes the same way."""
        if self._last_step is None or self._last_step[2] is not last:
            return None
        first, start, _ = self._last_step
        if not first.force_n.any() or not last.force_n.any():
            return None
        came, goes = _way(start, before), _way(before, pose)
        share = float(came @ goes) / max(float(came @ came), 1e-300)
        if not 0.0 < share <= MOST_AHEAD:
            return None
        return self._start(last).ahead_of(self._start(first), share)


@dataclass(frozen=True, eq=False)
class _Start:
    """Where a solve begins: displacement and forces (n, 3), pressures (m,)."""

    whole_mm: Array
    force_n: Array
    pressure_mpa: Array

    def ahead_of(self, first: _Start, share: float) -> _Start:
        """On along the way from another by a share of it.

        Pressures go on along their own way. Those under the displacement so found would be
        mostly error, as a way that goes straight on does not keep the volume.
        """
        return _Start(
            self.whole_mm + share * (self.whole_mm - first.whole_mm),
            self.force_n + share * (self.force_n - first.force_n),
            self.pressure_mpa + share * (self.pressure_mpa - first.pressure_mpa),
        )


def _way(start: Pose, end: Pose) -> Array:
    """From one pose to another in mm, angles on an arm of a typical contact."""
    turns = [f"{name}_deg" for name in ("twist", "tilt_x", "tilt_y")]
    moved = [getattr(end, n) - getattr(start, n) for n in ("x_mm", "y_mm", "depth_mm")]
    return np.array(moved + [ARM_MM * np.radians(getattr(end, n) - getattr(start, n))
                             for n in turns])  # fmt: skip


class _NewtonSolve:
    """Newton's steps to one pose."""

    def __init__(
        self,
        owner: NewtonContact,
        last: SolidState,
        before: Pose,
        pose: Pose,
        start: _Start,
    ) -> None:
        self.solver, self.body, self.tolerance = owner.solver, owner.body, owner.tolerance
        self.pose = pose
        self.whole, self.pressure = start.whole_mm, start.pressure_mpa
        self.force = start.force_n.copy()
        self.inner = self.body.pad.force(self.whole)
        self.target, ahead = self.solver.targets(last, before, pose)
        points = self.solver.points_mm
        tool = self.solver.tool
        self.on_tool = np.isfinite(clearance_mm(tool, pose, points + ahead * [1.0, 1.0, 0.0]))
        self.wanted = last.touch > 0
        self.surface: ToolSurface | None = None
        self.deepest_mm = -float(np.min(clearance_mm(tool, pose, points), initial=0.0))
        self.rest, self.off_mm, self.stale = 1.0, np.inf, True
        self.size = 1e-300
        self.touch, self.memory = last.touch, Anderson()

    @property
    def held(self) -> Array:
        """Projections (c, 3, 3) of the nodes' motion onto where the tool holds them.

        A node that slips is held along the normal only: springs across it would pull at a node
        that moves, and what they pull is found more slowly than all the rest.
        """
        points = self.solver.points_mm + self.whole[self.body.surface]
        normal = tool_surface(self.solver.tool, self.pose, points, self.surface).normal
        held = normal[:, :, None] * normal[:, None, :]
        held[self.touch == STICK] = np.eye(3)
        held[self.touch == FREE] = 0.0
        return held

    def forward(self, tangent: Tangent, done: int) -> SolidState | None:
        """One step; the state once it is there."""
        points, u = self.solver.points_mm, self.whole[self.body.surface]
        outer = self.inner.copy()
        outer[np.asarray(self.body.bundle.mesh.bonded)] = 0.0
        free = tangent.motion(-outer)
        offset = u + free[self.body.surface]
        surface = tool_surface(self.solver.tool, self.pose, points + u, self.surface)
        self.surface = surface = surface.only(self.on_tool)
        room = allowed_motion_mm(surface, points + u, u - offset)
        self.wanted |= room < CANDIDATE_SHARE * self.deepest_mm
        nodes = np.flatnonzero(self.wanted)
        balance, pull = self._held(tangent, surface.at(nodes), room, offset, nodes)
        self.force, load = np.zeros_like(points), np.zeros_like(self.whole)
        self.force[nodes] = balance.force_n
        load[self.body.surface] = self.force
        pulled = load.copy()
        pulled[self.body.surface[nodes]] += pull
        step = free + tangent.motion(pulled)
        self._remember(balance, nodes, tangent)
        self._move(self._accelerated(step) if tangent.stiffened else step)
        return self._checked(balance, nodes, load, done)

    def _held(
        self, tangent: Tangent, surface: ToolSurface, room: Array, offset: Array, nodes: Nodes
    ) -> tuple[ContactForces, Array]:
        """ContactForces, and what the tangent's springs pull at nodes (m, 3) that move.

        The springs are not there: their pull under the motion found is added to the load until
        it is that under which it was found.
        """
        spring, u = tangent.springs[nodes], self.whole[self.body.surface][nodes]
        pull, memory = np.zeros((len(nodes), 3)), Anderson()
        block = tangent.block(nodes)
        for _ in range(MOST_PULLS):
            moved = (block @ pull.reshape(-1)).reshape(-1, 3)
            more = offset.copy()
            more[nodes] += moved
            # Room is what forces may move a node, beyond what it moves without.
            left = room.copy()
            left[nodes] -= (surface.normal * moved).sum(axis=1)
            balance = self._balance(tangent, surface, left, more, nodes)
            if not spring.any():
                break
            self.force[nodes] = balance.force_n
            found = np.einsum("nab,nb->na", spring, balance.motion_mm + more[nodes] - u)
            change = found - pull
            if np.linalg.norm(change) <= PULLED * self.tolerance * np.linalg.norm(balance.force_n):
                break
            pull = memory.next(pull.reshape(-1), change.reshape(-1)).reshape(-1, 3)
        return balance, pull

    def _balance(
        self, tangent: Tangent, surface: ToolSurface, room: Array, offset: Array, nodes: Nodes
    ) -> ContactForces:
        frames, goal = surface.frames, (self.target - offset)[nodes]
        sticking = goal if frames is None else np.einsum("kab,ka->kb", frames, goal)
        # Nearly incompressible gel far from balance may not allow the finer tolerance.
        for share in BALANCE:
            try:
                return solve_contact_forces(
                    tangent.block(nodes),
                    room[nodes],
                    np.ascontiguousarray(sticking[:, :2]),
                    self.solver.settings.friction,
                    self.force[nodes],
                    share * self.tolerance,
                    frames,
                )
            except ContactError as error:
                failure = error
        raise failure

    def _remember(self, balance: ContactForces, nodes: Nodes, tangent: Tangent) -> None:
        """Who touches now; steps of another touch or of another kind are forgotten."""
        touch = np.zeros(len(self.force), dtype=np.int8)
        touch[nodes] = balance.touch
        if not (tangent.stiffened and np.array_equal(touch, self.touch)):
            self.touch, self.memory = touch, Anderson()

    def _accelerated(self, step: Array) -> Array:
        """Step from what the last ones of stiffened tangents with the same touch gained.

        Such a tangent gains little by itself. Newton's own steps are taken as they are: a mean of
        several does not keep the volume.
        """
        ahead = self.memory.next(self.whole.reshape(-1), step.reshape(-1))
        return np.asarray(ahead.reshape(-1, 3) - self.whole)

    def _move(self, step: Array) -> None:
        """Go by as much of a step as keeps every cell from turning inside out."""
        share = 1.0
        while share >= SHORTEST:
            try:
                ahead = self.whole + share * step
                self.inner = self.body.pad.force(ahead)
                full = self.body.pad.predicted_pressure_mpa(self.whole, step)
                self.pressure = self.pressure + share * (full - self.pressure)
                self.whole = ahead
                return
            except FiniteStrainError:
                share /= 2
        raise ContactError("a step turns cells of the gel inside out: take smaller steps")

    def _checked(
        self, balance: ContactForces, nodes: Nodes, load: Array, done: int
    ) -> SolidState | None:
        rest = self.inner - load
        rest[np.asarray(self.body.bundle.mesh.bonded)] = 0.0
        self.size = float(np.linalg.norm(load)) or self.size
        before, self.rest = self.rest, float(np.linalg.norm(rest)) / self.size
        points = self.solver.points_mm + self.whole[self.body.surface]
        seen = tool_surface(self.solver.tool, self.pose, points, self.surface)
        gap = seen.gap_mm(points)
        pressed = np.zeros(len(points), dtype=bool)
        pressed[nodes] = balance.touch > 0
        off = np.abs(np.where(pressed, gap, np.where(self.on_tool, np.minimum(gap, 0.0), 0.0)))
        self.off_mm = float(off.max())
        slack = gap_tolerance_mm(self.tolerance, self.deepest_mm)
        into = (gap < -slack) & ~self.wanted
        self.wanted |= into
        self.on_tool |= into
        self.stale = self.rest > min(STALE * before, NEAR)
        if self.rest > self.tolerance or self.off_mm > slack or into.any():
            return None
        push = np.linalg.norm(balance.force_n, axis=1)
        across = float((push * off[nodes])[balance.touch > 0].max(initial=0.0))
        report = {
            "residual": self.rest,
            "penetration_mm": max(0.0, -float(gap[nodes].min(initial=0.0))),
            "complementarity": across / max(float(push.max(initial=0.0)) * self.deepest_mm, 1e-300),
            "iterations": float(done),
        }
        touch = np.zeros(len(points), dtype=np.int8)
        touch[nodes] = balance.touch
        u = self.whole[self.body.surface]
        held = np.where((touch == STICK)[:, None], self.target, u)
        return SolidState(u, self.force, touch, report, held, self.whole, self.pressure)
