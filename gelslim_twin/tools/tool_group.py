"""Several rigid tools that move each on its own, as one tool to the contact.

Each node belongs to one of them: to the tool whose tangent plane it has passed farthest, or is
nearest to. The forces of the nodes are so divided among the tools, and their sum is the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Array, Tool, ToolSurface

NOBODY = -1


@dataclass(frozen=True)
class GroupPose(Pose):
    """Poses of the tools of a group at one time; its own coordinates have no meaning."""

    members: tuple[Pose, ...] = ()

    @classmethod
    def of(cls, time_s: float, members: tuple[Pose, ...]) -> GroupPose:
        """The poses of the members at one time."""
        return cls(time_s=time_s, depth_mm=max(p.depth_mm for p in members), members=members)

    def blended(self, later: Pose, part: float) -> GroupPose:
        """Linear interpolation of every member to a later pose, at `part` of the way."""
        pairs = zip(self.members, members_of(later), strict=True)
        time_s = self.time_s + part * (later.time_s - self.time_s)
        return GroupPose.of(time_s, tuple(a.blended(b, part) for a, b in pairs))


def members_of(pose: Pose) -> tuple[Pose, ...]:
    """The poses of the members of a group, or the pose of a single tool."""
    return pose.members if isinstance(pose, GroupPose) else (pose,)


@dataclass(frozen=True, eq=False)
class ToolGroup(Tool):
    """Tools of a `GroupPose`, in the same order; `shapes` is empty."""

    tools: tuple[Tool, ...] = ()

    def clearance_mm(self, pose: Pose, points_mm: Array) -> Array:
        """Distance (n,) of points (n, 3) below the nearest tool, each along its own axis."""
        return np.asarray(self._clearances(pose, points_mm).min(axis=0))

    def owners(self, pose: Pose, points_mm: Array) -> NDArray[np.intp]:
        """Number (n,) of the tool on whose surface a point (n, 3) lies, or that is nearest to it.

        A point below none, such as a node that has slipped off an edge, belongs to the tool of
        its nearest neighbour that is below one.
        """
        away = np.abs(self._clearances(pose, points_mm))
        found = away.argmin(axis=0)
        outside = ~np.isfinite(away).any(axis=0)
        if outside.any() and not outside.all():
            inside = np.flatnonzero(~outside)
            apart = points_mm[outside, None] - points_mm[None, inside]
            found[outside] = found[inside[np.einsum("ijk,ijk->ij", apart, apart).argmin(axis=1)]]
        return np.asarray(found)

    def surface(
        self,
        pose: Pose,
        points_mm: Array,
        before: ToolSurface | None = None,
        reach_mm: float = np.inf,
    ) -> ToolSurface:
        """Tangent planes at points (n, 3), each of the tool to which the point belongs.

        `before` and `reach_mm` count for every tool as in `Tool.surface`; a plane is held by the
        tool that it lies on.
        """
        held = np.full(len(points_mm), NOBODY)
        if before is not None:
            places = np.where(before.is_met[:, None], before.met_mm, 0.0)
            held = np.where(before.is_met, self.owners(pose, places), NOBODY)
        surfaces = []
        for number, (tool, own) in enumerate(zip(self.tools, members_of(pose), strict=True)):
            kept = None if before is None else before.only(np.asarray(held == number))
            surfaces.append(tool.surface(own, points_mm, kept, reach_mm))
        return _nearest(surfaces, points_mm)

    def above(self, pose: Pose, points_mm: Array, reach_mm: float = np.inf) -> ToolSurface:
        """Tangent planes where verticals through points (n, 3) meet the first of the tools."""
        pairs = zip(self.tools, members_of(pose), strict=True)
        surfaces = [tool.above(own, points_mm, reach_mm) for tool, own in pairs]
        return _nearest(surfaces, points_mm)

    def carried(self, before: Pose, after: Pose, points_mm: Array) -> Array:
        """Positions at another pose of points (n, 3), each fixed to the tool that it belongs to.

        A point that is below no tool before belongs to the tool that it is below after.
        """
        own = self._clearances(before, points_mm)
        late = self._clearances(after, points_mm)
        outside = ~np.isfinite(own).any(axis=0)
        owner = np.abs(np.where(outside, late, own)).argmin(axis=0)
        moves = [
            tool.carried(a, b, points_mm)
            for tool, a, b in zip(self.tools, members_of(before), members_of(after), strict=True)
        ]
        return np.asarray(np.stack(moves)[owner, np.arange(len(points_mm))])

    def _clearances(self, pose: Pose, points_mm: Array) -> Array:
        """(k, n) of every tool."""
        pairs = zip(self.tools, members_of(pose), strict=True)
        return np.stack([tool.clearance_mm(own, points_mm) for tool, own in pairs])


def _nearest(surfaces: list[ToolSurface], points_mm: Array) -> ToolSurface:
    """Of several planes at each point (n, 3) the one that it has passed farthest, or is nearest."""
    gaps = [np.where(s.is_met, s.gap_mm(points_mm), np.inf) for s in surfaces]
    first, at = np.argmin(gaps, axis=0), np.arange(len(points_mm))
    return ToolSurface(
        np.stack([s.met_mm for s in surfaces])[first, at],
        np.stack([s.normal for s in surfaces])[first, at],
    )
