"""Contact of a neo-Hookean gel by Newton's method on the whole gel.

At a displacement U with internal forces F(U) and tangent stiffness K, surface forces f change the
displacement by K⁻¹ (E f - F(U)). Each Newton step is therefore a linear contact problem with the
compliance of K, in which -K⁻¹ F(U) is the displacement without contact forces.

Nearly incompressible gel is stiff against changes of volume only, so that a small error of the
displacement causes a large error of the pressure. K therefore takes the pressures as separate
unknowns, predicted by the last step or extrapolated from the last poses. Without that, K is
indefinite far from equilibrium, and rounding decides the direction of the steps.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import Anderson
from gelslim_twin.contact.contact_forces import FREE, STICK, ContactForces, solve_contact_forces
from gelslim_twin.contact.gel_body import GelBody, Tangent
from gelslim_twin.contact.gel_state import AnchoredState, ContactError, GelState, TouchedNodes
from gelslim_twin.contact.plane_iteration import allowed_motion_mm, gap_tolerance_mm
from gelslim_twin.contact.solver import CANDIDATE_SHARE, ContactSolver
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import ToolSurface
from gelslim_twin.tools.tool_group import members_of
from ifem_export.finite_strain.neo_hookean import FiniteStrainError

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
MOST_STEPS = 40
STALE, NEAR = 0.3, 0.1
"""Ratio of successive residuals, and relative residual, above which K is computed again."""
SHORTEST = 1 / 32
MOST_AHEAD = 2.0
"""Largest ratio to the last load step for which the start is extrapolated from it."""
ARM_MM = 3.0
MOST_PULLS, PULLED = 20, 0.3
BALANCE = (0.01, 1.0)
"""Tolerances of the linear contact in a step, as shares of the tolerance of the pose."""


@dataclass(frozen=True, eq=False)
class SolidState(AnchoredState):
    """A state of the surface, with displacement (n, 3) and pressure (m,) of the whole gel."""

    whole_mm: Array | None = None
    pressure_mpa: Array | None = None
    """None for the pressures that follow from the displacement."""


@dataclass(eq=False)
class NewtonContact:
    """Solves one pose after the other and stores the last tangent stiffness."""

    solver: ContactSolver
    body: GelBody
    tolerance: float

    def __post_init__(self) -> None:
        self._tangent: Tangent | None = None
        self._last_step: tuple[SolidState, Pose, SolidState] | None = None

    def forget(self) -> None:
        """Drop the last tangent stiffness and the last step, so that the next starts without."""
        self._tangent = self._last_step = None

    def released(self) -> SolidState:
        """The undeformed gel without contact."""
        still = np.zeros((self.body.bundle.mesh.n_nodes, 3))
        rest = GelState.at_rest(len(self.body.surface))
        none = np.zeros(len(self.body.pad.mesh.hexes))
        return SolidState(rest.displacement_mm, rest.force_n, rest.touch, {}, None, still, none)

    def step(self, last: SolidState, before: Pose, pose: Pose) -> SolidState:
        """State at `pose` from the state `last` at `before`.

        Raises ContactError where it does not converge, FiniteStrainError for an invalid `last`.
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
            f"the residual of the neo-Hookean gel is {solve.rest:.1e} of the forces, the gap "
            f"{solve.off_mm:.1e} mm after {MOST_STEPS} steps",
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
        """Extrapolation of the last load step, where this one has a similar direction."""
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
    """Initial guess: displacement (n, 3), surface forces (c, 3) and pressures (m,)."""

    whole_mm: Array
    force_n: Array
    pressure_mpa: Array

    def ahead_of(self, first: _Start, share: float) -> _Start:
        """Linear extrapolation from `first` through this state.

        Pressures are extrapolated themselves. Those that follow from the extrapolated displacement
        would be mostly error, because linear extrapolation does not preserve the volume.
        """
        return _Start(
            self.whole_mm + share * (self.whole_mm - first.whole_mm),
            self.force_n + share * (self.force_n - first.force_n),
            self.pressure_mpa + share * (self.pressure_mpa - first.pressure_mpa),
        )


