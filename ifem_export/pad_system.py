"""The pad's equations, split into bonded, inner and surface unknowns.

A pad of uniform thickness has the same columns of nodes in every layer, so layer l holds the nodes
l·c … (l+1)·c - 1 and a field is an array (layers, c, 3): the split is by slices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly import assemble_csr
from ifem_export.errors import MeshError
from ifem_export.layered_operator import (
    LayeredOperator,
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    surface_compliance,
    surface_stiffness,
)
from ifem_export.pad_mesh import PadMesh

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PadSystem:
    """Stiffness of a pad bonded at its lower face. Raises MeshError unless uniformly thick."""

    mesh: PadMesh
    element_matrix: Array

    def __post_init__(self) -> None:
        cells = np.asarray(self.mesh.occupancy)
        if not (cells == cells[:, :, :1]).all():
            raise MeshError(
                "the pad's layers differ: condensation by layers needs a pad of uniform thickness"
            )

    @property
    def layers(self) -> int:
        """Layers of cells, and of free nodes."""
        return self.mesh.layers

    @property
    def columns(self) -> int:
        """Columns of nodes c, each with one node on the surface."""
        return self.mesh.n_nodes // (self.layers + 1)

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """Lattice places (c, 2) of the columns, (j, i)."""
        numbering = self.mesh.numbering
        _, j, i = np.unravel_index(numbering.positions[-self.columns :], numbering.shape)
        return np.stack([j, i], axis=1)

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """Free-free stiffness (3Lc, 3Lc) in N/mm."""
        whole = assemble_csr(
            np.asarray(self.mesh.occupancy),
            np.asarray(self.element_matrix),
            numbering=self.mesh.numbering,
        )
        bonded = 3 * self.columns
        return sparse.csr_array(whole[bonded:, bonded:])

    @cached_property
    def inner(self) -> sparse.csr_array:
        """Inner-inner block; empty for one layer."""
        n = self._inner_size
        return sparse.csr_array(self.stiffness[:n, :n])

    @cached_property
    def surface(self) -> sparse.csr_array:
        """Surface-surface block."""
        n = self._inner_size
        return sparse.csr_array(self.stiffness[n:, n:])

    @cached_property
    def inner_to_surface(self) -> sparse.csr_array:
        """Surface-inner block, K_si."""
        n = self._inner_size
        return sparse.csr_array(self.stiffness[n:, :n])

    @cached_property
    def surface_to_inner(self) -> sparse.csr_array:
        """Inner-surface block, K_is."""
        n = self._inner_size
        return sparse.csr_array(self.stiffness[:n, n:])

    @property
    def _inner_size(self) -> int:
        return 3 * self.columns * (self.layers - 1)

    @cached_property
    def compliance_guess(self) -> LayeredOperator:
        """Inverse of the infinite pad: preconditioner of `stiffness`."""
        return self._operator(inverse)

    @cached_property
    def inner_guess(self) -> LayeredOperator:
        """The same for `inner`."""
        return self._operator(inner_compliance)

    @cached_property
    def surface_guess(self) -> LayeredOperator:
        """Surface stiffness S of the infinite pad."""
        return self._operator(surface_stiffness)

    @cached_property
    def surface_compliance_guess(self) -> LayeredOperator:
        """Surface compliance of the infinite pad."""
        return self._operator(surface_compliance)

    def _operator(self, change) -> LayeredOperator:  # type: ignore[no-untyped-def]
        rows, columns = (int(n) + 1 for n in self.places.max(axis=0))
        padding = padding_columns(self.mesh.cell_size_mm, self.layers, (rows, columns))
        return layered_operator(
            np.asarray(self.element_matrix), self.layers, self.places, padding, change
        )
