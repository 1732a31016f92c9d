"""The share of the pad's outer surface that belongs to each of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifem_export.pad_mesh import PadMesh


def surface_share_mm2(mesh: PadMesh) -> NDArray[np.float64]:
    """Areas (c,) in mm², in the order of `PadMesh.surface`: a quarter of each cell around a node.

    They sum to the area of the cells; a node at an edge has half of an inner one.
    """
    hx, hy, _ = mesh.cell_size_mm
    hexes = np.asarray(mesh.hexes)
    top = hexes[:, 4:]
    outer = np.isin(top, mesh.surface).all(axis=1)
    share = np.bincount(top[outer].ravel(), minlength=mesh.n_nodes) * (hx * hy / 4)
    return np.asarray(share[mesh.surface])
