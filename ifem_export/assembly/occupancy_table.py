"""Table of the stiffness rows of a lattice node for every set of existing cells around it.

All cells of a uniform lattice share one element matrix, so the rows of a node depend only on the
8-bit mask of its existing cells: 256 masks x 27 neighbours x 3x3 values cover every crop.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ifem_export.mesh.lattice import VTK_CORNERS


@lru_cache(maxsize=1)
def shared_cells() -> tuple[tuple[tuple[int, int, int], ...], ...]:
    """For each slot the shared cells, as (cell bit, corner of the node, corner of the neighbour).

    Cells are in lattice order, so that the sums for (i, j) and (j, i) add the same cells in the
    same order, which makes the assembled matrix exactly symmetric.
    """
    corner_number = {tuple(corner): a for a, corner in enumerate(VTK_CORNERS.tolist())}
    shared = []
    for slot in range(27):
        dz, dy, dx = slot // 9 - 1, slot // 3 % 3 - 1, slot % 3 - 1
        pairs = []
        for bit in range(8):
            here = (1 - (bit & 1), 1 - (bit >> 1 & 1), 1 - (bit >> 2 & 1))
            there = (here[0] + dx, here[1] + dy, here[2] + dz)
            if there in corner_number:
                pairs.append((bit, corner_number[here], corner_number[there]))
        shared.append(tuple(pairs))
    return tuple(shared)


@lru_cache(maxsize=1)
def neighbour_pattern() -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Which of a node's 27 neighbours share a cell with it, for each mask.

    Neighbour slot 9(dz+1)+3(dy+1)+(dx+1) lies at offset (dx, dy, dz); slots increase with the
    neighbour's number.

    Returns:
        The number of neighbours (256,), the node itself included, and the slots (256, 27): the
        present ones in increasing order, then the absent ones.
    """
    masks = np.arange(256)
    present = np.zeros((256, 27), dtype=bool)
    for slot, pairs in enumerate(shared_cells()):
        for bit, _, _ in pairs:
            present[:, slot] |= (masks >> bit & 1).astype(bool)
    order = np.argsort(~present, axis=1, kind="stable").astype(np.uint8)
    return present.sum(axis=1), order


def occupancy_table(element_matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stiffness blocks for each mask and neighbour.

    Args:
        element_matrix: (24, 24) in N/mm.

    Returns:
        (256, 27, 3, 3) in N/mm, zero where no cell is shared.
    """
    return _tabulated(np.asarray(element_matrix, dtype=np.float64).tobytes()).copy()


@lru_cache(maxsize=4)
def _tabulated(element_matrix: bytes) -> NDArray[np.float64]:
    """The table of an element matrix, for which the operators of a pad ask again and again."""
    blocks = np.frombuffer(element_matrix).reshape(8, 3, 8, 3).transpose(0, 2, 1, 3)
    bits = (np.arange(256)[:, None] >> np.arange(8) & 1).astype(float)
    table = np.zeros((256, 27, 3, 3))
    for slot, pairs in enumerate(shared_cells()):
        for bit, a, b in pairs:
            table[:, slot] += bits[:, bit, None, None] * blocks[a, b]
    return table
