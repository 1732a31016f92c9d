"""Frictionless contact of a rigid tool with a linear gel, at many poses from the untouched gel.

It takes the same iterations as `ContactSolver.step` does from rest, for b poses at once: candidate
nodes that grow, tangent planes that follow the nodes, and forces as a complementarity problem. The
nodes of each pose are filled up to as many as the largest pose has. A pose that does not converge
is left to the solver of single poses, which has one more way to damp normals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.batch.candidates import CandidateCompliance, padded
from gelslim_twin.batch.complementarity import lcp_forces
from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.fields import FIELD_NUMBERS, Overlaps, SolvedContacts, memory_parts
from gelslim_twin.batch.planes import PlacedTool, Planes
from gelslim_twin.contact.contact_forces import SLIP
from gelslim_twin.contact.plane_iteration import (
    DAMPED_FROM,
    EDGE,
    EDGE_MM,
    EDGES_FROM,
    GEOMETRY_STEPS,
    gap_tolerance_mm,
)
from gelslim_twin.contact.solver import CANDIDATE_SHARE, GROWTH_STEPS, Geometry
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
SINGLE_GAP = 3e-6
"""Smallest gap over the depth that displacements in single precision show."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Solution at the candidate nodes (b, m) of poses.

    Attributes:
        push: Normal forces (b, m), none above 0.
        normal: Normals (b, m, 3) of the planes that they act against.
        found: Whether (b,) it converged.
    """

    push: Tensor
    normal: Tensor
    found: Tensor


@dataclass(frozen=True, eq=False)
class BatchedContact:
    """Solves contacts of one sensor.

    Attributes:
        engine: Where it is computed.
        compliance: The gel; all of its columns are computed at the first contact.
        tolerance: As of `ContactSettings`.
        geometry: Where a node meets the tool.
    """

    engine: Engine
    compliance: SurfaceCompliance
    tolerance: float
    geometry: Geometry

    @cached_property
    def points_mm(self) -> Tensor:
        """Surface nodes (c, 3) at rest."""
        return self.engine.double(self.compliance.bundle.mesh.surface_mm)

    @cached_property
    def _table(self) -> Tensor:
        """Compliance (3c, 3c) in mm/N."""
        nodes = np.arange(self.compliance.nodes)
        rows = self.compliance.columns(nodes).reshape(3 * len(nodes), -1)
        return self.engine.torch.as_tensor(rows).to(self.engine.device, self.engine.real)

    @property
    def _cell_mm(self) -> float:
        return float(min(self.compliance.bundle.mesh.cell_size_mm[:2]))

    def overlaps(self, tool: Tool, origins_mm: Array, turns: Array) -> Overlaps:
        """What of a tool with the origins (n, 3) and rotations (n, 3, 3) is in the gel."""
        room = 8 * FIELD_NUMBERS * self.compliance.nodes
        count = max(1, self.engine.most_bytes // room)
        found = [
            self._overlaps(tool, origins_mm[first : first + count], turns[first : first + count])
            for first in range(0, len(origins_mm), count)
        ]
        return Overlaps(*(np.concatenate(values) for values in zip(*found, strict=True)))

    def _overlaps(self, tool: Tool, origins_mm: Array, turns: Array) -> tuple[Array, ...]:
        engine = self.engine
        placed = PlacedTool(engine, tool, engine.double(origins_mm), engine.double(turns))
        below = placed.clearance_mm(self.points_mm.expand(len(origins_mm), -1, -1))
        into = below < 0
        depth = -below.amin(dim=1).clamp(max=0.0)
        spans = []
        for axis in (0, 1):
            at = self.points_mm[:, axis].expand_as(below)
            high, low = at.masked_fill(~into, -np.inf), at.masked_fill(~into, np.inf)
            spans.append(high.amax(dim=1) - low.amin(dim=1))
        span = engine.torch.maximum(*spans)
        depths = -below.masked_fill(~into, 0.0).sum(dim=1)
        candidates = (below < CANDIDATE_SHARE * depth[:, None]).sum(dim=1)
        return tuple(map(engine.numpy, (into.sum(dim=1), depth, depths, span, candidates)))

    def solve(
        self,
        tool: Tool,
        origins_mm: Array,
        turns: Array,
        candidates: NDArray[np.intp],
        into: SolvedContacts,
        numbers: NDArray[np.intp],
    ) -> None:
        """Solve m poses of a tool.

        Args:
            tool: The tool.
            origins_mm: Its origin (m, 3) at each pose.
            turns: Its rotation (m, 3, 3).
            candidates: About how many nodes (m,) may be in contact, by which the poses are
                divided into parts that fit into memory.
            into: Where the fields are written.
            numbers: The numbers (m,) of the poses there.
        """
        order = np.argsort(candidates, kind="stable")
        for part in memory_parts(candidates[order], self.compliance.nodes, self.engine.most_bytes):
            at = order[part]
            placed = PlacedTool(
                self.engine, tool, self.engine.double(origins_mm[at]), self.engine.double(turns[at])
            )
            into.put(numbers[at], self._solved(placed))

    def _solved(self, tool: PlacedTool) -> SolvedContacts:
        torch, engine = self.engine.torch, self.engine
        poses = len(tool.origin_mm)
        points = self.points_mm.expand(poses, -1, -1)
        below = tool.clearance_mm(points)
        on_tool, depth = below.isfinite(), -below.amin(dim=1).clamp(max=0.0)
        moved, force = torch.zeros_like(points), torch.zeros_like(points)
        pressed = torch.zeros_like(on_tool)
        wanted, solved = torch.zeros_like(on_tool), torch.zeros_like(on_tool[:, 0])
        left = torch.arange(poses, device=engine.device)
        for _ in range(GROWTH_STEPS):
            some = tool.of(left)
            planes, room = self._room(some, points[left] + moved[left], moved[left], on_tool[left])
            deepest = -room.amin(dim=1).clamp(max=0.0)
            free = torch.minimum(deepest, depth[left]) <= 0
            force[left[free]], moved[left[free]] = 0.0, 0.0
            pressed[left[free]], solved[left[free]] = False, True
            some, planes, room = some.of(~free), planes.of(~free), room[~free]
            left, deepest = left[~free], deepest[~free]
            if len(left) == 0:
                break
            wanted[left] |= room < CANDIDATE_SHARE * deepest[:, None]
            places, real = padded(wanted[left])
            balance, u = self._balanced(
                some, planes.at(places), places, real, moved[left], pressed[left], deepest
            )
            own = balance.push[..., None] * balance.normal
            index = places[..., None].expand(-1, -1, 3)
            force[left] = torch.zeros_like(u).scatter_add_(1, index, own)
            moved[left] = u
            pressed[left] = torch.zeros_like(pressed[left]).scatter_(
                1, places, (balance.push < 0) & real
            )
            if self.geometry == "rest":
                gap = planes.gap_mm(points[left] + u)
            else:
                gap = some.clearance_mm(points[left] + u)
            into = (gap < -self._gap_tolerance_mm(deepest)[:, None]) & ~wanted[left]
            grows = into.any(dim=1)
            wanted[left] |= into
            on_tool[left] |= into
            solved[left] = balance.found & ~grows
            left = left[balance.found & grows]
        lost = ~solved
        force[lost], moved[lost], pressed[lost] = 0.0, 0.0, False
        status = pressed.to(torch.int8) * SLIP
        return SolvedContacts(*map(engine.numpy, (force, moved, status, solved)))

    def _room(
        self, tool: PlacedTool, places: Tensor, moved: Tensor, on_tool: Tensor
    ) -> tuple[Planes, Tensor]:
        """As `ContactSolver._room`."""
        if self.geometry == "rest":
            rest = places - moved
            planes = tool.above(rest, self._cell_mm).levelled(rest)
        else:
            planes = tool.surface(places, reach_mm=self._cell_mm).only(on_tool)
        return planes, planes.gap_mm(places) + (planes.normal * moved).sum(dim=-1)

    def _balanced(
        self,
        tool: PlacedTool,
        planes: Planes,
        places: Tensor,
        real: Tensor,
        moved: Tensor,
        pressed: Tensor,
        deepest: Tensor,
    ) -> tuple[Balance, Tensor]:
        """The balance at the candidates `places` (b, m), and the displacement (b, c, 3)."""
        engine, index = self.engine, places[..., None].expand(-1, -1, 3)
        points = self.points_mm[places]
        block = CandidateCompliance(engine, self._table, places)
        start, active = moved.gather(1, index), pressed.gather(1, places) & real
        if self.geometry == "rest":
            room = planes.gap_mm(points).masked_fill(~real, np.inf)
            push, _, found = self._forces(block, planes.normal, room, active)
            balance = Balance(push, planes.normal, found)
        else:
            balance = self._followed(tool, planes, points, block, real, start, active, deepest)
        return balance, self._motion(places, balance.push[..., None] * balance.normal)

    def _followed(
        self,
        tool: PlacedTool,
        planes: Planes,
        points: Tensor,
        block: CandidateCompliance,
        real: Tensor,
        start: Tensor,
        active: Tensor,
        deepest: Tensor,
    ) -> Balance:
        """Planes that follow the nodes until no node in contact is off the tool.

        As `PlaneIteration`, with normals averaged from some iteration on.
        """
        torch = self.engine.torch
        narrow = self._gap_tolerance_mm(deepest)
        edge = (min(self.tolerance, EDGE) * deepest).clamp(min=EDGE_MM)
        push = torch.zeros_like(active, dtype=torch.float64)
        normal = torch.zeros_like(points)
        found = torch.zeros_like(active[:, 0])
        left, u = torch.arange(len(points), device=self.engine.device), start
        for turn in range(GEOMETRY_STEPS):
            rest, can = points[left], real[left]
            room = planes.gap_mm(rest + u) + (planes.normal * u).sum(dim=-1)
            room = room.masked_fill(~can, np.inf)
            own, new, balanced = self._forces(block, planes.normal, room, active)
            used, planes = planes, tool.surface(rest + new, planes)
            gap = planes.gap_mm(rest + new)
            active = own < 0
            off = torch.where(active, gap, gap.clamp(max=0.0)).masked_fill(~can, 0.0).abs()
            slack = narrow[left] if turn < EDGES_FROM else torch.maximum(narrow, edge)[left]
            done = balanced & (off.amax(dim=1) <= slack)
            at = left[done]
            push[at], normal[at], found[at] = own[done], used.normal[done], True
            on = ~done & balanced
            if not bool(on.any()):
                break
            before, u = u[on], new[on]
            if not bool(on.all()):
                left, tool, active, block = left[on], tool.of(on), active[on], block.of(on)
                planes, used = planes.of(on), used.of(on)
            if turn >= DAMPED_FROM:
                # Damping, because a node at an edge jumps from one flank to the other and back.
                mixed = planes.turned(used, 1 / (turn - DAMPED_FROM + 2))
                u = before + 0.5 * (u - before)
                planes = Planes(tool.surface(points[left] + u, mixed).met_mm, mixed.normal)
        return Balance(push, normal, found)

    def _forces(
        self, block: CandidateCompliance, normal: Tensor, room: Tensor, active: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Normal forces (b, m), motion (b, m, 3) under them, and whether (b,) they were found."""
        across, among = block.along(normal)
        pushes = lcp_forces(self.engine, among, room, active)
        motion = (across @ pushes.force[..., None]).view(normal.shape)
        return pushes.force.double(), motion.double(), pushes.found

    def _motion(self, places: Tensor, force: Tensor) -> Tensor:
        """Displacement (b, c, 3) under forces (b, m, 3) at nodes `places` (b, m)."""
        torch = self.engine.torch
        size = force.abs().amax(dim=2)
        most = max(1, int((size > 0).sum(dim=1).amax()))
        first = size.argsort(dim=1, descending=True)[:, :most]
        nodes = places.gather(1, first)
        pushed = force.gather(1, first[..., None].expand(-1, -1, 3)).flatten(1)
        dofs = (3 * nodes[..., None] + torch.arange(3, device=self.engine.device)).flatten(1)
        # C is symmetric: its rows stand for its columns.
        found = torch.nn.functional.embedding_bag(
            dofs, self._table, per_sample_weights=pushed.to(self.engine.real), mode="sum"
        )
        return found.double().view(len(places), -1, 3)

    def _gap_tolerance_mm(self, deepest: Tensor) -> Tensor:
        """As `gap_tolerance_mm`, for depths (b,)."""
        share, least = gap_tolerance_mm(self.tolerance, 1.0), gap_tolerance_mm(0.0, 0.0)
        return (max(share, 0.0 if self.engine.exact else SINGLE_GAP) * deepest).clamp(min=least)
