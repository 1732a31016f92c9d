"""Stiffness of a lattice whose cells count by their filled fraction: K = Σ φ_e K_e.

As `assembly`, rows are written directly, sorted and symmetric to the bit, whatever the threads;
with all fractions 1 they have the same bits.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly.assembly import Plan, assemble_csr, wrapped
from ifem_export.assembly.occupancy_table import shared_cells
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import Numbering
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]


def mesh_stiffness(mesh: PadMesh, element_matrix: Array) -> sparse.csr_array:
    """K (3n, 3n) in N/mm of a pad, cells scaled where the mesh says so."""
    occupancy, matrix = np.asarray(mesh.occupancy), np.asarray(element_matrix)
    if mesh.fill is None:
        return assemble_csr(occupancy, matrix, numbering=mesh.numbering)
    fill = np.asarray(mesh.fill)
    return assemble_weighted_csr(occupancy, matrix, fill, numbering=mesh.numbering)


def assemble_weighted_csr(
    occupancy: NDArray[np.bool_],
    element_matrix: Array,
    fill: Array,
    *,
    numbering: Numbering | None = None,
    threads: int | None = None,
) -> sparse.csr_array:
    """Stiffness matrix with every existing cell scaled.

    Args:
        occupancy: (nx, ny, nz) bool.
        element_matrix: (24, 24) in N/mm, symmetric.
        fill: (nx, ny, nz), > 0 where a cell exists.
        numbering: `number_nodes(occupancy)` when it is already at hand.
        threads: as for `assemble_csr`.

    Raises:
        MeshError: as `assemble_csr`, or a fill of another shape or not finite and > 0.
    """
    from ifem_export.assembly.weighted_kernel import fill_weighted_csr

    plan = Plan(occupancy, element_matrix, numbering)
    scales = corner_fill(occupancy, fill)[plan.numbering.positions]
    n, blocks = plan.numbering.n_nodes, plan.n_blocks
    index = np.int32 if 9 * blocks <= np.iinfo(np.int32).max else np.int64
    indptr = np.empty(3 * n + 1, dtype=index)
    indptr[-1] = 9 * blocks
    indices = np.empty(9 * blocks, dtype=index)
    data = np.empty(9 * blocks)
    by_corner = np.asarray(element_matrix, dtype=float).reshape(8, 3, 8, 3).transpose(0, 2, 1, 3)
    recipe = (scales, np.ascontiguousarray(by_corner), *_pairs())
    plan.run(fill_weighted_csr, recipe, indptr, indices, data, threads)
    return wrapped(sparse.csr_array((data, indices, indptr), shape=(3 * n, 3 * n)))


def corner_fill(occupancy: NDArray[np.bool_], fill: Array) -> Array:
    """Fill of the eight cells round each lattice node, 0 where none exists; (nodes, 8).

    Nodes run over the whole lattice, x fastest; cells are in the bit order of `Numbering`.

    Raises:
        MeshError: a fill of another shape, or not finite and > 0 where a cell exists.
    """
    if fill.shape != occupancy.shape:
        raise MeshError(f"fill has shape {fill.shape}: must be that of the cells {occupancy.shape}")
    kept = fill[occupancy]
    if not (np.isfinite(kept).all() and (kept > 0.0).all()):
        raise MeshError("fill must be finite and > 0 in every cell that exists")
    cells = np.where(occupancy, fill, 0.0).transpose(2, 1, 0)
    nz, ny, nx = cells.shape
    around = np.zeros((nz + 1, ny + 1, nx + 1, 8))
    for bit in range(8):
        k, j, i = 1 - (bit >> 2 & 1), 1 - (bit >> 1 & 1), 1 - (bit & 1)
        around[k : nz + k, j : ny + j, i : nx + i, bit] = cells
    return around.reshape(-1, 8)


@lru_cache(maxsize=1)
def _pairs() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Per neighbour slot the count and list (27, 8, 3) of cell bit and the two corners."""
    shared = shared_cells()
    counts = np.array([len(pairs) for pairs in shared])
    table = np.zeros((27, 8, 3), dtype=np.int64)
    for slot, pairs in enumerate(shared):
        table[slot, : len(pairs)] = pairs
    return counts, table
