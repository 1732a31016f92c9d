"""Global stiffness matrix of a cropped uniform lattice, written directly in CSR or BSR form.

Every node's rows are copied from the occupancy table of its cells, so there is no triplet list
and no sort: the peak memory is about that of the matrix, whose rows come out sorted and which
is symmetric to the bit, whatever the number of threads.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly.occupancy_table import neighbour_pattern, occupancy_table
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import Numbering, number_nodes

_SERIAL_BELOW_BYTES = 50_000_000


def assemble_csr(
    occupancy: NDArray[np.bool_],
    element_matrix: NDArray[np.float64],
    *,
    numbering: Numbering | None = None,
    threads: int | None = None,
) -> sparse.csr_array:
    """Stiffness matrix of the existing cells as scalar CSR.

    Args:
        occupancy: (nx, ny, nz) bool.
        element_matrix: (24, 24) in N/mm, symmetric, corners in VTK_HEXAHEDRON order.
        numbering: `number_nodes(occupancy)` when it is already at hand.
        threads: worker threads; by default one below 50 MB and one per processor above.

    Returns:
        (3n, 3n) in N/mm, sorted indices; unknown 3a+i is displacement i of node a in the
        numbering of `PadMesh`.

    Raises:
        MeshError: no cell exists or the element matrix is not a finite (24, 24).
    """
    from ifem_export.assembly.kernels import fill_csr

    plan = Plan(occupancy, element_matrix, numbering)
    n, blocks = plan.numbering.n_nodes, plan.n_blocks
    index = np.int32 if 9 * blocks <= np.iinfo(np.int32).max else np.int64
    indptr = np.empty(3 * n + 1, dtype=index)
    indptr[-1] = 9 * blocks
    indices = np.empty(9 * blocks, dtype=index)
    data = np.empty(9 * blocks)
    table = np.ascontiguousarray(plan.table.transpose(0, 2, 1, 3))
    plan.run(fill_csr, table, indptr, indices, data, threads)
    return wrapped(sparse.csr_array((data, indices, indptr), shape=(3 * n, 3 * n)))


def assemble_bsr(
    occupancy: NDArray[np.bool_],
    element_matrix: NDArray[np.float64],
    *,
    numbering: Numbering | None = None,
    threads: int | None = None,
) -> sparse.bsr_array:
    """The same matrix as 3x3 block CSR; arguments as for `assemble_csr`."""
    from ifem_export.assembly.kernels import fill_bsr

    plan = Plan(occupancy, element_matrix, numbering)
    n, blocks = plan.numbering.n_nodes, plan.n_blocks
    index = np.int32 if blocks <= np.iinfo(np.int32).max else np.int64
    indptr = np.empty(n + 1, dtype=index)
    indptr[-1] = blocks
    indices = np.empty(blocks, dtype=index)
    data = np.empty((blocks, 3, 3))
    plan.run(fill_bsr, plan.table, indptr, indices, data, threads)
    return wrapped(sparse.bsr_array((data, indices, indptr), shape=(3 * n, 3 * n)))


class Plan:
    """What both forms need: numbering, pattern, block offsets and the value table."""

    def __init__(
        self,
        occupancy: NDArray[np.bool_],
        element_matrix: NDArray[np.float64],
        numbering: Numbering | None,
    ) -> None:
        matrix = np.asarray(element_matrix, dtype=float)
        if matrix.shape != (24, 24) or not np.isfinite(matrix).all():
            raise MeshError(f"element matrix of shape {matrix.shape}: must be finite, (24, 24)")
        self.numbering = number_nodes(occupancy) if numbering is None else numbering
        self.pattern = neighbour_pattern()
        self.table = occupancy_table(matrix)
        ends = np.cumsum(self.pattern.counts[self.numbering.masks])
        self.n_blocks = int(ends[-1])
        self.first_block = np.concatenate([[0], ends[:-1]])

    def run(
        self,
        fill: Callable[..., None],
        table: Any,
        indptr: NDArray[Any],
        indices: NDArray[Any],
        data: NDArray[np.float64],
        threads: int | None,
    ) -> None:
        """Let `fill` write all rows into the arrays, over as many threads as the size asks for."""
        _, ny1, nx1 = self.numbering.shape
        d = np.arange(-1, 2)
        strides = ((d[:, None, None] * ny1 + d[None, :, None]) * nx1 + d).reshape(27)
        shared = (
            self.numbering.masks,
            self.numbering.positions,
            self.first_block,
            self.numbering.node_index,
            self.pattern.counts,
            self.pattern.slots,
            strides,
            table,
            indptr,
            indices,
            data,
        )
        n = self.numbering.n_nodes
        workers = _worker_count(threads, data.nbytes + indices.nbytes)
        if workers == 1:
            fill(0, n, *shared)
            return
        bounds = np.linspace(0, n, workers + 1).astype(int)
        with ThreadPoolExecutor(workers) as pool:
            jobs = [
                pool.submit(fill, int(a), int(b), *shared) for a, b in itertools.pairwise(bounds)
            ]
            for job in jobs:
                job.result()


def _worker_count(threads: int | None, n_bytes: int) -> int:
    if threads is None:
        return 1 if n_bytes < _SERIAL_BELOW_BYTES else _available_processors()
    if threads < 1:
        raise MeshError(f"threads = {threads}: must be >= 1")
    return threads


def _available_processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def wrapped(matrix: Any) -> Any:
    """Tell SciPy what the fill guarantees, so that it never checks or sorts."""
    matrix.has_sorted_indices = True
    matrix.has_canonical_format = True
    return matrix
