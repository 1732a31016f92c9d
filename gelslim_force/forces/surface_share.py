"""The share of the pad's outer surface that belongs to each of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifem_export.mesh.pad_mesh import PadMesh


def surface_share_mm2(mesh: PadMesh) -> NDArray[np.float64]:
    """Areas (c,) in mm², in the order of `PadMesh.surface`: a quarter of each cell around a node.

    Seen from above: they sum to the area of the cells' columns, and a node at an edge has half of
    an inner one.
    """
    hx, hy, _ = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy).any(axis=2).T.astype(float)
    around = np.pad(plan, 1)
    corners = around[:-1, :-1] + around[1:, :-1] + around[:-1, 1:] + around[1:, 1:]
    numbering = mesh.numbering
    _, j, i = np.unravel_index(numbering.positions[mesh.surface], numbering.shape)
    return np.asarray(corners[j, i] * (hx * hy / 4))
