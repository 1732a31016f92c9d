"""A half-space as the contact's solver takes a gel: a lattice of square patches in closed form."""

from __future__ import annotations

import math
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


class HalfSpace:
    """`SurfaceResponse` of n x n patches of one pitch, each under an even pressure.

    Normal by Love (1929), tangential by Cerruti with the same integrals over a patch. For
    Poisson's ratio 0.5, where normal and tangential motions do not couple.
    """

    POISSON = 0.5

    def __init__(self, count: int, pitch_mm: float, youngs_mpa: float) -> None:
        axis = (np.arange(count) - (count - 1) / 2) * pitch_mm
        x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
        self.points_mm = np.column_stack([x, y, np.zeros_like(x)])
        self.nodes, self.pitch_mm, self.youngs_mpa = len(x), pitch_mm, youngs_mpa
        mesh = SimpleNamespace(surface_mm=self.points_mm, cell_size_mm=(pitch_mm, pitch_mm, 1.0))
        self.bundle: Any = SimpleNamespace(mesh=mesh)

    @cached_property
    def whole(self) -> Array:
        """Motion (c, 3, c, 3) of all nodes by 1 N on each along each axis."""
        apart = self.points_mm[:, None] - self.points_mm
        h = self.pitch_mm / 2
        xx, xy = np.zeros((2, self.nodes, self.nodes))
        yy = np.zeros_like(xx)
        for sx in (1, -1):
            for sy in (1, -1):
                x, y, sign = apart[..., 0] + sx * h, apart[..., 1] + sy * h, sx * sy
                r = np.hypot(x, y)
                # Integrals of x²/r³, y²/r³ and xy/r³; the first two add up to that of 1/r.
                xx += sign * y * np.log(x + r)
                yy += sign * x * np.log(y + r)
                xy -= sign * r
        inverse = xx + yy
        nu, found = self.POISSON, np.zeros((self.nodes, 3, self.nodes, 3))
        found[:, 2, :, 2] = (1 - nu) * inverse
        found[:, 0, :, 0] = (1 - nu) * inverse + nu * xx
        found[:, 1, :, 1] = (1 - nu) * inverse + nu * yy
        found[:, 0, :, 1] = found[:, 1, :, 0] = nu * xy
        return found * (1 + nu) / (math.pi * self.youngs_mpa * self.pitch_mm**2)

    def block(self, nodes: Nodes, known: Any = None) -> NDArray[np.float32]:
        """See `SurfaceResponse`."""
        size = 3 * len(nodes)
        own = self.whole[np.asarray(nodes)][:, :, np.asarray(nodes)]
        return own.reshape(size, size).astype(np.float32)

    def displacement(self, nodes: Nodes, force_n: Array, known_mm: Array | None = None) -> Array:
        """See `SurfaceResponse`."""
        force = np.zeros((self.nodes, 3))
        force[nodes] = force_n
        return (self.whole.reshape(3 * self.nodes, -1) @ force.ravel()).reshape(-1, 3)

    def store(self) -> None:
        """Nothing took time to compute."""
