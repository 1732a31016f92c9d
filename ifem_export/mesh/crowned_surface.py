"""Where the outer surface of a crowned pad lies in its lattice.

The surface cuts every column of nodes between two of them. The nearer one stands for it; the
surface's own displacement there is interpolated between the two:

    u_s = (1 - |t|) u_near + |t| u_other,   t in [-1/2, 1/2] cells, > 0 above the nearer node

With cut cells scaled by their filled fraction φ, a column then has exactly the compliance of its
true height: the force on the surface is shared φ : 1 - φ between upper and lower node, so the cut
layer gives φ² h / (φ E A) = φ h / (E A). Loads on the lattice's top would give h / (φ E A).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import MeshError
from ifem_export.mesh.crown import Crown
from ifem_export.mesh.lattice import Numbering
from ifem_export.mesh.outline import Outline

Array = NDArray[np.float64]


def column_tops(occupancy: NDArray[np.bool_], numbering: Numbering) -> NDArray[np.int64]:
    """Level of the highest node of each column (ny + 1, nx + 1), -1 where there is none.

    Raises:
        MeshError: a column that does not reach from the bonded face to its top.
    """
    if (occupancy[:, :, 1:] & ~occupancy[:, :, :-1]).any():
        raise MeshError("a column of cells has a gap or hangs in the air: no surface over it")
    exists = numbering.node_index.reshape(numbering.shape) >= 0
    return np.where(exists.any(axis=0), exists.sum(axis=0) - 1, -1)


def surface_of(
    occupancy: NDArray[np.bool_], numbering: Numbering, levels: Array | None
) -> tuple[NDArray[np.int32], Array]:
    """Surface node of every column and the surface's height over it.

    Args:
        occupancy: (nx, ny, nz) cells of the pad.
        numbering: its nodes.
        levels: (ny + 1, nx + 1) height of the surface over each column, in layers from the
            bonded face; None puts it on the columns' highest nodes.

    Returns:
        (c,) sorted node numbers and (c,) t in cells.

    Raises:
        MeshError: columns with gaps.
    """
    tops = column_tops(occupancy, numbering)
    j, i = np.nonzero(tops >= 0)
    top = tops[j, i]
    true = top.astype(float) if levels is None else np.minimum(levels[j, i], top)
    # Rim columns may lie outside the outline, where the surface goes on falling.
    level = np.clip(np.rint(true), 1, top).astype(np.int64)
    shift = np.clip(true - level, -0.5, 0.5)
    nodes = numbering.node_index.reshape(numbering.shape)[level, j, i]
    order = np.argsort(nodes, kind="stable")
    return nodes[order].astype(np.int32), shift[order]


def crown_levels(
    crown: Crown,
    cells: tuple[int, ...],
    origin_mm: tuple[float, float, float],
    cell_size_mm: tuple[float, float, float],
) -> Array:
    """Height of the crown over each column (ny + 1, nx + 1), in layers from the bonded face."""
    x = origin_mm[0] + np.arange(cells[0] + 1) * cell_size_mm[0]
    y = origin_mm[1] + np.arange(cells[1] + 1) * cell_size_mm[1]
    return np.asarray(crown.height_mm(x[None, :], y[:, None]) / cell_size_mm[2] + cells[2])


def require_thick(
    outline: Outline,
    crown: Crown,
    thickness_mm: float,
    layers: int,
    edges_mm: tuple[Array, Array],
) -> None:
    """Raise MeshError where the gel is thinner than a layer or rises above z = 0."""
    x, y = edges_mm
    inside = outline.contains(x[:, None], y[None, :])
    if not inside.any():
        return
    height = crown.height_mm(x[:, None], y[None, :])[inside]
    if height.max() > 1e-9 * thickness_mm:
        raise MeshError("the crown rises above z = 0: its apex must be at z = 0")
    least = float(height.min()) + thickness_mm
    if least < thickness_mm / layers * (1.0 - 1e-9):
        raise MeshError(
            f"the crowned gel is {max(least, 0.0):.3g} mm thick at its thinnest, less than one "
            f"layer of {thickness_mm / layers:.3g} mm: use more layers or a lower crown"
        )
