"""The share of the pad's outer surface that belongs to each of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
