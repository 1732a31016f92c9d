"""The pad's outer surface seen from above: share, neighbours and edge distance of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]


def surface_share_mm2(mesh: PadMesh) -> Array:
    """Areas (c,) in mm², in the order of `PadMesh.surface`: a quarter of each cell at the node.

    The areas are those of the projection onto the x-y plane. They sum to the area of the columns
    of cells; a node on an edge has half the area of an inner one.
    """
    hx, hy, _ = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy).any(axis=2).T.astype(float)
    around = np.pad(plan, 1)
    corners = around[:-1, :-1] + around[1:, :-1] + around[:-1, 1:] + around[1:, 1:]
    numbering = mesh.numbering
    _, j, i = np.unravel_index(numbering.positions[mesh.surface], numbering.shape)
    return np.asarray(corners[j, i] * (hx * hy / 4))


def neighbour_matrix(points_mm: Array, cell_mm: ArrayLike) -> sparse.csr_array:
    """(c, c) with 1 where two nodes share an edge of a cell: up to four per node.

    `points_mm` is (c, 2 or 3), on a lattice with cells of `cell_mm` (2,).
    """
    positions = points_mm[:, :2] / np.asarray(cell_mm)
    first, second = cKDTree(positions).query_pairs(1.2, output_type="ndarray").T
    rows, columns = np.concatenate([first, second]), np.concatenate([second, first])
    count = len(positions)
    return sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def edge_distance_mm(points_mm: Array, cell_mm: ArrayLike) -> Array:
    """(c,) distance of each node from the nearest node on the edge of the surface."""
    edge = neighbour_matrix(points_mm, cell_mm).sum(axis=1) < 4
    return np.asarray(cKDTree(points_mm[edge, :2]).query(points_mm[:, :2])[0])
