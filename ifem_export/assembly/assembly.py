"""Global stiffness matrix of a cropped uniform lattice, written directly in CSR form.

Every node's rows are copied from a table of its possible cells, so there is no list of triplets
and no sort. The peak memory is about that of the matrix. Its rows are sorted, and it is exactly
symmetric for any number of threads. Around cells with a filled fraction φ_e below 1 the rows are
summed, K = Σ φ_e K_e.
"""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_core.jobs import processors
from ifem_export.assembly.occupancy_table import (
    neighbour_pattern,
    occupancy_table,
    shared_cells,
)
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import Numbering, number_nodes
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]


def mesh_stiffness(mesh: PadMesh, element_matrix: Array) -> sparse.csr_array:
    """Stiffness matrix of a pad.

    Args:
        mesh: The pad; its `fill`, where present, scales the cells.
        element_matrix: (24, 24) in N/mm, symmetric, corners in VTK_HEXAHEDRON order.

    Returns:
        (3n, 3n) in N/mm for n nodes. Unknown 3a+i is displacement i of node a.

    Raises:
        MeshError: The element matrix is not a finite (24, 24) matrix.
    """
    fill = None if mesh.fill is None else np.asarray(mesh.fill)
    return assemble_csr(
        np.asarray(mesh.occupancy), np.asarray(element_matrix), fill, numbering=mesh.numbering
    )


def assemble_csr(
    occupancy: NDArray[np.bool_],
    element_matrix: Array,
    fill: Array | None = None,
    *,
    numbering: Numbering | None = None,
    threads: int | None = None,
) -> sparse.csr_array:
    """Stiffness matrix of the existing cells in CSR form.

    Args:
        occupancy: (nx, ny, nz) bool.
        element_matrix: (24, 24) in N/mm, symmetric, corners in VTK_HEXAHEDRON order.
        fill: (nx, ny, nz) factor of each cell, > 0 where a cell exists; None for 1.
        numbering: `number_nodes(occupancy)`, where it is known already.
        threads: Worker threads; None takes one per processor.

    Returns:
        (3n, 3n) in N/mm with sorted indices, in the node numbering of `PadMesh`.

    Raises:
        MeshError: No cell exists, the element matrix is not a finite (24, 24) matrix, or the
            fill has another shape or a value that is not finite and > 0.
    """
    from ifem_export.assembly.kernels import fill_csr

    matrix = np.asarray(element_matrix, dtype=float)
    if matrix.shape != (24, 24) or not np.isfinite(matrix).all():
        raise MeshError(
            f"element matrix of shape {matrix.shape}: must be finite, (24, 24)",
            field="element_matrix",
        )
    nodes = number_nodes(occupancy) if numbering is None else numbering
    scales = np.empty((0, 8))
    if fill is not None:
        scales = corner_fill(occupancy, fill)[nodes.positions]
    table = np.ascontiguousarray(occupancy_table(matrix).transpose(0, 2, 1, 3))
    by_corner = np.ascontiguousarray(matrix.reshape(8, 3, 8, 3).transpose(0, 2, 1, 3))
    counts, slots = neighbour_pattern()
    ends = np.cumsum(counts[nodes.masks])
    n, n_values = nodes.n_nodes, 9 * int(ends[-1])
    index = np.int32 if n_values <= np.iinfo(np.int32).max else np.int64
    indptr = np.empty(3 * n + 1, dtype=index)
    indptr[-1] = n_values
    indices = np.empty(n_values, dtype=index)
    data = np.empty(n_values)
    shared: tuple[Any, ...] = (
        nodes.masks, nodes.positions, np.concatenate([[0], ends[:-1]]), nodes.node_index,
        counts, slots, _slot_strides(nodes),
        (table, scales, by_corner, *_pairs()), indptr, indices, data,
    )  # fmt: skip
    workers = processors() if threads is None else threads
    if workers < 1:
        raise MeshError(f"threads = {threads}: must be >= 1", field="threads", value=threads)
    bounds = np.linspace(0, n, workers + 1).astype(int).tolist()
    with ThreadPoolExecutor(workers) as pool:
        jobs = [pool.submit(fill_csr, a, b, *shared) for a, b in itertools.pairwise(bounds)]
        for job in jobs:
            job.result()
    stiffness = sparse.csr_array((data, indices, indptr), shape=(3 * n, 3 * n))
    # SciPy then never checks or sorts: the kernel writes sorted rows without duplicates.
    stiffness.has_sorted_indices = True
    stiffness.has_canonical_format = True
    return stiffness


def block_pattern(nodes: Numbering) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Which 3x3 blocks of the stiffness matrix exist, as CSR `indptr` and `indices` of nodes."""
    all_counts, slots = neighbour_pattern()
    counts = all_counts[nodes.masks]
    present = np.arange(27) < counts[:, None]
    offsets = _slot_strides(nodes)[slots[nodes.masks]]
    neighbours = (nodes.positions[:, None] + offsets)[present]
    ends = np.concatenate([[0], np.cumsum(counts)])
    return ends.astype(np.int32), nodes.node_index[neighbours]


def _slot_strides(nodes: Numbering) -> NDArray[np.int64]:
    """Offset (27,) of each neighbour slot in the flat lattice of nodes."""
    _, ny1, nx1 = nodes.shape
    d = np.arange(-1, 2)
    return ((d[:, None, None] * ny1 + d[None, :, None]) * nx1 + d).reshape(27)


def corner_fill(occupancy: NDArray[np.bool_], fill: Array) -> Array:
    """Fill (nodes, 8) of the eight cells around each lattice node, 0 where no cell exists.

    The nodes are those of the whole lattice, x fastest; the cells are in the bit order of
    `Numbering`.

    Raises:
        MeshError: The fill has another shape, or is not finite and > 0 in an existing cell.
    """
    if fill.shape != occupancy.shape:
        raise MeshError(
            f"fill has shape {fill.shape}: must be that of the cells {occupancy.shape}",
            field="fill",
        )
    kept = fill[occupancy]
    if not (np.isfinite(kept).all() and (kept > 0.0).all()):
        raise MeshError("fill must be finite and > 0 in every cell that exists", field="fill")
    cells = np.where(occupancy, fill, 0.0).transpose(2, 1, 0)
    nz, ny, nx = cells.shape
    around = np.zeros((nz + 1, ny + 1, nx + 1, 8))
    for bit in range(8):
        k, j, i = 1 - (bit >> 2 & 1), 1 - (bit >> 1 & 1), 1 - (bit & 1)
        around[k : nz + k, j : ny + j, i : nx + i, bit] = cells
    return around.reshape(-1, 8)


@lru_cache(maxsize=1)
def _pairs() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Per neighbour slot the number and list (27, 8, 3) of shared cells: cell bit, two corners."""
    shared = shared_cells()
    counts = np.array([len(pairs) for pairs in shared])
    table = np.zeros((27, 8, 3), dtype=np.int64)
    for slot, pairs in enumerate(shared):
        table[slot, : len(pairs)] = pairs
    return counts, table
