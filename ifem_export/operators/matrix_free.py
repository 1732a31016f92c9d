"""Exact surface operator of a uniform pad that never assembles the stiffness matrix.

Nodes of one layer that have all their cells share their rows of the stiffness matrix, and the
others have one of 256 sets of cells (`occupancy_table`). A product with the matrix of a fine pad
therefore needs no matrix: it takes a quarter of the time of one that reads it, and a pad that is
used for a few solutions only, such as the reference of the ladder, is spared its assembly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.assembly.occupancy_table import occupancy_table
from ifem_export.errors import MeshError
from ifem_export.operators.layered_operator import INNER_NODE, TOP_NODE
from ifem_export.operators.pad_system import PadSystem, checked_field
from ifem_export.operators.preconditioner import Preconditioner
from ifem_export.operators.solver import ConjugateGradients, GradientsThenFactor, Solver

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LatticeProduct:
    """Forces of the free nodes of a pad for their displacements.

    Attributes:
        system: Equations of a flat pad.

    Raises:
        MeshError: The pad has cut cells, which differ from node to node.
    """

    system: PadSystem

    def __post_init__(self) -> None:
        if self.system.is_cut:
            raise MeshError("the pad has cut cells: it needs its matrix", field="mesh")

    def __call__(self, field: Array) -> Array:
        """Forces (m, c, 3) in N for displacements (m, c, 3) in mm of the m lowest free layers.

        Layers above them are held.
        """
        from ifem_export.operators.lattice_kernel import (
            apply_by_layers,
            apply_by_nodes,
            collect,
            spread,
        )

        layers, (_, rows, columns) = len(field), self.system.mesh.numbering.shape
        # Arrays of their own, because operators are shared between threads.
        u = np.zeros((3, layers + 2, rows + 2, columns + 2))
        out = np.empty((3, layers, rows, columns))
        found = np.empty_like(field)
        nodes, masks = self._rim
        count = int(np.searchsorted(nodes[:, 0], layers))
        spread(np.ascontiguousarray(field), *self._columns, u)
        apply_by_layers(u, self._table, self._layer_masks, out)
        apply_by_nodes(u, self._table, nodes[:count], masks[:count], out)
        collect(out, *self._columns, found)
        return found

    @property
    def n_bytes(self) -> int:
        """Bytes that a product reads and writes."""
        layers, (_, rows, columns) = self.system.layers, self.system.mesh.numbering.shape
        lattices = 24 * ((layers + 2) * (rows + 2) * (columns + 2) + layers * rows * columns)
        return lattices + int(sum(part.nbytes for part in (*self._columns, *self._rim)))

    @cached_property
    def _table(self) -> Array:
        return np.ascontiguousarray(occupancy_table(np.asarray(self.system.element_matrix)))

    @cached_property
    def _columns(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        rows, columns = self.system.lattice_positions.T
        return np.ascontiguousarray(rows), np.ascontiguousarray(columns)

    @cached_property
    def _layer_masks(self) -> NDArray[np.int64]:
        return np.array([INNER_NODE] * (self.system.layers - 1) + [TOP_NODE])

    @cached_property
    def _rim(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Nodes (n, 3) that lack cells of their layer, each (k, j, i), and their masks."""
        numbering = self.system.mesh.numbering
        places = np.stack(np.unravel_index(numbering.positions, numbering.shape), axis=1)
        free = places[self.system.columns :] - [1, 0, 0]
        masks = numbering.masks[self.system.columns :].astype(np.int64)
        lacking = masks != self._layer_masks[free[:, 0]]
        return np.ascontiguousarray(free[lacking]), masks[lacking]


@dataclass(frozen=True, eq=False)
class LatticeMatrix:
    """The stiffness matrix of the lowest free layers, the others held, as a product.

    Attributes:
        product: Product with that of all free nodes.
        layers: Layers that are not held.
        assembled: Assembles the matrix, for what cannot do without.
    """

    product: LatticeProduct
    layers: int
    assembled: Callable[[], sparse.csr_array]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of columns."""
        size = 3 * self.layers * self.product.system.columns
        return size, size

    def __matmul__(self, x: Array) -> Array:
        """Forces (n,) of displacements (n,) in the order of the assembled matrix."""
        return self.product(x.reshape(self.layers, -1, 3)).ravel()

    @property
    def n_bytes(self) -> int:
        """Bytes that a product reads and writes."""
        return self.product.n_bytes

    def tocsr(self) -> sparse.csr_array:
        """The assembled matrix."""
        return self.assembled()


@dataclass(frozen=True, eq=False)
class MatrixFreeOperator:
    """Exact condensation of a uniform pad, solved by conjugate gradients to a residual `rtol`.

    Attributes:
        system: Equations of a flat pad of several layers without cut cells.
        rtol: Relative residual of the solutions.
        name: Name of the operator.
    """

    system: PadSystem
    rtol: float
    name: str = "matrix_free"

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces (c, 3) in N that hold displacements (c, 3) in mm of the surface."""
        field = np.zeros((self.system.layers, self.system.columns, 3))
        field[-1] = checked_field(displacement_mm, self.system.columns)
        load = -self._product(field)[:-1]
        field[:-1] = self._inner.solve(load, self.rtol).x.reshape(load.shape)
        return np.asarray(self._product(field)[-1])

    def displacement(self, force_n: ArrayLike) -> Array:
        """Displacements (c, 3) in mm under forces (c, 3) in N on the surface."""
        load = np.zeros((self.system.layers, self.system.columns, 3))
        load[-1] = checked_field(force_n, self.system.columns)
        found = self._free.solve(load, self.rtol).x
        return np.asarray(found.reshape(load.shape)[-1])

    @property
    def n_bytes(self) -> int:
        """Bytes that an iteration of `force` reads."""
        return self._product.n_bytes + self.system.inner_preconditioner.blocks.nbytes

    @cached_property
    def _product(self) -> LatticeProduct:
        return LatticeProduct(self.system)

    @cached_property
    def _inner(self) -> Solver:
        """Solver of the inner nodes, the surface held."""
        return _held_solver(self._product)

    @cached_property
    def _free(self) -> Solver:
        """Solver of all free nodes."""
        system = self.system
        matrix = LatticeMatrix(self._product, system.layers, lambda: system.stiffness)
        return _solver(matrix, system.preconditioner)


def held_surface_solver(system: PadSystem) -> Solver:
    """Solver of the inner nodes with the surface held, K_ii u = f, which reads no matrix.

    Raises MeshError for a pad with cut cells.
    """
    return _held_solver(LatticeProduct(system))


def _held_solver(product: LatticeProduct) -> Solver:
    system = product.system
    matrix = LatticeMatrix(product, system.layers - 1, lambda: system.inner)
    return _solver(matrix, system.inner_preconditioner)


def _solver(matrix: LatticeMatrix, preconditioner: Preconditioner) -> Solver:
    return GradientsThenFactor(ConjugateGradients(matrix, preconditioner, matrix.layers))
