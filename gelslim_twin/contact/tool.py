"""The rigid tool at a pose: height, gap and normal of its lower surface, motion of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.profile import Profile, profile
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
DIFFERENCE_MM = 1e-4
MOST_SLOPE = 10.0
"""Largest slope; steeper flanks and walls are given this one."""
BENT = 0.03
"""Rise over the last plane per distance above which a wall is searched on the path."""
ROUNDING_MM = 1e-7
_SIDES = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]) * DIFFERENCE_MM


@dataclass(frozen=True, eq=False)
class Tool:
    """Shapes on one tool: profile, position (x, y) and height of the lowest point of each."""

    shapes: tuple[tuple[Profile, tuple[float, float], float], ...]

    @classmethod
    def of(cls, indenters: Sequence[Indenter], folder: Path, seed: int = 0) -> Tool:
        """The tool of a scene. Raises ValueError or OSError for an STL that cannot be read."""
        return cls(
            tuple(
                (profile(one, folder, seed), (one.x_mm, one.y_mm), one.raised_mm)
                for one in indenters
            )
        )

    def local(self, x: Array, y: Array) -> Array:
        """Height (n,) of the lower surface in the tool's frame; infinite outside its outline."""
        height = np.full(np.broadcast(x, y).shape, np.inf)
        for shape, (dx, dy), raised in self.shapes:
            height = np.minimum(height, shape(x - dx, y - dy) + raised)
        return height

    def clearance_mm(self, pose: Pose, points_mm: Array) -> Array:
        """Distance (n,) of points (n, 3) below the tool along its axis; infinite outside it."""
        own = _own(pose, points_mm)
        return np.asarray(self.local(own[:, 0], own[:, 1]) - own[:, 2])

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
        own, turn = _own(pose, points_mm), rotation(pose)
        height = self.local(own[:, 0], own[:, 1])
        slopes = np.zeros((len(own), 2))
        on = np.flatnonzero(height < own[:, 2] + reach_mm)
        if len(on):
            around = self.local(own[on, 0] + _SIDES[:, :1], own[on, 1] + _SIDES[:, 1:])
            for axis in (0, 1):
                ahead, behind = around[2 * axis], around[2 * axis + 1]
                slopes[on, axis] = _slope(behind, height[on], ahead)
        met = np.column_stack([own[:, :2], np.where(np.isfinite(height), height, 0.0)]) @ turn.T
        met += [pose.x_mm, pose.y_mm, -pose.depth_mm]
        met[~np.isfinite(height), 2] = np.inf
        normal = np.column_stack([-slopes, np.ones(len(own))])
        normal /= np.sqrt(1.0 + (slopes**2).sum(axis=1))[:, None]
        if pose.tilt_x_deg != 0 or pose.tilt_y_deg != 0 or slopes.any():
            normal = normal @ turn.T
        if before is not None:
            off = before.is_met & ~np.isfinite(height)
            held = np.flatnonzero(before.is_met & np.isfinite(height))
            last = _own(pose, before.met_mm[held])
            facing = before.normal[held] @ turn
            off[held] = _past_walls(self, last, facing, own[held, :2], height[held])
            met[off], normal[off] = before.met_mm[off], before.normal[off]
        return ToolSurface(met, normal)

    def carried(self, before: Pose, after: Pose, points_mm: Array) -> Array:
        """Positions at another pose of points (n, 3) that are fixed to the tool."""
        start = np.array([before.x_mm, before.y_mm, -before.depth_mm])
        end = np.array([after.x_mm, after.y_mm, -after.depth_mm])
        turn = rotation(after) @ rotation(before).T
        return np.asarray((points_mm - start) @ turn.T + end)


@lru_cache(maxsize=64)
def rotation(pose: Pose) -> Array:
    """Rotation matrix (3, 3) of a pose: twist about z first, then tilt about x, then about y.

    It is read-only, because a contact asks for that of its pose some twenty times.
    """
    cz, sz = _cos_sin(pose.twist_deg)
    cx, sx = _cos_sin(pose.tilt_x_deg)
    cy, sy = _cos_sin(pose.tilt_y_deg)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    turn = np.asarray(about_y @ about_x @ about_z)
    turn.flags.writeable = False
    return turn


