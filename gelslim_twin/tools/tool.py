"""The rigid tool at a pose: height, gap and normal of its lower surface, motion of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.tools.profile import Profile, profile
from gelslim_twin.tools.tool_kernel import (
    DIFFERENCE_MM,
    MOST_SLOPE,
    ROUNDING_MM,
    carried_points,
    gaps_to_planes,
    node_frames,
    own_coordinates,
    paths_to_walls,
    tangent_planes,
)

Array = NDArray[np.float64]
VERTICAL_STEPS = 2
_SIDES = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]) * DIFFERENCE_MM


@dataclass(frozen=True, eq=False)
class Tool:
    """Shapes on one tool: profile, position (x, y) and height of the lowest point of each."""

    shapes: tuple[tuple[Profile, tuple[float, float], float], ...]

    @classmethod
    def of(cls, indenters: Sequence[Indenter], folder: Path, seed: int = 0) -> Tool:
        """The tool of a scene. Raises ValueError or OSError for a mesh that cannot be read."""
        return cls(
            tuple(
                (profile(one, folder, seed), (one.x_mm, one.y_mm), one.raised_mm)
                for one in indenters
            )
        )

    def local(self, x: Array, y: Array) -> Array:
        """Height (n,) of the lower surface in the tool's frame; infinite outside its outline."""
        heights = [
            shape(x - dx, y - dy) + raised if dx or dy or raised else shape(x, y)
            for shape, (dx, dy), raised in self.shapes
        ]
        return heights[0] if len(heights) == 1 else np.asarray(np.min(heights, axis=0))

    def clearance_mm(self, pose: Pose, points_mm: Array) -> Array:
        """Distance (n,) of points (n, 3) below the tool along its axis; infinite outside it."""
        x, y, z = _own(pose, points_mm)
        return np.asarray(self.local(x, y) - z)

    def surface(
        self,
        pose: Pose,
        points_mm: Array,
        before: ToolSurface | None = None,
        reach_mm: float = np.inf,
    ) -> ToolSurface:
        """Tangent planes of the tool at points (n, 3).

        A point outside the tool has no plane, unless `before` has one for it. So a node that slips
        off an edge within the iteration keeps the plane of the edge, also where another part of the
        tool stands above it. Slopes are computed for points nearer than `reach_mm` only; the other
        planes are perpendicular to the tool's axis.
        """
        own, turn, origin = _own(pose, points_mm), rotation(pose), _origin(pose)
        height = self.local(own[0], own[1])
        on = np.flatnonzero(height < own[2] + reach_mm)
        at = own[:, on]
        around = self.local(at[0] + _SIDES[:, :1], at[1] + _SIDES[:, 1:])
        met, normal = np.empty(points_mm.shape), np.empty(points_mm.shape)
        tangent_planes(own, height, on, around, origin, turn, met, normal)
        if before is not None:
            kept = self._kept(before, pose, own, height)
            met[kept], normal[kept] = before.met_mm[kept], before.normal[kept]
        return ToolSurface(met, normal)

    def _kept(
        self, before: ToolSurface, pose: Pose, own: Array, height: Array
    ) -> NDArray[np.bool_]:
        """Whether (n,) a point has left the tool or passed an upward wall since `before`."""
        kept, steep = np.empty(len(height), dtype=bool), np.empty(len(height), dtype=bool)
        last = _own(pose, before.met_mm)
        paths_to_walls(last, before.normal, rotation(pose), own, height, kept, steep)
        some = np.flatnonzero(steep)
        if len(some):
            kept[some] = _past_walls(self, last[:, some].T, own[:2, some].T, height[some])
        return kept

    def above(self, pose: Pose, points_mm: Array, reach_mm: float = np.inf) -> ToolSurface:
        """Tangent planes of the tool where verticals through points (n, 3) meet it.

        The verticals are along z, whatever the tilt of the tool, so that a few steps of Newton's
        method find where they meet a tilted one. Arguments as of `surface`.
        """
        found = self.surface(pose, points_mm, reach_mm=reach_mm)
        for _ in range(VERTICAL_STEPS if rotation(pose)[2, 2] < 1.0 else 0):
            on = np.flatnonzero(found.is_met & (found.gap_mm(points_mm) < reach_mm))
            ahead = self.surface(pose, found.at(on).over(points_mm[on]))
            met = ahead.is_met
            found.met_mm[on[met]], found.normal[on[met]] = ahead.met_mm[met], ahead.normal[met]
        return found

    def carried(self, before: Pose, after: Pose, points_mm: Array) -> Array:
        """Positions at another pose of points (n, 3) that are fixed to the tool."""
        start = np.array([before.x_mm, before.y_mm, -before.depth_mm])
        end = np.array([after.x_mm, after.y_mm, -after.depth_mm])
        moved = np.empty(points_mm.shape)
        carried_points(points_mm, start, rotation(after) @ rotation(before).T, end, moved)
        return moved


