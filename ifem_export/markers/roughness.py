"""How far marker values are from affine in every neighbourhood, as a sparse quadratic form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

NEIGHBOURS = 8
"""A marker of a square lattice inside others has that many round it."""
_TIE = 1.0 + 1e-6
_FLAT = 1e-6


def local_roughness(markers_mm: NDArray[np.float64]) -> sparse.csr_array:
    """Sum over the markers of the squared distance from the plane fitted to their neighbours.

    A marker's neighbours are the eight nearest and all as near as the eighth, so that a lattice
    is treated alike from every side.

    Args:
        markers_mm: (k, 2) distinct positions, k >= 3.

    Returns:
        (k, k) CSR B, symmetric and positive semi-definite: roughness = dᵀ B d. Zero on affine
        fields, and on nothing else where the neighbourhoods overlap.
    """
    count = len(markers_mm)
    tree = cKDTree(markers_mm)
    nearest = min(NEIGHBOURS + 1, count)
    reach = tree.query(markers_mm, k=nearest)[0][:, -1]
    around = tree.query_ball_point(markers_mm, reach * _TIE, return_sorted=True)
    rows, columns, values = [], [], []
    for marker, near in enumerate(around):
        offsets = (markers_mm[near] - markers_mm[marker]) / reach[marker]
        u, size, _ = np.linalg.svd(np.column_stack([np.ones(len(near)), offsets]), False)
        u = u[:, size > _FLAT * size[0]]
        residual = -u @ u[near.index(marker)]
        residual[near.index(marker)] += 1.0
        rows.append(np.full(len(near), marker))
        columns.append(near)
        values.append(residual)
    residuals = sparse.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, count),
    )
    form = sparse.csr_array(residuals.T @ residuals)
    form.sort_indices()
    return form
