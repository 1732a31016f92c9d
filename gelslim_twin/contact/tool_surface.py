"""How far the tool's surface is from points of the gel, and which way it faces there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.tool import Tool
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
DIFFERENCE_MM = 1e-4
MOST_SLOPE = 10.0
"""Steeper flanks count as this steep: a wall is a flank that nothing slips past."""


@dataclass(frozen=True, eq=False)
class ToolSurface:
    """The tool over n places: a plane at each, by height and slopes along x and y.

    Height and slopes are those at `places_mm` (n, 2).
    """

    places_mm: Array
    height_mm: Array
    slopes: Array
    """(n, 2)."""

    def at(self, nodes: NDArray[np.intp]) -> ToolSurface:
        """The tool over some of the places."""
        return ToolSurface(self.places_mm[nodes], self.height_mm[nodes], self.slopes[nodes])

    def gap_mm(self, points_mm: Array) -> Array:
        """Distance (n,) of points (n, 3) to the planes along their normals; below 0 inside."""
        ahead = (self.slopes * (points_mm[:, :2] - self.places_mm)).sum(axis=1)
        return np.asarray((self.height_mm + ahead - points_mm[:, 2]) / self._size)

    @property
    def _size(self) -> Array:
        return np.asarray(np.sqrt(1.0 + (self.slopes**2).sum(axis=1)))

    @property
    def frames(self) -> Array | None:
        """(n, 3, 3): in the columns two tangents and the normal into the tool; None if level."""
        if not self.slopes.any():
            return None
        a, b = self.slopes.T
        zero = np.zeros_like(a)
        normal = np.stack([-a, -b, np.ones_like(a)], axis=1) / self._size[:, None]
        first = np.stack([np.ones_like(a), zero, a], axis=1) / np.sqrt(1 + a * a)[:, None]
        return np.stack([first, np.cross(normal, first), normal], axis=2)


def tool_surface(
    tool: Tool,
    pose: Pose,
    places_mm: Array,
    before: ToolSurface | None = None,
    below_mm: Array | None = None,
) -> ToolSurface:
    """The tool's surface over places (n, 2).

    A place beside the tool has an infinite height, or where `before` has one there, the height of
    that one's plane: a node that slips off an edge on the way to a solution is not let go at once.
    Slopes are found where the tool is lower than `below_mm` (n,), everywhere by default.
    """
    places = np.array(places_mm, dtype=float)
    height = tool.height_mm(pose, places[:, 0], places[:, 1])
    slopes = np.zeros((len(places), 2))
    on = np.flatnonzero(height < (np.inf if below_mm is None else below_mm))
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = DIFFERENCE_MM
        ahead, behind = (
            tool.height_mm(pose, *(places[on] + side * step).T) for side in (1.0, -1.0)
        )
        slopes[on, axis] = _slope(behind, height[on], ahead)
    if before is not None:
        off = np.flatnonzero(~np.isfinite(height) & np.isfinite(before.height_mm))
        moved = places[off] - before.places_mm[off]
        height[off] = before.height_mm[off] + (before.slopes[off] * moved).sum(axis=1)
        slopes[off] = before.slopes[off]
    return ToolSurface(places, height, slopes)


def _slope(behind: Array, here: Array, ahead: Array) -> Array:
    """Central difference; at a rim the one to the side where the tool goes on."""
    with np.errstate(invalid="ignore"):
        up, down = (ahead - here) / DIFFERENCE_MM, (here - behind) / DIFFERENCE_MM
    up = np.where(np.isfinite(up), up, down)
    down = np.where(np.isfinite(down), down, up)
    mean = np.where(np.isfinite(up), (up + down) / 2, 0.0)
    # What differences of a level face leave is rounding.
    return np.where(np.abs(mean) < 1e-9, 0.0, np.clip(mean, -MOST_SLOPE, MOST_SLOPE))