@dataclass(frozen=True, eq=False)
class ToolSurface:
    """Tangent planes of the tool at n points, taken along the tool's axis."""

    met_mm: Array
    """(n, 3) a point of each plane; infinite z outside the tool's outline."""
    normal: Array
    """(n, 3) unit normals into the tool."""

    def at(self, nodes: NDArray[np.intp]) -> ToolSurface:
        """The planes of some of the points."""
        return ToolSurface(self.met_mm[nodes], self.normal[nodes])

    @property
    def is_met(self) -> NDArray[np.bool_]:
        """Whether (n,) the tool lies above the point."""
        return np.asarray(np.isfinite(self.met_mm[:, 2]))

    def only(self, kept: NDArray[np.bool_]) -> ToolSurface:
        """The same planes, removed except at `kept` (n,)."""
        met = self.met_mm.copy()
        met[~kept, 2] = np.inf
        return ToolSurface(met, self.normal)

    def over(self, points_mm: Array) -> Array:
        """Where (n, 3) verticals along z through points (n, 3) meet the planes."""
        above = np.array(points_mm)
        rise = self.gap_mm(points_mm) / self.normal[:, 2]
        above[:, 2] = np.where(self.is_met, points_mm[:, 2] + rise, np.inf)
        return above

    def levelled(self, points_mm: Array) -> ToolSurface:
        """Level planes where verticals along z through points (n, 3) meet these planes."""
        normal = np.zeros_like(self.normal)
        normal[:, 2] = 1.0
        return ToolSurface(self.over(points_mm), normal)

    def turned(self, other: ToolSurface, share: Array) -> ToolSurface:
        """The same points, with normals interpolated by `share` (n,) from another's."""
        mixed = other.normal + share[:, None] * (self.normal - other.normal)
        return ToolSurface(self.met_mm, mixed / np.linalg.norm(mixed, axis=1)[:, None])

    def gap_mm(self, points_mm: Array) -> Array:
        """Gap (n,) between points (n, 3) and planes along the normals; negative for penetration."""
        gap = np.empty(len(points_mm))
        gaps_to_planes(self.met_mm, self.normal, points_mm, gap)
        return gap

    @property
    def frames(self) -> Array | None:
        """(n, 3, 3): in the columns two tangents and the normal into the tool; None if level."""
        if not self.normal[:, :2].any():
            return None
        frames = np.empty((len(self.normal), 3, 3))
        node_frames(self.normal, frames)
        return frames


def _origin(pose: Pose) -> Array:
    """The tool's origin (3,) in the sensor frame."""
    return np.array([pose.x_mm, pose.y_mm, -pose.depth_mm])


def _own(pose: Pose, points_mm: Array) -> Array:
    """Points (n, 3) in the frame of the tool, as (3, n)."""
    own = np.empty((3, len(points_mm)))
    own_coordinates(points_mm, _origin(pose), rotation(pose), own)
    return own


def _past_walls(tool: Tool, last: Array, now: Array, height: Array) -> NDArray[np.bool_]:
    """Whether (n,) the path from `last` (n, 3) on the tool to `now` (n, 2) passes an upward wall.

    All in the frame of the tool; `height` (n,) is the height of the tool at `now`.
    """
    a, b, low, high = last[:, :2], now, last[:, 2], height
    far = np.hypot(*(now - last[:, :2]).T)
    # Bisection towards the steeper half, down to the step of the difference quotients.
    while far.max() > DIFFERENCE_MM:
        middle = (a + b) / 2
        between = tool.local(middle[:, 0], middle[:, 1])
        first = between >= (low + high) / 2
        a, low = np.where(first[:, None], a, middle), np.where(first, low, between)
        b, high = np.where(first[:, None], middle, b), np.where(first, between, high)
        far = far / 2
    return np.asarray(high - low > 2 * MOST_SLOPE * far + ROUNDING_MM)
