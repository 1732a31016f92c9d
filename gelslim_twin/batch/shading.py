"""Light of many deformed surfaces over that of level ones: slopes, shadows and parallax.

The same equations as `gelslim_twin.render.shading`, `surface_kernel` and `relief_kernel`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light.light_fans import STEEPEST
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.relief import BIN_WIDTH, LATTICE_MM, fall_of_light, relief_of
from gelslim_optics.light.relief_kernel import LOWEST, MOST, SMALLEST_MM, TOWARDS
from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.surfaces import BatchedSurfaces
from gelslim_twin.render.shading import NEAR_MM, ROUNDS, Shading
from gelslim_twin.render.surface_kernel import BEYOND_CELLS
from gelslim_twin.render.surroundings import Sight

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BatchedShading:
    """Shades the surfaces that one camera sees.

    Attributes:
        engine: Where it is computed.
        shading: The effect.
        sight: Rays of the lattice that is computed.
        light: The light.
    """

    engine: Engine
    shading: Shading
    sight: Sight
    light: LightMap

    @cached_property
    def _rest_mm(self) -> Tensor:
        return self.engine.double(self.sight.rest_mm.reshape(-1, 2)).to(self.engine.real)

    @cached_property
    def _lean(self) -> Tensor:
        return self.engine.double(self.sight.slope.reshape(-1, 2)).to(self.engine.real)

    def gain(self, surfaces: BatchedSurfaces) -> Tensor:
        """Irradiance (b, rows, columns, k) over that of a level surface, as `Shading.gain`."""
        slopes, met = self._seen(surfaces)
        light = self._fan_light(slopes)
        if self.shading.relief:
            light = light * self._at(self._relief(surfaces), surfaces, met)
        light = light + self.shading.ambient_share * (1 - light)
        return light.unflatten(1, self.sight.rest_mm.shape[:2])

    def _seen(self, surfaces: BatchedSurfaces) -> tuple[Tensor, Tensor]:
        """Slopes (b, n, 2) of the surfaces and their material points (b, n, 2) that rays meet."""
        torch, rest, lean = self.engine.torch, self._rest_mm, self._lean
        beyond = torch.zeros_like(rest[:, 0], dtype=torch.bool)
        axes = zip(surfaces.origin_mm, surfaces.step_mm, surfaces.counts, strict=True)
        for axis, (origin, step, count) in enumerate(axes):
            off = (2 * (rest[:, axis] - origin) / step - count + 1).abs()
            beyond |= off > count + BEYOND_CELLS
        met = rest.expand(len(surfaces.displacement_mm), -1, -1).clone()
        moving = ~beyond.expand(met.shape[:2])
        for _ in range(ROUNDS):
            u = surfaces.moved(met)
            ahead = rest + lean * u[..., 2:] - u[..., :2]
            left = (ahead - met).abs().sum(dim=-1)
            met = torch.where(moving[..., None], ahead, met)
            moving = moving & (left >= NEAR_MM)
            if not bool(moving.any()):
                break
        _, along, across = surfaces.with_slopes(met)
        xx, yx, zx = 1 + along[..., 0], along[..., 1], along[..., 2]
        xy, yy, zy = across[..., 0], 1 + across[..., 1], across[..., 2]
        det = xx * yy - xy * yx
        slopes = torch.stack([(zx * yy - zy * yx) / det, (zy * xx - zx * xy) / det], dim=-1)
        return slopes.masked_fill(beyond[:, None], 0.0), met

    def _fan_light(self, slopes: Tensor) -> Tensor:
        """Light (b, n, k) over that of a level surface by its slopes (b, n, 2)."""
        torch, fans = self.engine.torch, self.light.light_fans
        tables = torch.as_tensor(fans.tables, device=self.engine.device).to(self.engine.real)
        sources, places_y, places_x, count, _ = tables.shape
        flat = tables.flatten()
        size = (1.0 + (slopes * slopes).sum(dim=-1)).sqrt()
        a, s = _part((slopes[..., 0] / steepest_half(count)) + (count - 1) / 2, count)
        b, t = _part((slopes[..., 1] / steepest_half(count)) + (count - 1) / 2, count)
        corners = self._corners(places_x, places_y)
        found = []
        for source in range(sources):
            light = torch.zeros_like(size)
            for i, j, share in corners:
                table = ((source * places_y + j) * places_x + i) * count
                low, high = (table + b) * count + a, (table + b + 1) * count + a
                below = (1 - s) * flat[low] + s * flat[low + 1]
                above = (1 - s) * flat[high] + s * flat[high + 1]
                light = light + share * ((1 - t) * below + t * above)
            found.append(light / size)
        return torch.stack(found, dim=-1)

    def _corners(self, places_x: int, places_y: int) -> list[tuple[Tensor, Tensor, Tensor]]:
        """Numbers along x and y (n,) and shares (n,) of the places around each ray at rest."""
        fans = self.light.light_fans
        return _corners(self._rest_mm, fans.lower_mm, fans.upper_mm, places_x, places_y)

    def _at(self, factor: Tensor, surfaces: BatchedSurfaces, met: Tensor) -> Tensor:
        """A factor (b, ny, nx, k) on the lattice of `_relief` at points (b, n, 2), bilinear."""
        _, ny, nx, sources = factor.shape
        stride, origin = self._stride(surfaces), surfaces.origin_mm
        step = tuple(stride * s for s in surfaces.step_mm)
        i, u = _part((met[..., 0] - origin[0]) / step[0], nx)
        j, v = _part((met[..., 1] - origin[1]) / step[1], ny)
        flat = factor.flatten(1, 2)
        found = 0.0
        for p, q in itertools.product((0, 1), (0, 1)):
            index = ((j + q) * nx + i + p)[..., None].expand(-1, -1, sources)
            share = (u if p else 1 - u) * (v if q else 1 - v)
            found = found + share[..., None] * flat.gather(1, index)
        return found

    def _stride(self, surfaces: BatchedSurfaces) -> int:
        return max(1, round(LATTICE_MM / min(surfaces.step_mm)))

    def _relief(self, surfaces: BatchedSurfaces) -> Tensor:
        """Light (b, ny, nx, k) of every few nodes over that of their slopes alone."""
        torch, stride = self.engine.torch, self._stride(surfaces)
        height = surfaces.displacement_mm[:, ::stride, ::stride, 2]
        step = stride * surfaces.step_mm[0], stride * surfaces.step_mm[1]
        horizon = horizons(self.engine, height, step)
        slope_y, slope_x = _central(height, 1, step[1]), _central(height, 2, step[0])
        _, rows, columns = height.shape
        bins = self._bins(surfaces.origin_mm, step, (rows, columns))
        alone = found = torch.full_like(height[..., None], 1e-12)
        z = height[..., None, None]
        for corner in bins.corners:
            fan = corner.fan
            light = fan[..., 0] - slope_x[..., None, None] * fan[..., 1]
            light = (light - slope_y[..., None, None] * fan[..., 2]).clamp(min=0.0) * corner.share
            alone = alone + light.sum(dim=-1)
            light = light * (1.0 - z * corner.drift).clamp(0.0, MOST)
            hidden = (
                horizon.flatten(1, 2)
                .gather(2, corner.side.flatten(0, 1).flatten(1).expand(len(height), -1, -1))
                .view(len(height), *corner.side.shape)
            )
            clear = (0.5 + (corner.rise - hidden) / BIN_WIDTH).clamp(0.0, 1.0)
            found = found + (light * torch.where(hidden > 0.0, clear, 1.0)).sum(dim=-1)
        level = (height.abs() < SMALLEST_MM) & ~horizon.any(dim=-1)
        return torch.where(level[..., None], 1.0, found / alone)

    def _bins(
        self, origin: tuple[float, float], step: tuple[float, float], shape: tuple[int, int]
    ) -> FanBins:
        key = origin, step, shape
        if key not in self._kept:
            self._kept[key] = FanBins.of(self.engine, self.light, origin, step, shape)
        return self._kept[key]

    @cached_property
    def _kept(self) -> dict[tuple[object, ...], FanBins]:
        return {}


@dataclass(frozen=True, eq=False)
class FanCorner:
    """Directions of the light at one of the places around each node of a lattice.

    Attributes:
        fan: Sums (ny, nx, k, b, 3) of `LightFans`, 0 for dark bins.
        share: Weight (ny, nx, 1, 1) of the place at the node.
        rise: Tangents (ny, nx, k, b) of the elevation.
        side: Directions (ny, nx, k, b) among those of the horizon.
        drift: Decrease (ny, nx, k, b) of the light per mm of height.
    """

    fan: Tensor
    share: Tensor
    rise: Tensor
    side: Tensor
    drift: Tensor


@dataclass(frozen=True, eq=False)
class FanBins:
    """Directions of the light at the nodes of a lattice, for the places around each of them."""

    corners: tuple[FanCorner, ...]

    @classmethod
    def of(
        cls,
        engine: Engine,
        light: LightMap,
        origin: tuple[float, float],
        step: tuple[float, float],
        shape: tuple[int, int],
    ) -> FanBins:
        """Those of a lattice of nodes from `origin` in steps of `step`."""
        torch, fans = engine.torch, light.light_fans
        relief = relief_of(light)
        sums, (counts, rises, sides, drifts) = relief.sums, relief.bins
        dark = np.arange(sums.shape[3]) >= counts[..., None]
        sums = np.where(dark[..., None], 0.0, sums)
        fall = engine.double(fall_of_light(light, origin, step, shape))
        x, y = (o + s * np.arange(n) for o, s, n in zip(origin, step, shape[::-1], strict=True))
        nodes = engine.double(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
        held = [engine.double(a) for a in (sums, rises, drifts)]
        direction = torch.as_tensor(sides.astype(np.int64), device=engine.device)
        corners = []
        places = _corners(nodes, fans.lower_mm, fans.upper_mm, sums.shape[2], sums.shape[1])
        for i, j, share in places:
            fan, rise, drift = (a[:, j, i].movedim(0, 1).unflatten(0, shape) for a in held)
            side = direction[:, j, i].movedim(0, 1).unflatten(0, shape)
            whole = fan[..., 0].clamp(min=1e-300)
            moved = (fall[..., None, :] * fan[..., 1:]).sum(dim=-1) / whole
            total = torch.where(fan[..., 0] > 0, drift + moved, 0.0)
            corners.append(
                FanCorner(
                    fan=fan.to(engine.real),
                    share=share.view(*shape, 1, 1).to(engine.real),
                    rise=rise.to(engine.real),
                    side=side,
                    drift=total.to(engine.real),
                )
            )
        return cls(tuple(corners))


def horizons(engine: Engine, height: Tensor, step: tuple[float, ...]) -> Tensor:
    """Horizon (b, ny, nx, 16) of each node in each direction, as `relief_kernel.horizons`."""
    torch = engine.torch
    _, ny, nx = height.shape
    depth = height.amax(dim=(1, 2), keepdim=True) - height
    depth = depth.masked_fill(depth < LOWEST * min(step), 0.0)
    deepest = float(depth.amax())
    found = []
    for a, b in TOWARDS.tolist():
        length = float(np.hypot(a * step[0], b * step[1]))
        best = torch.zeros_like(height)
        for number in range(1, max(ny, nx)):
            p, q, away = number * a, number * b, number * length
            if LOWEST * away >= deepest or abs(p) >= nx or abs(q) >= ny:
                break
            # The node is hidden by the one at this distance, which the light meets before.
            before = (slice(None), _window(ny, q), _window(nx, p))
            node = (slice(None), _window(ny, -q), _window(nx, -p))
            rise = (height[node] - height[before]) / away
            above = (LOWEST * away < depth[before]) & (rise > best[node].clamp(min=LOWEST))
            best[node] = torch.where(above, rise, best[node])
        found.append(best)
    return torch.stack(found, dim=-1)


def _window(count: int, shift: int) -> slice:
    """The places whose place before them by `shift` exists."""
    return slice(max(shift, 0), count + min(shift, 0))


def _central(height: Tensor, axis: int, step: float) -> Tensor:
    """Central differences along an axis, one-sided at its ends."""
    count = height.shape[axis]
    ahead = [*range(1, count), count - 1]
    behind = [0, *range(count - 1)]
    apart = height.new_tensor([a - b for a, b in zip(ahead, behind, strict=True)]) * step
    shape = [-1 if k == axis else 1 for k in range(height.dim())]
    take = [height.index_select(axis, height.new_tensor(n).long()) for n in (ahead, behind)]
    return (take[0] - take[1]) / apart.view(shape)


def steepest_half(count: int) -> float:
    """Slope between two values of a table with `count` values from the steepest to its opposite."""
    return 2 * STEEPEST / (count - 1)


def _part(at: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Number of the value before a coordinate held to `count` values, and the part beyond it."""
    held = at.clamp(0.0, count - 1.0)
    before = held.floor().clamp(max=max(count - 2, 0))
    return before.long(), held - before


def _corners(
    points: Tensor,
    lower: tuple[float, float],
    upper: tuple[float, float],
    places_x: int,
    places_y: int,
) -> list[tuple[Tensor, Tensor, Tensor]]:
    """Numbers along x and y (n,) and shares (n,) of the places around points (n, 2)."""
    parts = []
    for axis, count in enumerate((places_x, places_y)):
        at = (points[:, axis] - lower[axis]) / (upper[axis] - lower[axis]) * count - 0.5
        parts.append(_part(at, count))
    (i, u), (j, v) = parts
    found = []
    for q in range(min(places_y, 2)):
        for p in range(min(places_x, 2)):
            found.append((i + p, j + q, (v if q else 1 - v) * (u if p else 1 - u)))
    return found
