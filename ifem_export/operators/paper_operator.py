"""The paper's surface operator: one layer, every node seen, F = K u by a stencil."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.assembly.occupancy_table import occupancy_table
from ifem_export.operators.surface_field import SolvedCompliance, checked

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Paper(SolvedCompliance):
    """Surface stiffness of a pad of one layer."""

    name: str = "paper"

    def force(self, displacement_mm: ArrayLike) -> Array:
        """K_ss u."""
        from ifem_export.operators.surface_kernel import apply_stencil

        u = checked(displacement_mm, self.system.columns)
        if self.system.mesh.fill is not None:
            return np.asarray(self.system.stiffness @ u.reshape(-1)).reshape(-1, 3)
        force = np.empty_like(u)
        apply_stencil(*self._stencil, np.vstack([u, np.zeros((1, 3))]), force)
        return force

    @property
    def n_bytes(self) -> int:
        """Bytes of table, types and neighbours; of the matrix where cells are scaled."""
        if self.system.mesh.fill is not None:
            k = self.system.stiffness
            return int(k.data.nbytes + k.indices.nbytes + k.indptr.nbytes)
        return int(sum(part.nbytes for part in self._stencil))

    @cached_property
    def _stencil(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """Type of each node, its neighbours (c where absent) and the blocks of each type."""
        s = self.system
        masks = s.mesh.numbering.masks[-s.columns :]
        kinds, types = np.unique(masks, return_inverse=True)
        table = occupancy_table(np.asarray(s.element_matrix))[kinds][:, 9:18]
        columns, rows = s.places[:, 1] + 1, s.places[:, 0] + 1
        lattice = np.full((rows.max() + 2, columns.max() + 2), s.columns, dtype=np.int64)
        lattice[rows, columns] = np.arange(s.columns)
        around = [lattice[rows + dy, columns + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
        blocks = np.ascontiguousarray(table.transpose(0, 2, 3, 1))
        return types.astype(np.int64), np.stack(around, axis=1), blocks
