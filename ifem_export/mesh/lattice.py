"""Numbering of nodes and cells on a cropped uniform lattice.

An occupancy (nx, ny, nz) tells which cells of a box lattice exist. Nodes are the corners of
existing cells and are numbered with x fastest and z slowest, as are the cells. Therefore the
bonded lower face comes first and the outer surface of a flat pad last, and the neighbours of a
node have increasing numbers, which keeps the assembled rows sorted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import MeshError

# Local corners of a cell in the standard VTK_HEXAHEDRON order.
VTK_CORNERS = np.array(
    [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ],
    dtype=np.int64,
)
_INT32_MAX = np.iinfo(np.int32).max


@dataclass(frozen=True, eq=False)
class Numbering:
    """Node numbers of a cropped lattice.

    Attributes:
        shape: Nodes of the box lattice along (z, y, x).
        masks: (n,) uint8, which of a node's eight cells exist; bit 4(k+1)+2(j+1)+(i+1) is the
            cell at offset (i, j, k), each -1 or 0.
        positions: (n,) flat index of each node in the lattice.
        node_index: Flat (lattice nodes,) int32, the node's number or -1.
    """

    shape: tuple[int, int, int]
    masks: NDArray[np.uint8]
    positions: NDArray[np.int64]
    node_index: NDArray[np.int32]

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.positions)


def zyx(occupancy: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The occupancy as a contiguous (nz, ny, nx) array, so that x runs fastest."""
    return np.ascontiguousarray(occupancy.transpose(2, 1, 0))


def number_nodes(occupancy: NDArray[np.bool_]) -> Numbering:
    """Number the nodes of the existing cells.

    Args:
        occupancy: (nx, ny, nz) bool.

    Raises:
        MeshError: No cell exists, or a 32-bit index cannot count the nodes.
    """
    if occupancy.ndim != 3 or occupancy.dtype != np.bool_:
        raise MeshError(
            f"occupancy has shape {occupancy.shape} and type {occupancy.dtype}: "
            "must be a bool array (nx, ny, nz)",
            field="occupancy",
        )
    cells = zyx(occupancy).view(np.uint8)
    nz, ny, nx = cells.shape
    shape = (nz + 1, ny + 1, nx + 1)
    if shape[0] * shape[1] * shape[2] > _INT32_MAX:
        raise MeshError(f"a lattice of {nx} x {ny} x {nz} cells is too large: coarsen the pitch")
    masks = np.zeros(shape, dtype=np.uint8)
    for bit in range(8):
        k, j, i = bit >> 2 & 1, bit >> 1 & 1, bit & 1
        # The cell at offset -1 (bit clear) of node p is cell p-1: nodes 1..n see cells 0..n-1.
        masks[1 - k : nz + 1 - k, 1 - j : ny + 1 - j, 1 - i : nx + 1 - i] |= cells << bit
    flat = masks.reshape(-1)
    positions = np.flatnonzero(flat)
    if len(positions) == 0:
        raise MeshError(
            "no cell is inside the outline: use a finer pitch or a larger outline",
            field="occupancy",
        )
    node_index = np.full(flat.shape, -1, dtype=np.int32)
    node_index[positions] = np.arange(len(positions), dtype=np.int32)
    return Numbering(shape, flat[positions], positions, node_index)


def checked_cell_size(cell_size_mm: Sequence[float]) -> NDArray[np.float64]:
    """The cell size (3,) in mm. Raises MeshError unless it is three finite numbers > 0."""
    size = np.asarray(cell_size_mm, dtype=float)
    if size.shape != (3,) or not np.isfinite(size).all() or (size <= 0.0).any():
        raise MeshError(
            f"cell_size_mm = {cell_size_mm}: must be three finite numbers > 0",
            field="cell_size_mm",
        )
    return size


def node_coordinates(
    numbering: Numbering, origin_mm: NDArray[np.float64], cell_size_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coordinates (n, 3) in mm of the numbered nodes."""
    k, j, i = np.unravel_index(numbering.positions, numbering.shape)
    return np.asarray(origin_mm + np.stack([i, j, k], axis=1) * cell_size_mm)


def hexahedra(occupancy: NDArray[np.bool_], numbering: Numbering) -> NDArray[np.int32]:
    """Corner node numbers (m, 8) of the existing cells, in VTK_HEXAHEDRON order."""
    k, j, i = np.nonzero(zyx(occupancy))
    _, ny1, nx1 = numbering.shape
    corner = (k * ny1 + j) * nx1 + i
    offsets = (VTK_CORNERS[:, 2] * ny1 + VTK_CORNERS[:, 1]) * nx1 + VTK_CORNERS[:, 0]
    return numbering.node_index[corner[:, None] + offsets[None, :]]


def node_sets(occupancy: NDArray[np.bool_], numbering: Numbering) -> dict[str, NDArray[np.int32]]:
    """Sorted int32 node numbers of three sets, by exposed faces.

    `bonded` holds the nodes of faces on the lowest lattice plane, `surface` those of upward
    faces with no cell above, and `sides` those of lateral faces with no neighbour. Nodes on a
    rim belong to both sets that meet there.
    """
    cells = zyx(occupancy)
    faces_of = {
        "bonded": [(0, 0)],
        "surface": [(0, 1)],
        "sides": [(1, 0), (1, 1), (2, 0), (2, 1)],
    }
    found = {}
    for name, faces in faces_of.items():
        on_set = np.zeros(numbering.shape, dtype=bool)
        for axis, end in faces:
            exposed_cells = _cells_with_exposed_face(cells, axis, end)
            if name == "bonded":
                exposed_cells[1:] = False
            _mark_face_nodes(on_set, exposed_cells, axis, end)
        found[name] = numbering.node_index[np.flatnonzero(on_set.reshape(-1))]
    return found


def _cells_with_exposed_face(cells: NDArray[np.bool_], axis: int, end: int) -> NDArray[np.bool_]:
    """Cells whose neighbour along `axis` towards `end` (0 low, 1 high) is absent."""
    exposed_cells = cells.copy()
    here = [slice(None)] * 3
    there = [slice(None)] * 3
    here[axis], there[axis] = (slice(None, -1), slice(1, None))
    if end == 0:
        here, there = there, here
    exposed_cells[tuple(here)] &= ~cells[tuple(there)]
    return exposed_cells


def _mark_face_nodes(
    on_set: NDArray[np.bool_], exposed_cells: NDArray[np.bool_], axis: int, end: int
) -> None:
    across = [a for a in range(3) if a != axis]
    for p in (0, 1):
        for q in (0, 1):
            window = [slice(None)] * 3
            for a, shift in ((axis, end), (across[0], p), (across[1], q)):
                window[a] = slice(shift, shift + exposed_cells.shape[a])
            on_set[tuple(window)] |= exposed_cells
