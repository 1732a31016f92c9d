"""Heights of a tool's lower surface at many points, on the device.

Balls, convex bodies and height maps are evaluated on the device. Other profiles are functions of
NumPy arrays and are evaluated on the host.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.tools.profile import (
    NEGLIGIBLE,
    RIM_MM,
    BallProfile,
    ConvexProfile,
    HeightMap,
    Profile,
)
from gelslim_twin.tools.profile_kernel import LEVEL
from gelslim_twin.tools.tool import Tool

Heights = Callable[[Tensor, Tensor], Tensor]
"""Height in mm at points x and y of any shape; infinite outside the shape."""


def tool_heights(tool: Tool, engine: Engine) -> Heights:
    """Height of a tool's lower surface in its own frame."""
    parts = [(_profile_heights(p, engine), *at, raised) for p, at, raised in tool.shapes]

    def heights(x: Tensor, y: Tensor) -> Tensor:
        found = None
        for shape, dx, dy, raised in parts:
            own = shape(x - dx, y - dy) + raised
            found = own if found is None else engine.torch.minimum(found, own)
        return found

    return heights


def _profile_heights(profile: Profile, engine: Engine) -> Heights:
    match profile:
        case BallProfile():
            return _ball(profile, engine)
        case ConvexProfile():
            return _convex(profile, engine)
        case HeightMap():
            return _map(profile, engine)
    return _on_host(profile, engine)


def _ball(ball: BallProfile, engine: Engine) -> Heights:
    radius = ball.radius_mm

    def heights(x: Tensor, y: Tensor) -> Tensor:
        reach = engine.torch.hypot(x, y)
        square = reach * reach
        height = square / (radius + (radius * radius - square).clamp(min=0.0).sqrt())
        return height.masked_fill(reach > radius, np.inf)

    return heights


def _convex(body: ConvexProfile, engine: Engine) -> Heights:
    """As `convex_heights`."""
    faces = [(*map(float, n), float(r)) for n, r in zip(body.normals, body.reach_mm, strict=True)]

    def heights(x: Tensor, y: Tensor) -> Tensor:
        torch = engine.torch
        low, high = torch.full_like(x, -np.inf), torch.full_like(x, np.inf)
        outside = torch.zeros_like(x, dtype=torch.bool)
        for nx, ny, nz, reach in faces:
            room = reach - (x * nx + y * ny)
            if nz < -LEVEL:
                low = torch.maximum(low, room / nz)
            elif nz > LEVEL:
                high = torch.minimum(high, room / nz)
            else:
                outside |= room < -RIM_MM
        return low.masked_fill(outside | (low > high + RIM_MM), np.inf)

    return heights


def _map(grid: HeightMap, engine: Engine) -> Heights:
    """Bilinear, as `HeightMap`."""
    known = engine.double(grid.known_mm)
    missing = engine.double(grid.missing)
    first = float(grid.x_mm[0]), float(grid.y_mm[0])
    step = tuple(float(a[1] - a[0]) for a in (grid.x_mm, grid.y_mm))
    counts = grid.height_mm.shape

    def heights(x: Tensor, y: Tensor) -> Tensor:
        at = [(v - a) / d for v, a, d in zip((x, y), first, step, strict=True)]
        beside = engine.torch.zeros_like(x, dtype=engine.torch.bool)
        cells, parts = [], []
        for place, count in zip(at, counts, strict=True):
            beside |= ~((place >= 0) & (place <= count - 1))
            cell = place.nan_to_num(0.0).clamp(0, count - 1).floor().clamp(max=count - 2).long()
            cells.append(cell)
            parts.append(place - cell)
        (i, j), (u, v) = cells, parts
        share, height = engine.torch.zeros_like(x), engine.torch.zeros_like(x)
        for a, p in ((0, 1 - u), (1, u)):
            for b, q in ((0, 1 - v), (1, v)):
                weight = p * q
                share = share + weight * missing[i + a, j + b]
                height = height + weight * known[i + a, j + b]
        return height.masked_fill(beside | (share > NEGLIGIBLE), np.inf)

    return heights


def _on_host(profile: Profile, engine: Engine) -> Heights:
    def heights(x: Tensor, y: Tensor) -> Tensor:
        flat = (v.reshape(-1).cpu().numpy() for v in (x, y))
        return engine.double(profile(*flat)).reshape(x.shape)

    return heights
