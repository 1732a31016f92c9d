"""Tangent planes of a tool at many points of many poses.

The same geometry as `gelslim_twin.tools.tool` for one pose, with b poses of one tool at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.heights import Heights, tool_heights
from gelslim_twin.tools.tool import VERTICAL_STEPS, Tool
from gelslim_twin.tools.tool_kernel import (
    BENT,
    DIFFERENCE_MM,
    LEAST_SLOPE,
    MOST_SLOPE,
    ROUNDING_MM,
)


@dataclass(frozen=True, eq=False)
class Planes:
    """Planes by a point (b, m, 3) of each and unit normals (b, m, 3) into the tool.

    The point has an infinite z outside the tool's outline.
    """

    met_mm: Tensor
    normal: Tensor

    @property
    def is_met(self) -> Tensor:
        """Whether (b, m) the tool lies above the point."""
        return self.met_mm[..., 2].isfinite()

    def only(self, kept: Tensor) -> Planes:
        """The same planes, removed except at `kept` (b, m)."""
        met = self.met_mm.clone()
        met[..., 2].masked_fill_(~kept, np.inf)
        return Planes(met, self.normal)

    def at(self, nodes: Tensor) -> Planes:
        """The planes of `nodes` (b, k) among the points."""
        index = nodes[..., None].expand(-1, -1, 3)
        return Planes(self.met_mm.gather(1, index), self.normal.gather(1, index))

    def of(self, poses: Tensor) -> Planes:
        """The planes of some of the poses, by number (k,) or mask (b,)."""
        return Planes(self.met_mm[poses], self.normal[poses])

    def gap_mm(self, points_mm: Tensor) -> Tensor:
        """Gap (b, m) between points (b, m, 3) and planes; negative for penetration."""
        return ((self.met_mm - points_mm) * self.normal).sum(dim=-1)

    def over(self, points_mm: Tensor) -> Tensor:
        """Where (b, m, 3) verticals along z through points (b, m, 3) meet the planes."""
        above = points_mm.clone()
        rise = self.gap_mm(points_mm) / self.normal[..., 2]
        above[..., 2] = (points_mm[..., 2] + rise).masked_fill(~self.is_met, np.inf)
        return above

    def levelled(self, points_mm: Tensor) -> Planes:
        """Level planes where verticals along z through points (b, m, 3) meet these planes."""
        normal = self.normal.new_zeros(self.normal.shape)
        normal[..., 2] = 1.0
        return Planes(self.over(points_mm), normal)

    def turned(self, other: Planes, share: float) -> Planes:
        """The same points, with normals interpolated by `share` from another's."""
        mixed = other.normal + share * (self.normal - other.normal)
        return Planes(self.met_mm, mixed / mixed.norm(dim=-1, keepdim=True))


