"""Contact of a rigid tool with a linear gel: contact region and nodal forces at each pose.

With the displacement u = C f, the normal n into the tool at the present position of a node and the
tangential direction t, the conditions at each pose are

    n·u <= h,  n·f <= 0,  n·f (n·u - h) = 0
    |f_t| <= μ |n·f|;  no slip inside the cone, slip against the tool opposed to f_t on the cone

(Kalker 1990; for the forces see `contact_forces`). The tool is replaced by its tangent plane at
each node, which is updated until all nodes in contact lie on the tool (`plane_iteration`). The set
of candidate nodes grows until no other node penetrates the tool. Where a step to a pose does not
converge, it is halved.

With the geometry "rest" the gel meets the tool as in the theory of small displacements: along z, at
the height of the tool over each node at rest. `geometry_of` says which one is nearer to a gel at
large strain.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import STICK, ContactForces
from gelslim_twin.contact.gel_state import (
    AnchoredState,
    ContactError,
    GelState,
    StickTargets,
    TouchedNodes,
    anchor_mm,
)
from gelslim_twin.contact.load_steps import even_steps, is_stationary, with_halved_steps
from gelslim_twin.contact.plane_iteration import (
    Correction,
    PlaneIteration,
    PlaneSolution,
    allowed_motion_mm,
    gap_tolerance_mm,
)
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool, ToolSurface
from ifem_export.compliance.pad_compliance import NodeCompliance, SurfaceResponse

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
SPARE = 1.5
"""Size of a stored block over the size needed above which a smaller one is gathered."""
CANDIDATE_SHARE = 0.2
"""Gap over depth up to which a node is a candidate, because the gel bulges at the contact."""
GROWTH_STEPS = 12
MOST_SUBSTEPS = 200
CARRIED = 0.25
"""Way of the tool in one step, over the pitch of the nodes, up to which it carries what sticks."""
Geometry = Literal["displaced", "rest"]
REST_FROM = 0.4
"""Poisson's ratio from which the geometry at rest is nearer (bench/twin/linear_gel.py)."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Candidate nodes (n,) of the contact, in order of their addition, and their compliance."""

    nodes: Nodes
    block: NodeCompliance

    @classmethod
    def none(cls) -> Candidates:
        """No candidates, as before the first contact."""
        return cls(np.zeros(0, np.intp), np.zeros((0, 0), np.float32))

    @classmethod
    def of(cls, nodes: Nodes, compliance: SurfaceResponse) -> Candidates:
        """Candidates `nodes` (n,) in this order, with their compliance."""
        return cls(nodes, compliance.block(nodes))

    def including(self, wanted: NDArray[np.bool_], compliance: SurfaceResponse) -> Candidates:
        """Candidates that include all `wanted` (c,) nodes, and not too many others."""
        count = int(wanted.sum())
        inside = np.zeros(len(wanted), dtype=bool)
        inside[self.nodes] = True
        new = np.flatnonzero(wanted & ~inside)
        if len(self.nodes) + len(new) > SPARE * count:
            nodes = np.flatnonzero(wanted)
            return Candidates.of(nodes, compliance)
        if len(new) == 0:
            return self
        nodes = np.concatenate([self.nodes, new])
        return Candidates(nodes, compliance.block(nodes, self.block))


@dataclass(frozen=True)
class ContactSettings:
    """Tolerance, friction and load steps of a contact."""

    tolerance: float = 1e-3
    """Largest relative error of the field of forces (L2). `plane_iteration` divides it between
    the forces and the gaps."""
    friction: float = 0.0
    longest_step: float = 1.0
    """With friction, the largest displacement of a node in contact in one step, in cell sizes."""
    halvings: int = 6
    geometry: Geometry = "displaced"
    """Where a node meets the tool: where it has moved, along the tool's normal; or at rest."""


def geometry_of(poissons_ratio: float) -> Geometry:
    """The geometry whose force is nearer to that of a neo-Hookean gel (docs/physics.md)."""
    return "rest" if poissons_ratio >= REST_FROM else "displaced"


