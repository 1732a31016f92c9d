"""The equations of the pad, split into bonded, inner and surface unknowns.

A pad of uniform thickness has the same columns of nodes in every layer. Layer l therefore holds
the nodes l·c to (l+1)·c - 1, a field is an array (layers, c, 3), and the blocks are slices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.assembly.assembly import corner_fill, mesh_stiffness
from ifem_export.elements.skin import Membrane
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.layer_elimination import LayerElimination, layer_elimination
from ifem_export.operators.layered_operator import (
    Blocks,
    LayeredOperator,
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    surface_compliance,
    surface_stiffness,
)
from ifem_export.operators.preconditioner import (
    MirroredOperator,
    Preconditioner,
    ScaledPreconditioner,
    mirrored_operator,
)

Array = NDArray[np.float64]
MOST_BLOCK_BYTES = 100_000_000
"""Size of a preconditioner's blocks above which the layers are eliminated one by one."""


@dataclass(frozen=True, eq=False)
class PadSystem:
    """Equations of a pad that is bonded at its lower face.

    Attributes:
        mesh: The pad.
        element_matrix: (24, 24) in N/mm.
        membranes: Coat and fabric on the surface, whose stiffness adds to that of the pad.

    Raises:
        MeshError: The pad is not of uniform thickness.
    """

    mesh: PadMesh
    element_matrix: Array
    membranes: tuple[Membrane, ...] = ()

    def __post_init__(self) -> None:
        cells = np.asarray(self.mesh.occupancy)
        even = (cells == cells[:, :, :1]).all()
        if even and self.mesh.fill is not None:
            even = (self.mesh.fill == self.mesh.fill[:, :, :1]).all()
        if not even or self.mesh.surface_shift is not None:
            raise MeshError(
                "the pad's layers differ: condensation by layers needs a pad of uniform thickness",
                field="mesh",
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
        """Whether the pad has cut cells or a crown, which the infinite pad does not have."""
        return self.mesh.fill is not None or self.mesh.surface_shift is not None

    @property
    def preconditioner_layers(self) -> tuple[int, int]:
        """Layers of the fields of `preconditioner` and of `inner_preconditioner`."""
        return self.layers, self.layers - 1

    @cached_property
    def lattice_positions(self) -> NDArray[np.int64]:
        """Lattice positions (c, 2) of the columns, (j, i)."""
        numbering = self.mesh.numbering
        _, j, i = np.unravel_index(numbering.positions[-self.columns :], numbering.shape)
        return np.stack([j, i], axis=1)

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """Free-free stiffness (3Lc, 3Lc) in N/mm."""
        matrix, first = self._holder
        return sparse.csr_array(matrix[first:, first:])

    @cached_property
    def inner(self) -> sparse.csr_array:
        """Inner-inner block; empty for one layer."""
        matrix, first = self._holder
        end = first + self._inner_size
        return sparse.csr_array(matrix[first:end, first:end])

    @cached_property
    def surface(self) -> sparse.csr_array:
        """Surface-surface block."""
        matrix, first = self._holder
        end = first + self._inner_size
        return sparse.csr_array(matrix[end:, end:])

    @cached_property
    def inner_to_surface(self) -> sparse.csr_array:
        """Surface-inner block, K_si."""
        matrix, first = self._holder
        end = first + self._inner_size
        return sparse.csr_array(matrix[end:, first:end])

    @cached_property
    def surface_to_inner(self) -> sparse.csr_array:
        """Inner-surface block, K_is."""
        matrix, first = self._holder
        end = first + self._inner_size
        return sparse.csr_array(matrix[first:end, end:])

    @cached_property
    def _holder(self) -> tuple[sparse.csr_array, int]:
        """The matrix that all blocks are cut from, and its first free unknown.

        It is that of all nodes: what needs no more than the inner block of a fine pad is spared
        the copy without the bonded nodes.
        """
        pad = mesh_stiffness(self.mesh, np.asarray(self.element_matrix))
        if self.membranes:
            from ifem_export.elements.membrane import membrane_stiffness, with_skin

            pad = with_skin(pad, membrane_stiffness(self.mesh, self.membranes))
        return pad, 3 * self.columns

    @property
    def _inner_size(self) -> int:
        return 3 * self.columns * (self.layers - 1)

    @cached_property
    def preconditioner(self) -> Preconditioner:
        """Inverse of the infinite pad's stiffness, which preconditions `stiffness`."""
        return self._scaled(inverse)

    @cached_property
    def inner_preconditioner(self) -> Preconditioner:
        """The same for `inner`."""
        return self._scaled(inner_compliance)

    @cached_property
    def infinite_stiffness(self) -> LayeredOperator:
        """Surface stiffness S of the infinite pad."""
        return self._operator(surface_stiffness)

    @cached_property
    def infinite_compliance(self) -> LayeredOperator:
        """Surface compliance of the infinite pad."""
        return self._operator(surface_compliance)

    @cached_property
    def mirrored_compliance(self) -> MirroredOperator:
        """`infinite_compliance` in less time: the infinite pad is its own mirror image."""

        def of(blocks: Array) -> Array:
            if self.membranes:
                from ifem_export.elements.membrane import membrane_symbol

                shape = 2 * (blocks.shape[0] - 1), 2 * (blocks.shape[1] - 1)
                symbol = membrane_symbol(self.mesh.cell_size_mm[:2], self.membranes, shape)
                blocks[..., -3:, -3:] += symbol
            return surface_compliance(blocks)

        return mirrored_operator(*self._infinite, of)

    @cached_property
    def elimination(self) -> LayerElimination:
        """Inverse of the infinite pad's stiffness in little memory."""
        return self.eliminated()

    def eliminated(
        self, on_surface: Callable[[tuple[int, int]], Array] | None = None
    ) -> LayerElimination:
        """The same with blocks added on the surface; see `layer_elimination`."""
        return layer_elimination(*self._infinite, on_surface=on_surface)

    def _scaled(self, transform: Callable[[Array], Array]) -> Preconditioner:
        if self.membranes and self.mesh.fill is None and transform is inverse:
            from ifem_export.elements.membrane import membrane_symbol

            size = self.mesh.cell_size_mm[:2]
            return self.eliminated(lambda shape: membrane_symbol(size, self.membranes, shape))
        if self.mesh.fill is None and 18 * self.layers**2 * self.columns > MOST_BLOCK_BYTES:
            if transform is inverse:
                return self.elimination
            return layer_elimination(*self._infinite, surface_held=True)
        uniform = mirrored_operator(*self._infinite, transform)
        if self.mesh.fill is None:
            return uniform
        weight = node_weight(self.mesh)[self.columns :].reshape(self.layers, -1)
        inner = uniform.blocks.shape[-1] < 3 * self.layers
        return ScaledPreconditioner(uniform, weight[:-1] if inner else weight)

    def _operator(self, transform: Callable[[Blocks], Blocks]) -> LayeredOperator:
        return layered_operator(*self._infinite, lambda blocks: transform(self._worn(blocks)))

    def _worn(self, blocks: Blocks) -> Blocks:
        """Stiffness blocks (ky, kx half, 3L, 3L) of the infinite pad with its membranes."""
        if not self.membranes:
            return blocks
        from ifem_export.elements.membrane import membrane_blocks

        shape = blocks.shape[0], 2 * (blocks.shape[1] - 1)
        found = blocks.copy()
        size = self.mesh.cell_size_mm[:2]
        found[..., -3:, -3:] += membrane_blocks(size, self.membranes, shape)
        return found

    @property
    def _infinite(self) -> tuple[Array, int, NDArray[np.int64], tuple[int, int]]:
        """Element, layers, columns and padding of the infinite pad's operators."""
        positions = self.lattice_positions
        rows, columns = (int(n) + 1 for n in positions.max(axis=0))
        padding = padding_columns(self.mesh.cell_size_mm, self.layers, (rows, columns))
        return np.asarray(self.element_matrix), self.layers, positions, padding


def node_weight(mesh: PadMesh) -> Array:
    """D^-1/2 (n,) of every node, with D the mean fill of the existing cells around it."""
    if mesh.fill is None:
        return np.ones(mesh.n_nodes)
    numbering = mesh.numbering
    around = corner_fill(np.asarray(mesh.occupancy), np.asarray(mesh.fill))[numbering.positions]
    return np.asarray(np.sqrt((around > 0.0).sum(axis=1) / around.sum(axis=1)))


def checked_field(field: ArrayLike, columns: int) -> Array:
    """A field (c, 3) on the surface. Raises IfemError for a wrong shape or a value not finite."""
    values = np.asarray(field, dtype=float)
    if values.shape != (columns, 3):
        raise IfemError(
            f"the field has shape {values.shape}: must be ({columns}, 3)",
            field="shape",
            value=values.shape,
        )
    if not np.isfinite(values).all():
        node = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise IfemError(
            f"the field holds a value that is not finite at surface node {node}: "
            "interpolate lost markers first",
            field="node",
            value=node,
        )
    return values
