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

from ifem_export.assembly.weighted_assembly import corner_fill, mesh_stiffness
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.layered_operator import (
    LayeredOperator,
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    surface_compliance,
    surface_stiffness,
)
from ifem_export.operators.weighted_guess import Guess, WeightedGuess

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PadSystem:
    """Stiffness of a pad bonded at its lower face. Raises MeshError unless uniformly thick."""

    mesh: PadMesh
    element_matrix: Array

    def __post_init__(self) -> None:
        cells = np.asarray(self.mesh.occupancy)
        even = (cells == cells[:, :, :1]).all()
        if even and self.mesh.fill is not None:
            even = (self.mesh.fill == self.mesh.fill[:, :, :1]).all()
        if not even or self.mesh.surface_shift is not None:
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

    @property
    def is_cut(self) -> bool:
        """Whether the pad has cut cells or a crown, which the infinite pad does not foresee."""
        return self.mesh.fill is not None or self.mesh.surface_shift is not None

    @property
    def guess_layers(self) -> tuple[int, int]:
        """Layers in which `compliance_guess` and `inner_guess` take their fields."""
        return self.layers, self.layers - 1

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """Lattice places (c, 2) of the columns, (j, i)."""
        numbering = self.mesh.numbering
        _, j, i = np.unravel_index(numbering.positions[-self.columns :], numbering.shape)
        return np.stack([j, i], axis=1)

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """Free-free stiffness (3Lc, 3Lc) in N/mm."""
        whole = mesh_stiffness(self.mesh, np.asarray(self.element_matrix))
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
    def compliance_guess(self) -> Guess:
        """Inverse of the infinite pad: preconditioner of `stiffness`."""
        return self._weighted(self._operator(inverse))

    @cached_property
    def inner_guess(self) -> Guess:
        """The same for `inner`."""
        return self._weighted(self._operator(inner_compliance))

    @cached_property
    def surface_guess(self) -> LayeredOperator:
        """Surface stiffness S of the infinite pad."""
        return self._operator(surface_stiffness)

    @cached_property
    def surface_compliance_guess(self) -> LayeredOperator:
        """Surface compliance of the infinite pad."""
        return self._operator(surface_compliance)

    def _weighted(self, guess: LayeredOperator) -> Guess:
        if self.mesh.fill is None:
            return guess
        weight = node_weight(self.mesh)[self.columns :].reshape(self.layers, -1)
        inner = guess.blocks.shape[-1] < 3 * self.layers
        return WeightedGuess(guess, weight[:-1] if inner else weight)

    def _operator(self, change) -> LayeredOperator:  # type: ignore[no-untyped-def]
        rows, columns = (int(n) + 1 for n in self.places.max(axis=0))
        padding = padding_columns(self.mesh.cell_size_mm, self.layers, (rows, columns))
        return layered_operator(
            np.asarray(self.element_matrix), self.layers, self.places, padding, change
        )


def node_weight(mesh: PadMesh) -> Array:
    """D^-1/2 (n,) of every node, D the mean fill of the cells round it; 1 where all are full."""
    if mesh.fill is None:
        return np.ones(mesh.n_nodes)
    numbering = mesh.numbering
    around = corner_fill(np.asarray(mesh.occupancy), np.asarray(mesh.fill))[numbering.positions]
    return np.asarray(np.sqrt((around > 0.0).sum(axis=1) / around.sum(axis=1)))
