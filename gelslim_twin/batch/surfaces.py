"""Displaced surfaces of many poses between their nodes, by cubic convolution.

The same interpolation as `gelslim_twin.render.surface_state.SurfaceState`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.render.surface_state import NodeLattice

Array = NDArray[np.float64]
AROUND = 4
"""Nodes along each axis that a value is made of."""


@dataclass(frozen=True, eq=False)
class BatchedSurfaces:
    """The surfaces of b poses.

    Attributes:
        engine: Where they are computed.
        lattice: Places of the nodes.
        displacement_mm: (b, ny, nx, 3) in the precision of the engine.
    """

    engine: Engine
    lattice: NodeLattice
    displacement_mm: Tensor

    @classmethod
    def of(cls, engine: Engine, lattice: NodeLattice, nodes_mm: Array) -> BatchedSurfaces:
        """The surfaces of nodes displaced by (b, c, 3)."""
        shape = (len(nodes_mm), len(lattice.y_mm), len(lattice.x_mm), 3)
        moved = engine.double(nodes_mm).to(engine.real)
        at = engine.torch.as_tensor(lattice.nearest, device=engine.device)
        return cls(engine, lattice, moved[:, at].view(shape))

    @property
    def counts(self) -> tuple[int, int]:
        """Nodes along x and y."""
        return len(self.lattice.x_mm), len(self.lattice.y_mm)

    @property
    def origin_mm(self) -> tuple[float, float]:
        """The first node in x and y."""
        return float(self.lattice.x_mm[0]), float(self.lattice.y_mm[0])

    @property
    def step_mm(self) -> tuple[float, float]:
        """Distance between nodes along x and y."""
        axes = (self.lattice.x_mm, self.lattice.y_mm)
        return tuple(float(np.ptp(a)) / (len(a) - 1) for a in axes)  # type: ignore[return-value]

    @cached_property
    def _padded(self) -> Tensor:
        """(b, (ny + 2) (nx + 2), 3) with a ring of ghost nodes by linear extrapolation."""
        u, torch = self.displacement_mm, self.engine.torch
        u = torch.cat([2 * u[:, :1] - u[:, 1:2], u, 2 * u[:, -1:] - u[:, -2:-1]], dim=1)
        u = torch.cat([2 * u[:, :, :1] - u[:, :, 1:2], u, 2 * u[:, :, -1:] - u[:, :, -2:-1]], dim=2)
        return u.flatten(1, 2)

    def at(self, points_mm: Tensor) -> Tensor:
        """Displacement (b, n, 3) at the same material points (n, 2) of every pose."""
        here, wx, _, wy, _ = self._around(points_mm[None])
        weights = (wy[..., :, None] * wx[..., None, :]).flatten(-2)[0]
        found = self._padded[:, here[0].flatten()].view(-1, *here[0].shape, 3)
        return (found * weights[..., None]).sum(dim=2)

    def with_slopes(self, points_mm: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Displacement (b, n, 3) at points (b, n, 2), and its derivatives per mm along x and y."""
        here, wx, dx, wy, dy = self._around(points_mm)
        nodes = self._gathered(here)
        step = self.step_mm
        return (
            self._summed(nodes, wx, wy),
            self._summed(nodes, dx, wy) / step[0],
            self._summed(nodes, wx, dy) / step[1],
        )

    def moved(self, points_mm: Tensor) -> Tensor:
        """Displacement (b, n, 3) at points (b, n, 2)."""
        here, wx, _, wy, _ = self._around(points_mm)
        return self._summed(self._gathered(here), wx, wy)

    def _gathered(self, here: Tensor) -> Tensor:
        index = here.flatten(1)[..., None].expand(-1, -1, 3)
        return self._padded.gather(1, index).view(*here.shape, 3)

    def _summed(self, nodes: Tensor, wx: Tensor, wy: Tensor) -> Tensor:
        return (nodes * (wy[..., :, None] * wx[..., None, :]).flatten(-2)[..., None]).sum(dim=2)

    def _around(self, points: Tensor) -> tuple[Tensor, ...]:
        """Numbers (.., n, 16) of the nodes, and weights and slopes (.., n, 4) along x and y."""
        torch, firsts, found = self.engine.torch, [], []
        axes = zip(self.origin_mm, self.step_mm, self.counts, strict=True)
        for axis, (origin, step, count) in enumerate(axes):
            held = ((points[..., axis] - origin) / step).clamp(0.0, count - 1.0)
            cell = held.floor().clamp(max=count - 2)
            firsts.append(cell.long())
            found += self._weights(held - cell)
        ring = torch.arange(AROUND, device=self.engine.device)
        rows = (firsts[1][..., None] + ring) * (self.counts[0] + 2)
        here = rows[..., :, None] + (firsts[0][..., None] + ring)[..., None, :]
        return (here.flatten(-2), *found)

    def _weights(self, t: Tensor) -> list[Tensor]:
        """Weights and slopes (..., 4) of cubic convolution at 0 <= t <= 1 (Keys 1981)."""
        stack = self.engine.torch.stack
        weights = (
            t * (-0.5 + t * (1.0 - 0.5 * t)),
            1.0 + t * t * (-2.5 + 1.5 * t),
            t * (0.5 + t * (2.0 - 1.5 * t)),
            t * t * (-0.5 + 0.5 * t),
        )
        slopes = (
            -0.5 + t * (2.0 - 1.5 * t),
            t * (-5.0 + 4.5 * t),
            0.5 + t * (4.0 - 4.5 * t),
            t * (-1.0 + 1.5 * t),
        )
        return [stack(weights, dim=-1), stack(slopes, dim=-1)]
