"""Neighbours among the nodes of a pad's outer surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def neighbour_matrix(points_mm: Array, cell_mm: ArrayLike) -> sparse.csr_array:
    """(c, c) with 1 where two nodes share an edge of a cell: up to four per node.

    `points_mm` is (c, 2 or 3), on a lattice with cells of `cell_mm` (2,).
    """
    positions = points_mm[:, :2] / np.asarray(cell_mm)
    first, second = cKDTree(positions).query_pairs(1.2, output_type="ndarray").T
    rows, columns = np.concatenate([first, second]), np.concatenate([second, first])
    count = len(positions)
    return sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def curvature_operator(neighbours: sparse.csr_array) -> sparse.csr_array:
    """(i, c) that gives the value of each inner node minus the mean of its four neighbours.

    White noise has 1.25 times its variance there.
    """
    inner = np.flatnonzero(neighbours.sum(axis=1) == 4)
    identity = sparse.eye_array(neighbours.shape[0], format="csr")
    return sparse.csr_array((identity - neighbours / 4)[inner])


def edge_distance_mm(points_mm: Array, cell_mm: ArrayLike) -> Array:
    """(c,) distance of each node from the nearest node on the edge of the surface."""
    edge = neighbour_matrix(points_mm, cell_mm).sum(axis=1) < 4
    return np.asarray(cKDTree(points_mm[edge, :2]).query(points_mm[:, :2])[0])


def with_neighbours(touched: NDArray[np.bool_], neighbours: sparse.csr_array) -> NDArray[np.bool_]:
    """(c,) the touched nodes and their neighbours.

    A node's force is the pressure weighted by its shape function, which reaches one cell beyond
    the node: pressure at the rim of a contact also loads nodes outside the contact.
    """
    return touched | (neighbours @ touched.astype(float) > 0)