@dataclass(eq=False)
class ContactSolver:
    """Solves the contact along a sequence of poses. It stores only the last candidates.

    The order of the candidates decides the last bits of a solution, so that a solution is repeated
    exactly with the same `candidates`.
    """

    compliance: SurfaceResponse
    tool: Tool
    settings: ContactSettings

    def __post_init__(self) -> None:
        mesh = self.compliance.bundle.mesh
        self.points_mm = np.asarray(mesh.surface_mm)
        self._cell = min(mesh.cell_size_mm[:2])
        self._longest = self.settings.longest_step * self._cell
        self.candidates = Candidates.none()

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        state, before = GelState.at_rest(len(self.points_mm)), None
        for pose in poses:
            if before is None or not is_stationary(before, pose):
                state = self.advanced(state, before, pose)
            before = pose
            yield state
        self.compliance.store()

    def advanced(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        """State at `pose`, in as many load steps as necessary."""
        state = last
        for middle in self.steps_to(last, before, pose):
            if before is None:
                state = self.step(state, None, middle)
            else:
                state = with_halved_steps(self.step, state, before, middle, self.settings.halvings)
            before = middle
        return state

    def steps_to(self, last: GelState, before: Pose | None, pose: Pose) -> Iterator[Pose]:
        """Load steps to `pose`, which is the last one.

        No node in contact moves farther than the longest step. Without friction the solution does
        not depend on the path, so that there is one step.
        """
        touched = last.touch > 0
        count = 1
        if before is not None and self.settings.friction > 0 and touched.any():
            places = (self.points_mm + last.displacement_mm)[touched]
            dragged = np.hypot(*(self.tool.carried(before, pose, places) - places)[:, :2].T).max()
            count = min(MOST_SUBSTEPS, math.ceil(dragged / self._longest - 1e-9))
        return iter((pose,)) if before is None else even_steps(before, pose, count)

    def step(
        self,
        last: GelState,
        before: Pose | None,
        pose: Pose,
        offset_mm: Array | None = None,
        start: GelState | None = None,
        *,
        offset_is_free: bool = False,
    ) -> GelState:
        """State at `pose` in one step from the state `last` at `before`; raises ContactError.

        `offset_mm` (c, 3) is a displacement without contact forces, by which a nonlinear gel
        differs from C. With `offset_is_free` it is the shape that the surface has while nothing
        touches it, at which the tool then meets it. `start` is an initial guess.
        """
        offset = np.zeros_like(self.points_mm) if offset_mm is None else offset_mm
        self._begin(last, offset)
        met_mm = offset[:, 2] if offset_is_free else None
        found = self._solved(last, before, pose, offset, last if start is None else start, met_mm)
        return self._completed(found, last, before, pose)

    def _begin(self, last: GelState, offset_mm: Array) -> None:
        """Prepare a step from the state `last`."""

    def _completed(
        self, found: GelState, last: GelState, before: Pose | None, pose: Pose
    ) -> GelState:
        """The state at the end of a step, with all that the solver keeps in it."""
        return found

    def _solved(
        self,
        last: GelState,
        before: Pose | None,
        pose: Pose,
        offset: Array,
        first: GelState,
        met_mm: Array | None,
    ) -> GelState:
        """State of the step; the tool meets the surface at heights `met_mm` (c,) if they are given.

        The iteration starts from the state `first`.
        """
        targets = self.targets(last, before, pose)
        target, ahead = targets.target_mm, targets.ahead_mm
        met = ahead * [1.0, 1.0, 0.0]
        if met_mm is not None:
            met[:, 2] = met_mm
        below = self.tool.clearance_mm(pose, self.points_mm + met)
        if met_mm is None and ahead.any() and not (below < 0).any():
            # A tool that rises may meet nodes where they were before it pushed them aside.
            below = np.minimum(below, self.tool.clearance_mm(pose, self.points_mm))
        on_tool = np.isfinite(below)
        depth = -float(np.min(below, initial=0.0))
        moved, guess = first.displacement_mm, first.force_n
        wanted = np.zeros(len(moved), dtype=bool)
        stuck = last.touch == STICK
        if self._is_short(targets.dragged_mm[stuck]):
            wanted = last.touch > 0
            if first is last:
                moved = moved + np.where(stuck[:, None], targets.dragged_mm, 0.0)
        for _ in range(GROWTH_STEPS):
            surface, room = self._room(pose, moved, offset, on_tool)
            deepest = -float(np.min(room, initial=0.0))
            if min(deepest, depth) <= 0:
                return replace(GelState.at_rest(len(moved)), displacement_mm=offset.copy())
            wanted |= room < CANDIDATE_SHARE * deepest
            self.candidates = self.candidates.including(wanted, self.compliance)
            nodes = self.candidates.nodes
            iteration = PlaneIteration(
                self.tool, pose, self.candidates.block, self.points_mm[nodes], offset[nodes],
                target[nodes], wanted[nodes], self._friction(nodes), self.settings.tolerance,
                deepest, self._correction(nodes),
            )  # fmt: skip
            solve = iteration.solve if self.settings.geometry == "displaced" else iteration.fixed
            found = solve(surface.at(nodes), moved[nodes], guess[nodes])
            state, gap = self._state(nodes, found, pose, surface, offset, targets, deepest)
            into = (gap < -gap_tolerance_mm(self.settings.tolerance, deepest)) & ~wanted
            if not into.any():
                return state
            wanted, on_tool = wanted | into, on_tool | into
            moved, guess = state.displacement_mm, state.force_n
        raise ContactError("the contact region keeps growing: take smaller steps of the motion")

    def _is_short(self, dragged_mm: Array) -> bool:
        """Whether the tool drags what it holds a short way (n, 3).

        A step then starts with what sticks carried along, in contact as before. Over a longer way
        a rim that passes a node would be found to hold it.
        """
        way = np.linalg.norm(dragged_mm, axis=1)
        pitch_mm = min(self.compliance.bundle.mesh.cell_size_mm[:2])
        return float(way.max(initial=0.0)) < CARRIED * pitch_mm

    def targets(self, last: GelState, before: Pose | None, pose: Pose) -> StickTargets:
        """Where nodes stick from their first contact."""
        u, none = anchor_mm(last), np.zeros(len(self.points_mm))
        if before is None:
            return StickTargets(u, u, np.zeros_like(u), none, none)
        places = self.points_mm + u
        dragged = self.tool.carried(before, pose, places) - places
        touched = last.touch > 0
        ahead = u + np.where(touched[:, None], dragged, 0.0)
        if self.settings.friction == 0 or not dragged.any():
            return StickTargets(u + dragged, ahead, dragged, none + 1.0, none)
        # Other nodes stick for the part of the step in which they are in contact.
        heights = [self.tool.clearance_mm(p, places) for p in (before, pose)]
        share, rate = np.where(np.isfinite(heights[0]), 0.0, 0.5), none
        closing = np.isfinite(heights[0]) & (heights[1] < 0) & ~touched
        first = np.maximum(heights[0][closing], 0.0)
        share[closing] = heights[1][closing] / (heights[1][closing] - first)
        share[touched] = 1.0
        rate[closing] = share[closing] * (1 - share[closing]) / heights[1][closing]
        return StickTargets(u + share[:, None] * dragged, ahead, dragged, share, rate)

    def _room(
        self, pose: Pose, moved: Array, offset: Array, on_tool: NDArray[np.bool_]
    ) -> tuple[ToolSurface, Array]:
        """Tangent planes at all nodes, and the displacement (c,) that forces may cause along n."""
        places = self.points_mm + moved
        if self.settings.geometry == "rest":
            tool = self.tool.above(pose, self.points_mm, reach_mm=self._cell)
            surface = tool.levelled(self.points_mm)
            return surface, allowed_motion_mm(surface, places, moved - offset)
        # Slopes cost four more evaluations of the tool and matter near the gel only.
        surface = self.tool.surface(pose, places, reach_mm=self._cell).only(on_tool)
        return surface, allowed_motion_mm(surface, places, moved - offset)

    def _friction(self, nodes: Nodes) -> float | Array:
        """Coefficient of friction, of all nodes or of each of `nodes` (n,)."""
        return self.settings.friction

    def _correction(self, nodes: Nodes) -> Correction | None:
        """What the compliance of the candidates lacks."""
        return None

    def _displacement(self, nodes: Nodes, balance: ContactForces) -> Array:
        """Displacement (c, 3) under the forces on `nodes` (n,)."""
        return self.compliance.displacement(nodes, balance.force_n, balance.motion_mm)

    def _state(
        self,
        nodes: Nodes,
        found: PlaneSolution,
        pose: Pose,
        planes: ToolSurface,
        offset: Array,
        targets: StickTargets,
        deepest: float,
    ) -> tuple[AnchoredState, Array]:
        """State of the whole surface, and gaps (c,) of all nodes."""
        balance = found.balance
        u = self._displacement(nodes, balance) + offset
        if self.settings.geometry == "rest":
            gap = planes.gap_mm(self.points_mm + u)
        else:
            gap = self.tool.clearance_mm(pose, self.points_mm + u)
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
        held = np.where((touch == STICK)[:, None], targets.target_mm, u)
        on = np.flatnonzero(balance.touch)
        touched = TouchedNodes(nodes[on], found.surface.normal[on], targets.at(nodes[on]))
        return AnchoredState(u, force, touch, report, held, touched=touched), gap