def _way(start: Pose, end: Pose) -> Array:
    """Difference of two poses in mm; angles count with the arm of a typical contact."""
    pairs = zip(members_of(start), members_of(end), strict=True)
    ways = np.array([np.subtract(astuple(b)[1:], astuple(a)[1:]) for a, b in pairs])
    ways[:, 3:] = ARM_MM * np.radians(ways[:, 3:])
    return ways.ravel()


class _NewtonSolve:
    """Newton's method for one pose."""

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
        self.targets = self.solver.targets(last, before, pose)
        self.target, ahead = self.targets.target_mm, self.targets.ahead_mm
        points = self.solver.points_mm
        tool = self.solver.tool
        self.on_tool = np.isfinite(tool.clearance_mm(pose, points + ahead * [1.0, 1.0, 0.0]))
        self.wanted = last.touch > 0
        self.surface: ToolSurface | None = None
        self.deepest_mm = -float(np.min(tool.clearance_mm(pose, points), initial=0.0))
        self.rest, self.off_mm, self.stale = 1.0, np.inf, True
        self.size = 1e-300
        self.touch, self.memory = last.touch, Anderson()

    @property
    def held(self) -> Array:
        """Projections (c, 3, 3) onto the directions in which the tool constrains each node.

        A slipping node is constrained along the normal only: tangential springs would act on a
        node that moves, and the iteration for their forces would converge slowly.
        """
        points = self.solver.points_mm + self.whole[self.body.surface]
        normal = self.solver.tool.surface(self.pose, points, self.surface).normal
        held = normal[:, :, None] * normal[:, None, :]
        held[self.touch == STICK] = np.eye(3)
        held[self.touch == FREE] = 0.0
        return held

    def forward(self, tangent: Tangent, done: int) -> SolidState | None:
        """One Newton step; returns the state on convergence."""
        points, u = self.solver.points_mm, self.whole[self.body.surface]
        outer = self.inner.copy()
        outer[np.asarray(self.body.bundle.mesh.bonded)] = 0.0
        free = tangent.motion(-outer)
        offset = u + free[self.body.surface]
        surface = self.solver.tool.surface(self.pose, points + u, self.surface)
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
        """Contact forces, and forces (m, 3) that cancel the springs of the tangent.

        The springs only stabilise the tangent. Their forces under the displacement found are
        added to the load by a fixed-point iteration, so that they have no effect on the solution.
        """
        spring, u = tangent.springs[nodes], self.whole[self.body.surface][nodes]
        pull, memory = np.zeros((len(nodes), 3)), Anderson()
        block = tangent.block(nodes)
        for _ in range(MOST_PULLS):
            moved = (block @ pull.reshape(-1)).reshape(-1, 3)
            more = offset.copy()
            more[nodes] += moved
            # The gap left for the displacement by contact forces.
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
        # Nearly incompressible gel far from equilibrium may not allow the finer tolerance.
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
        """Line search: the largest of the halved steps that inverts no cell."""
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
        raise ContactError("a Newton step inverts cells of the gel: take smaller load steps")

    def _checked(
        self, balance: ContactForces, nodes: Nodes, load: Array, done: int
    ) -> SolidState | None:
        rest = self.inner - load
        rest[np.asarray(self.body.bundle.mesh.bonded)] = 0.0
        self.size = float(np.linalg.norm(load)) or self.size
        before, self.rest = self.rest, float(np.linalg.norm(rest)) / self.size
        points = self.solver.points_mm + self.whole[self.body.surface]
        seen = self.solver.tool.surface(self.pose, points, self.surface)
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
        on = np.flatnonzero(touch)
        touched = TouchedNodes(on, seen.normal[on], self.targets.at(on))
        whole = self.whole, self.pressure
        return SolidState(u, self.force, touch, report, held, *whole, touched=touched)
