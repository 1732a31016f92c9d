"""The equations of a crowned pad, whose unknowns include the displacement of its true surface.

The surface lies between nodes (see `ifem_export.mesh.crown`). In every column the displacement u_n
of the nearer node is replaced by that of the surface, u_s = (1 - |t|) u_n + |t| u_o:

    u_n = (u_s - |t| u_o) / (1 - |t|),   K̃ = Tᵀ K T

K̃ is symmetric and positive definite as K is. The forces conjugate to u_s act on the surface and
keep the resultant. Condensing all other nodes gives the surface stiffness, as for a flat pad.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly.assembly import mesh_stiffness
from ifem_export.elements.skin import Membrane
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.layered_operator import (
    Blocks,
    LayeredOperator,
    inverse,
    padding_columns,
)
from ifem_export.operators.pad_system import PadSystem, node_weight
from ifem_export.operators.preconditioner import EmbeddedPreconditioner, mirrored_operator

Array = NDArray[np.float64]


def pad_system(
    mesh: PadMesh, element_matrix: Array, membranes: tuple[Membrane, ...] = ()
) -> PadSystem:
    """Equations of a flat or a crowned pad.

    Raises MeshError for other uneven pads, and for membranes on a crowned one.
    """
    if mesh.surface_shift is None:
        return PadSystem(mesh, element_matrix, membranes)
    return CrownedSystem(mesh, element_matrix, membranes)


@dataclass(frozen=True, eq=False)
class CrownedSystem(PadSystem):
    """Equations whose unknowns are first the inner nodes, then the points of the surface."""

    def __post_init__(self) -> None:
        if self.mesh.surface_shift is None:
            raise MeshError("the pad is not crowned: it has no surface between nodes", field="mesh")
        if self.membranes:
            from ifem_export.elements.membrane import membrane_stiffness

            membrane_stiffness(self.mesh, self.membranes)

    @property
    def columns(self) -> int:
        """Columns of nodes c, each with one point of the surface."""
        return len(self.mesh.surface)

    @property
    def preconditioner_layers(self) -> tuple[int, int]:
        """One layer each, because the unknowns of a crowned pad do not come in layers."""
        return 1, 1

    @property
    def _inner_size(self) -> int:
        return 3 * (len(self.mesh.free) - self.columns)

    @cached_property
    def _order(self) -> NDArray[np.int64]:
        """Free nodes, the inner ones first."""
        inner = np.setdiff1d(self.mesh.free, self.mesh.surface, assume_unique=True)
        return np.concatenate([inner, self.mesh.surface]).astype(np.int64)

    @cached_property
    def _grid(self) -> NDArray[np.int64]:
        """Lattice positions (n, 3) of all nodes, (k, j, i)."""
        numbering = self.mesh.numbering
        return np.stack(np.unravel_index(numbering.positions, numbering.shape), axis=1)

    @cached_property
    def lattice_positions(self) -> NDArray[np.int64]:
        """Lattice positions (c, 2) of the surface nodes, (j, i)."""
        return self._grid[self.mesh.surface][:, 1:]

    @cached_property
    def _shares(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
        """|t| (c,), and for columns with t ≠ 0 the indices of surface point and other node."""
        shift = np.asarray(self.mesh.surface_shift)
        numbering = self.mesh.numbering
        k, j, i = self._grid[self.mesh.surface].T
        other_level = k + np.sign(shift).astype(np.int64)
        number = np.full(self.mesh.n_nodes, -1, dtype=np.int64)
        number[self._order] = np.arange(len(self._order))
        others = numbering.node_index.reshape(numbering.shape)[other_level, j, i]
        # A bonded neighbour does not move, so its contribution is zero.
        moving = np.flatnonzero((shift != 0.0) & (number[others] >= 0))
        return np.abs(shift), moving, number[others[moving]]

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """Free-free stiffness (3f, 3f) in N/mm, in the order of the unknowns."""
        all_nodes = mesh_stiffness(self.mesh, self.element_matrix)
        rows = (3 * self._order[:, None] + np.arange(3)).ravel()
        free = sparse.csr_array(all_nodes[rows][:, rows])
        share, at, other = self._shares
        if not share.any():
            return free
        n, first = len(self._order), len(self._order) - self.columns
        scale = np.ones(n)
        scale[first:] = 1.0 / (1.0 - share)
        entries = sparse.csr_array((-share[at] * scale[first + at], (first + at, other)), (n, n))
        t = sparse.kron(sparse.diags_array(scale) + entries, sparse.eye_array(3), "csr")
        transformed = sparse.csr_array(t.T @ free @ t)
        return sparse.csr_array((transformed + transformed.T) / 2)

    @cached_property
    def _holder(self) -> tuple[sparse.csr_array, int]:
        return self.stiffness, 0

    @cached_property
    def preconditioner(self) -> EmbeddedPreconditioner:
        """Inverse of the full infinite pad, restricted to the existing nodes."""
        share, at, other = self._shares
        n, first = len(self._order), len(self._order) - self.columns
        scale = np.ones(n)
        scale[first:] = 1.0 - share
        entries = sparse.csr_array((share[at], (first + at, other)), (n, n))
        transformation = sparse.csr_array(sparse.diags_array(scale) + entries)
        return self._embedded(self._order, transformation)

    @cached_property
    def inner_preconditioner(self) -> EmbeddedPreconditioner:
        """The same, restricted to the inner nodes."""
        return self._embedded(self._order[: -self.columns], None)

    def _embedded(
        self, nodes: NDArray[np.int64], transformation: sparse.csr_array | None
    ) -> EmbeddedPreconditioner:
        layers, columns = self.layers, self.lattice_positions
        extent = (int(columns[:, 0].max()) + 1, int(columns[:, 1].max()) + 1)
        number = np.zeros(extent, dtype=np.int64)
        number[columns[:, 0], columns[:, 1]] = np.arange(len(columns))
        padding = padding_columns(self.mesh.cell_size_mm, layers, extent)
        element = np.asarray(self.element_matrix)
        k, j, i = self._grid[nodes].T
        return EmbeddedPreconditioner(
            uniform=mirrored_operator(element, layers, columns, padding, inverse),
            layers=layers,
            columns=len(columns),
            layer=k - 1,
            column=number[j, i],
            weight=node_weight(self.mesh)[nodes],
            transformation=transformation,
        )

    def _operator(self, transform: Callable[[Blocks], Blocks]) -> LayeredOperator:
        raise MeshError(
            "the pad is crowned, but the infinite pad has one thickness: use the rungs pcg, factor "
            "or dense32",
            field="mesh",
        )
