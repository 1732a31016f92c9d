"""Neighbours among the nodes of a pad's outer surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def neighbours(points_mm: Array, cell_mm: ArrayLike) -> sparse.csr_array:
    """(c, c) 1 where two nodes share a cell's edge: up to four per node.

    `points_mm` is (c, 2 or 3), on a lattice of `cell_mm` (2,).
    """
    places = points_mm[:, :2] / np.asarray(cell_mm)
    first, second = cKDTree(places).query_pairs(1.2, output_type="ndarray").T
    rows, columns = np.concatenate([first, second]), np.concatenate([second, first])
    count = len(places)
    return sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def curvature(beside: sparse.csr_array) -> sparse.csr_array:
    """(i, c): each inner node less the mean of its four neighbours.

    White noise has 1.25 times its variance there.
    """
    inner = np.flatnonzero(beside.sum(axis=1) == 4)
    each = sparse.eye_array(beside.shape[0], format="csr")
    return sparse.csr_array((each - beside / 4)[inner])


def edge_distance_mm(points_mm: Array, cell_mm: ArrayLike) -> Array:
    """(c,) distance of each node to the nearest one on the edge of the surface."""
    edge = neighbours(points_mm, cell_mm).sum(axis=1) < 4
    return np.asarray(cKDTree(points_mm[edge, :2]).query(points_mm[:, :2])[0])


def with_rim(touched: NDArray[np.bool_], beside: sparse.csr_array) -> NDArray[np.bool_]:
    """(c,) the nodes touched and their neighbours.

    A node's force is the pressure weighted by its shape function, which reaches one cell beyond
    the node: pressure at the rim of a contact loads nodes outside it too.
    """
    return touched | (beside @ touched.astype(float) > 0)