def _cos_sin(angle_deg: float) -> tuple[float, float]:
    angle = np.radians(angle_deg)
    return float(np.cos(angle)), float(np.sin(angle))


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

    def turned(self, other: ToolSurface, share: Array) -> ToolSurface:
        """The same points, with normals interpolated by `share` (n,) from another's."""
        mixed = other.normal + share[:, None] * (self.normal - other.normal)
        return ToolSurface(self.met_mm, mixed / np.linalg.norm(mixed, axis=1)[:, None])

    def gap_mm(self, points_mm: Array) -> Array:
        """Gap (n,) between points (n, 3) and planes along the normals; negative for penetration."""
        return np.asarray(((self.met_mm - points_mm) * self.normal).sum(axis=1))

    @property
    def frames(self) -> Array | None:
        """(n, 3, 3): in the columns two tangents and the normal into the tool; None if level."""
        normal = self.normal
        if not normal[:, :2].any():
            return None
        # The first tangent has no part along y, the second is the normal times the first.
        size = np.hypot(normal[:, 0], normal[:, 2])
        frames = np.empty((len(normal), 3, 3))
        frames[:, 0, 0], frames[:, 2, 0] = normal[:, 2] / size, -normal[:, 0] / size
        frames[:, 1, 0] = 0.0
        frames[:, :, 2] = normal
        a, c = frames[:, 0, 0], frames[:, 2, 0]
        frames[:, 0, 1] = normal[:, 1] * c
        frames[:, 1, 1] = normal[:, 2] * a - normal[:, 0] * c
        frames[:, 2, 1] = -normal[:, 1] * a
        return frames


def _own(pose: Pose, points_mm: Array) -> Array:
    """Points in the frame of the tool."""
    return np.asarray((points_mm - [pose.x_mm, pose.y_mm, -pose.depth_mm]) @ rotation(pose))


def _past_walls(
    tool: Tool, last: Array, facing: Array, now: Array, height: Array
) -> NDArray[np.bool_]:
    """Whether (n,) the path from `last` (n, 3) on the tool to `now` (n, 2) passes an upward wall.

    All in the frame of the tool; `facing` (n, 3) are the normals at `last`, `height` (n,) is the
    height of the tool at `now`.
    """
    way = now - last[:, :2]
    plane = last[:, 2] - (way * facing[:, :2]).sum(axis=1) / np.maximum(facing[:, 2], 1e-9)
    far = np.hypot(way[:, 0], way[:, 1])
    jumps = height - plane > BENT * far + ROUNDING_MM
    some = np.flatnonzero(jumps)
    if len(some) == 0:
        return jumps
    a, b, low, high = last[some, :2], now[some], last[some, 2], height[some]
    # Bisection towards the steeper half, down to the step of the difference quotients.
    while far[some].max() > DIFFERENCE_MM:
        middle = (a + b) / 2
        between = tool.local(middle[:, 0], middle[:, 1])
        first = between >= (low + high) / 2
        a, low = np.where(first[:, None], a, middle), np.where(first, low, between)
        b, high = np.where(first[:, None], middle, b), np.where(first, between, high)
        far = far / 2
    jumps[some] = high - low > 2 * MOST_SLOPE * far[some] + ROUNDING_MM
    return jumps


def _slope(behind: Array, here: Array, ahead: Array) -> Array:
    """Central difference; at a rim the one-sided difference within the tool."""
    with np.errstate(invalid="ignore"):
        up, down = (ahead - here) / DIFFERENCE_MM, (here - behind) / DIFFERENCE_MM
    up = np.where(np.isfinite(up), up, down)
    down = np.where(np.isfinite(down), down, up)
    # Next to a wall the slope is that of this side.
    up, down = (
        np.where((np.abs(one) > 2 * MOST_SLOPE) & (np.abs(other) <= MOST_SLOPE), other, one)
        for one, other in ((up, down), (down, up))
    )
    mean = np.where(np.isfinite(up), (up + down) / 2, 0.0)
    # What differences of a level face leave is rounding.
    return np.where(np.abs(mean) < 1e-9, 0.0, np.clip(mean, -MOST_SLOPE, MOST_SLOPE))
