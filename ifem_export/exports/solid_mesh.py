"""The pad's mesh as other finite-element programs take it: elements, sets, faces, stiffness factor.

Corner nodes have the numbers and the order of `PadMesh`; nodes in the middle of edges follow them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import IfemError
from ifem_export.mesh.lattice import zyx
from ifem_export.mesh.pad_mesh import PadMesh

ElementType = Literal["C3D8", "C3D8I", "C3D20", "C3D20R"]
ELEMENT_TYPES: tuple[ElementType, ...] = get_args(ElementType)
"""Names as in Abaqus and CalculiX: eight nodes, the same with incompatible modes, twenty nodes, the
same with reduced integration."""

QUADRATIC: tuple[ElementType, ...] = ("C3D20", "C3D20R")

_EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
)
"""Edges of a cell in the order of the nodes 9 to 20 of a C3D20."""
_LOWER_FACE, _UPPER_FACE = (0, 3, 2, 1), (4, 5, 6, 7)
"""Corners of a cell's faces, anticlockwise seen from outside."""


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Nodes, cells and sets of a pad.

    Attributes:
        element: Type of the elements.
        nodes_mm: (n, 3) coordinates.
        cells: (m, 8) or (m, 20) nodes of each cell, counted from 0.
        sets: Nodes of `BONDED`, `SURFACE` and `SIDES`, each sorted.
        top_cells: Cells whose upper face belongs to the outer surface.
        bonded_cells: Cells whose lower face is bonded.
        fill: (m,) factor of each cell's stiffness; 1 where the gel fills it.
    """

    element: ElementType
    nodes_mm: NDArray[np.float64]
    cells: NDArray[np.int64]
    sets: dict[str, NDArray[np.int64]]
    top_cells: NDArray[np.int64]
    bonded_cells: NDArray[np.int64]
    fill: NDArray[np.float64]

    @property
    def upper_faces(self) -> NDArray[np.int64]:
        """Corners (k, 4) of the outer surface's faces."""
        return self.cells[self.top_cells][:, _UPPER_FACE]

    @property
    def lower_faces(self) -> NDArray[np.int64]:
        """Corners (k, 4) of the bonded faces."""
        return self.cells[self.bonded_cells][:, _LOWER_FACE]


def solid_mesh(mesh: PadMesh, element: ElementType = "C3D8") -> SolidMesh:
    """The mesh with sets and, for elements of twenty nodes, with nodes in the middle of edges.

    Args:
        mesh: The pad. Where it is crowned, the surface lies between nodes, and the outer faces
            here are those of the cells nearest to it.
        element: Type of the elements.

    Returns:
        The mesh.

    Raises:
        IfemError: The type is unknown.
    """
    if element not in ELEMENT_TYPES:
        raise IfemError(
            f"element {element!r}: must be one of {', '.join(ELEMENT_TYPES)}",
            field="element",
            value=element,
        )
    corners = np.asarray(mesh.hexes, dtype=np.int64)
    named = {"BONDED": mesh.bonded, "SURFACE": mesh.surface, "SIDES": mesh.sides}
    sets = {name: np.unique(nodes).astype(np.int64) for name, nodes in named.items()}
    nodes, cells = np.asarray(mesh.nodes_mm), corners
    if element in QUADRATIC:
        edges, middle = _edges(corners)
        cells = np.hstack([corners, len(nodes) + middle])
        sets = {name: _with_middles(found, edges, len(nodes)) for name, found in sets.items()}
        nodes = np.vstack([nodes, nodes[edges].mean(axis=1)])
    occupied = zyx(np.asarray(mesh.occupancy))
    fill = np.ones(len(cells)) if mesh.fill is None else np.asarray(mesh.fill).T[occupied]
    above, below = _exposed(occupied)
    return SolidMesh(element, nodes, cells, sets, above, below, np.asarray(fill, dtype=float))


def _edges(corners: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Each edge once as its two corners (e, 2), and the edges (m, 12) of each cell."""
    pairs = np.sort(corners[:, _EDGES].reshape(-1, 2), axis=1)
    edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
    return edges, np.asarray(inverse, dtype=np.int64).reshape(len(corners), len(_EDGES))


def _with_middles(
    nodes: NDArray[np.int64], edges: NDArray[np.int64], first: int
) -> NDArray[np.int64]:
    """The set with the middles of all edges whose two ends belong to it."""
    inside = np.isin(edges, nodes).all(axis=1)
    return np.concatenate([nodes, first + np.flatnonzero(inside)])


def _exposed(occupied: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of the cells with nothing above, and of those in the lowest layer."""
    number = np.cumsum(occupied).reshape(occupied.shape) - 1
    above = np.zeros_like(occupied)
    above[:-1] = occupied[1:]
    top = number[occupied & ~above]
    return np.sort(top).astype(np.int64), number[0][occupied[0]].astype(np.int64)