@dataclass(frozen=True, eq=False)
class PlacedTool:
    """A tool at b poses.

    Attributes:
        engine: Where it is computed.
        tool: The tool.
        origin_mm: Its origin (b, 3) in the sensor frame.
        turn: Its rotation (b, 3, 3).
    """

    engine: Engine
    tool: Tool
    origin_mm: Tensor
    turn: Tensor

    @cached_property
    def heights(self) -> Heights:
        """Height of the lower surface in the tool's frame."""
        return tool_heights(self.tool, self.engine)

    def of(self, poses: Tensor) -> PlacedTool:
        """The tool at some of the poses, by number (k,) or mask (b,)."""
        fewer = PlacedTool(self.engine, self.tool, self.origin_mm[poses], self.turn[poses])
        vars(fewer)["heights"] = self.heights
        return fewer

    def own(self, points_mm: Tensor) -> Tensor:
        """Points (b, m, 3) in the frame of the tool."""
        return (points_mm - self.origin_mm[:, None]) @ self.turn

    def clearance_mm(self, points_mm: Tensor) -> Tensor:
        """Distance (b, m) of points (b, m, 3) below the tool along its axis; infinite outside."""
        own = self.own(points_mm)
        return self.heights(own[..., 0], own[..., 1]) - own[..., 2]

    def surface(
        self, points_mm: Tensor, before: Planes | None = None, reach_mm: float = np.inf
    ) -> Planes:
        """Tangent planes at points (b, m, 3); arguments as of `Tool.surface`."""
        own = self.own(points_mm)
        height = self.heights(own[..., 0], own[..., 1])
        met = own.clone()
        met[..., 2] = height.masked_fill(height.isinf(), 0.0)
        met = met @ self.turn.transpose(1, 2) + self.origin_mm[:, None]
        met[..., 2].masked_fill_(height.isinf(), np.inf)
        normal = self.turn[:, None, :, 2].expand_as(points_mm).clone()
        on = (height < own[..., 2] + reach_mm).nonzero(as_tuple=True)
        normal[on] = self._normals(own[on], height[on], self.turn[on[0]])
        found = Planes(met, normal)
        if before is None:
            return found
        kept = self._kept(before, own, height)[..., None]
        torch = self.engine.torch
        return Planes(
            torch.where(kept, before.met_mm, met), torch.where(kept, before.normal, normal)
        )

    def _normals(self, own: Tensor, height: Tensor, turn: Tensor) -> Tensor:
        """Normals (k, 3) in the sensor frame at points (k, 3) of the tool's frame."""
        torch, x, y = self.engine.torch, own[:, 0], own[:, 1]
        d = DIFFERENCE_MM
        around = self.heights(torch.stack([x + d, x - d, x, x]), torch.stack([y, y, y + d, y - d]))
        sx = self._slope(around[1], height, around[0])
        sy = self._slope(around[3], height, around[2])
        size = (1.0 + sx * sx + sy * sy).sqrt()
        tilted = turn[..., 2] - turn[..., 0] * sx[:, None] - turn[..., 1] * sy[:, None]
        return tilted / size[:, None]

    def _slope(self, behind: Tensor, here: Tensor, ahead: Tensor) -> Tensor:
        """As `central_slope`: at a rim one-sided, next to a wall that of this side."""
        torch = self.engine.torch
        up, down = (ahead - here) / DIFFERENCE_MM, (here - behind) / DIFFERENCE_MM
        up = torch.where(up.isfinite(), up, down)
        down = torch.where(down.isfinite(), down, up)
        wall_up = (up.abs() > 2 * MOST_SLOPE) & (down.abs() <= MOST_SLOPE)
        wall_down = ~wall_up & (down.abs() > 2 * MOST_SLOPE) & (up.abs() <= MOST_SLOPE)
        up, down = torch.where(wall_up, down, up), torch.where(wall_down, up, down)
        mean = torch.where(up.isfinite(), (up + down) / 2, 0.0)
        mean = mean.masked_fill(mean.abs() < LEAST_SLOPE, 0.0)
        return mean.clamp(-MOST_SLOPE, MOST_SLOPE)

    def _kept(self, before: Planes, own: Tensor, height: Tensor) -> Tensor:
        """Whether (b, m) a point has left the tool or passed an upward wall since `before`."""
        last = self.own(before.met_mm)
        had = before.is_met
        lost = had & height.isinf()
        normal = before.normal @ self.turn
        way = own[..., :2] - last[..., :2]
        plane = last[..., 2] - (way * normal[..., :2]).sum(dim=-1) / normal[..., 2].clamp(min=1e-9)
        far = (way * way).sum(dim=-1).sqrt()
        steep = had & ~lost & (height - plane > BENT * far + ROUNDING_MM)
        some = steep.nonzero(as_tuple=True)
        if len(some[0]):
            lost[some] = self._past_walls(last[some], own[some][:, :2], height[some])
        return lost

    def _past_walls(self, last: Tensor, now: Tensor, height: Tensor) -> Tensor:
        """As `gelslim_twin.tools.tool._past_walls`, for points (k, 3) and (k, 2)."""
        torch = self.engine.torch
        a, b, low, high = last[:, :2], now, last[:, 2], height
        far = (b - a).norm(dim=1)
        while float(far.max()) > DIFFERENCE_MM:
            middle = (a + b) / 2
            between = self.heights(middle[:, 0], middle[:, 1])
            first = between >= (low + high) / 2
            a, low = torch.where(first[:, None], a, middle), torch.where(first, low, between)
            b, high = torch.where(first[:, None], middle, b), torch.where(first, between, high)
            far = far / 2
        return high - low > 2 * MOST_SLOPE * far + ROUNDING_MM

    def above(self, points_mm: Tensor, reach_mm: float) -> Planes:
        """Tangent planes where verticals along z through points (b, m, 3) meet the tool."""
        found = self.surface(points_mm, reach_mm=reach_mm)
        torch = self.engine.torch
        tilted = (self.turn[:, 2, 2] < 1.0)[:, None]
        for _ in range(VERTICAL_STEPS if bool(tilted.any()) else 0):
            on = tilted & found.is_met & (found.gap_mm(points_mm) < reach_mm)
            places = torch.where(on[..., None], found.over(points_mm), points_mm)
            ahead = self.surface(places, reach_mm=np.inf)
            met = (on & ahead.is_met)[..., None]
            found = Planes(
                torch.where(met, ahead.met_mm, found.met_mm),
                torch.where(met, ahead.normal, found.normal),
            )
        return found
