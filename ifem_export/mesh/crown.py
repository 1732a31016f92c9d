"""Crowned pads: the shape of the outer surface and its position in the lattice.

The outer surface is a height z(x, y) <= 0 with its apex at z = 0. It cuts every column of nodes
between two of them. The nearer node represents the surface, and the displacement of the surface
itself is interpolated between the two nodes:

    u_s = (1 - |t|) u_near + |t| u_other,   t in [-1/2, 1/2] cells, > 0 above the nearer node

Cells that the surface cuts are scaled by their filled fraction φ. With the force on the surface
shared φ : 1 - φ between upper and lower node, a column has exactly the compliance of its true
height: the cut layer gives φ² h / (φ E A) = φ h / (E A). A force on the lattice's top alone would
give h / (φ E A).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import Numbering
from ifem_export.mesh.outline import Outline, require_positive

Array = NDArray[np.float64]


class Crown(Protocol):
    """The outer surface as z(x, y) <= 0."""

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Height z of the outer surface at points; the arguments broadcast."""
        ...


@dataclass(frozen=True)
class Paraboloid:
    """The crowned outer surface z = -crown (x² + y²) / rim², as the CAD builds it.

    Attributes:
        crown_mm: Fall from the apex to the rim, > 0.
        rim_mm: Distance of the outline's farthest points from the centre, > 0.

    Raises:
        OutlineError: A length is not finite or not positive.
    """

    crown_mm: float
    rim_mm: float

    def __post_init__(self) -> None:
        require_positive("crown_mm", self.crown_mm)
        require_positive("rim_mm", self.rim_mm)

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Height z of the outer surface at points; the arguments broadcast."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        return np.asarray(-self.crown_mm / self.rim_mm**2 * (x * x + y * y))


def column_tops(occupancy: NDArray[np.bool_], numbering: Numbering) -> NDArray[np.int64]:
    """Level of the highest node of each column (ny + 1, nx + 1), -1 where there is none.

    Raises:
        MeshError: A column of cells does not reach from the bonded face to its top.
    """
    if (occupancy[:, :, 1:] & ~occupancy[:, :, :-1]).any():
        raise MeshError(
            "a column of cells has a gap or does not start at the bonded face", field="occupancy"
        )
    exists = numbering.node_index.reshape(numbering.shape) >= 0
    return np.where(exists.any(axis=0), exists.sum(axis=0) - 1, -1)


def surface_of(
    occupancy: NDArray[np.bool_], numbering: Numbering, levels: Array | None
) -> tuple[NDArray[np.int32], Array]:
    """Surface node of every column and the height of the surface above this node.

    Args:
        occupancy: (nx, ny, nz) cells of the pad.
        numbering: Its nodes.
        levels: (ny + 1, nx + 1) height of the surface over each column, in layers from the
            bonded face; None puts it on the columns' highest nodes.

    Returns:
        (c,) sorted node numbers and (c,) the shift t in cells.

    Raises:
        MeshError: A column has a gap.
    """
    tops = column_tops(occupancy, numbering)
    j, i = np.nonzero(tops >= 0)
    top = tops[j, i]
    true = top.astype(float) if levels is None else np.minimum(levels[j, i], top)
    # Columns at the rim may lie outside the outline, where the surface continues to fall.
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
    """Raise MeshError if the gel is thinner than one layer or rises above z = 0."""
    x, y = edges_mm
    inside = outline.contains(x[:, None], y[None, :])
    if not inside.any():
        return
    height = crown.height_mm(x[:, None], y[None, :])[inside]
    if height.max() > 1e-9 * thickness_mm:
        raise MeshError("the crown rises above z = 0: its apex must be at z = 0", field="crown")
    least = float(height.min()) + thickness_mm
    if least < thickness_mm / layers * (1.0 - 1e-9):
        raise MeshError(
            f"the crowned gel is {max(least, 0.0):.3g} mm thick at its thinnest, less than one "
            f"layer of {thickness_mm / layers:.3g} mm: use more layers or a lower crown",
            field="layers",
            value=layers,
        )
