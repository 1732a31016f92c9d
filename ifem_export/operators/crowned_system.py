"""The equations of a crowned pad, with the motion of its true outer surface as unknowns.

See `crowned_surface` for how the surface lies between nodes. In every column the nearer node's
displacement u_n is replaced by the surface's own, u_s = (1 - |t|) u_n + |t| u_o:

    u_n = (u_s - |t| u_o) / (1 - |t|),   K̃ = Tᵀ K T

K̃ is symmetric and positive definite as K is; the forces that belong to u_s act on the surface
and have their sum. Condensing all other nodes away gives its stiffness, as for a flat pad.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly.weighted_assembly import mesh_stiffness
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.layered_operator import inverse, layered_operator, padding_columns
from ifem_export.operators.pad_system import PadSystem, node_weight
from ifem_export.operators.weighted_guess import EmbeddedGuess

Array = NDArray[np.float64]


def pad_system(mesh: PadMesh, element_matrix: Array) -> PadSystem:
    """Equations of a flat or a crowned pad. Raises MeshError for any other."""
    if mesh.surface_shift is None:
        return PadSystem(mesh, element_matrix)
    return CrownedSystem(mesh, element_matrix)


@dataclass(frozen=True, eq=False)
class CrownedSystem(PadSystem):
    """Unknowns are the inner nodes in their order, then the surface over its nodes."""

    def __post_init__(self) -> None:
        if self.mesh.surface_shift is None:
            raise MeshError("the pad is not crowned: it has no surface of its own")

    @property
    def columns(self) -> int:
        """Columns of nodes c, each with one point of the surface."""
        return len(self.mesh.surface)

    @property
    def guess_layers(self) -> tuple[int, int]:
        """Layers that preconditioners take fields in: unknowns do not come in layers here."""
        return 1, 1

    @property
    def _inner_size(self) -> int:
        return 3 * (len(self.mesh.free) - self.columns)

    @cached_property
    def _order(self) -> NDArray[np.int64]:
        """Free nodes, inner ones first."""
        inner = np.setdiff1d(self.mesh.free, self.mesh.surface, assume_unique=True)
        return np.concatenate([inner, self.mesh.surface]).astype(np.int64)

    @cached_property
    def _grid(self) -> NDArray[np.int64]:
        """Lattice places (n, 3) of all nodes, (k, j, i)."""
        numbering = self.mesh.numbering
        return np.stack(np.unravel_index(numbering.positions, numbering.shape), axis=1)

    @cached_property
    def places(self) -> NDArray[np.int64]:
        """Lattice places (c, 2) of the surface nodes, (j, i)."""
        return self._grid[self.mesh.surface][:, 1:]

    @cached_property
    def _shares(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
        """|t| (c,), and of the columns with one: index of surface point and of other unknown."""
        shift = np.asarray(self.mesh.surface_shift)
        numbering = self.mesh.numbering
        k, j, i = self._grid[self.mesh.surface].T
        other_level = k + np.sign(shift).astype(np.int64)
        number = np.full(self.mesh.n_nodes, -1, dtype=np.int64)
        number[self._order] = np.arange(len(self._order))
        others = numbering.node_index.reshape(numbering.shape)[other_level, j, i]
        # A bonded neighbour does not move: its share of the motion is zero.
        moving = np.flatnonzero((shift != 0.0) & (number[others] >= 0))
        return np.abs(shift), moving, number[others[moving]]

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """Free-free stiffness (3f, 3f) in N/mm, in the order of the unknowns."""
        whole = mesh_stiffness(self.mesh, self.element_matrix)
        rows = (3 * self._order[:, None] + np.arange(3)).reshape(-1)
        free = sparse.csr_array(whole[rows][:, rows])
        share, at, other = self._shares
        if not share.any():
            return free
        n, first = len(self._order), len(self._order) - self.columns
        scale = np.ones(n)
        scale[first:] = 1.0 / (1.0 - share)
        entries = sparse.csr_array((-share[at] * scale[first + at], (first + at, other)), (n, n))
        change = sparse.kron(sparse.diags_array(scale) + entries, sparse.eye_array(3), "csr")
        found = sparse.csr_array(change.T @ free @ change)
        return sparse.csr_array((found + found.T) / 2)

    @cached_property
    def compliance_guess(self) -> EmbeddedGuess:
        """Inverse of the full infinite pad, restricted to the nodes that exist."""
        share, at, other = self._shares
        n, first = len(self._order), len(self._order) - self.columns
        scale = np.ones(n)
        scale[first:] = 1.0 - share
        entries = sparse.csr_array((share[at], (first + at, other)), (n, n))
        change = sparse.csr_array(sparse.diags_array(scale) + entries)
        return self._embedded(self._order, change)

    @cached_property
    def inner_guess(self) -> EmbeddedGuess:
        """The same restricted to inner nodes."""
        return self._embedded(self._order[: -self.columns], None)

    def _embedded(self, nodes: NDArray[np.int64], change: sparse.csr_array | None) -> EmbeddedGuess:
        layers, places = self.layers, self.places
        extent = (int(places[:, 0].max()) + 1, int(places[:, 1].max()) + 1)
        number = np.zeros(extent, dtype=np.int64)
        number[places[:, 0], places[:, 1]] = np.arange(len(places))
        padding = padding_columns(self.mesh.cell_size_mm, layers, extent)
        guess = layered_operator(np.asarray(self.element_matrix), layers, places, padding, inverse)
        k, j, i = self._grid[nodes].T
        return EmbeddedGuess(
            guess, layers, len(places), k - 1, number[j, i],
            node_weight(self.mesh)[nodes], change,
        )  # fmt: skip

    @property
    def surface_guess(self) -> None:  # type: ignore[override]
        """None: the infinite pad has one thickness."""
        raise _uneven()

    @property
    def surface_compliance_guess(self) -> None:  # type: ignore[override]
        """None: the infinite pad has one thickness."""
        raise _uneven()


def _uneven() -> MeshError:
    return MeshError(
        "the pad is crowned: `paper`, `truncated` and `fft` need one thickness; use pcg, factor or "
        "dense32"
    )
