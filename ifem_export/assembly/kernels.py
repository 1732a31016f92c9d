"""Compiled loops of the assembly. Import this module only where they run (numba)."""

from __future__ import annotations

from typing import Any

from numba import njit

# `masks`, `positions` and `first_block` are per node, `node_index` is over the lattice, `counts`
# and `slots` are the neighbour pattern, and `strides` is the lattice offset of each slot. The rows
# of a node do not depend on those of another node, so any division among threads gives the same
# bits.


@njit(cache=True, nogil=True)
def fill_csr(
    start: int,
    stop: int,
    masks: Any,
    positions: Any,
    first_block: Any,
    node_index: Any,
    counts: Any,
    slots: Any,
    strides: Any,
    recipe: Any,
    indptr: Any,
    indices: Any,
    data: Any,
) -> None:
    """Write the scalar CSR rows 3·start … 3·stop.

    `recipe` holds the `table` (256, 3, 27, 3) of the rows of full cells; the `scales` (n, 8) of
    the cells around each node, empty where all cells are full; the element's blocks (8, 8, 3, 3);
    and for each slot the number of shared cells (27,) and the cells themselves (27, 8, 3).
    """
    table, scales, blocks, pair_counts, pairs = recipe
    all_full = len(scales) == 0
    for node in range(start, stop):
        mask = masks[node]
        count = counts[mask]
        position = positions[node]
        row_start = 9 * first_block[node]
        width = 3 * count
        for row in range(3):
            indptr[3 * node + row] = row_start + row * width
        for b in range(count):
            slot = slots[mask, b]
            column = 3 * node_index[position + strides[slot]]
            at = row_start + 3 * b
            for row in range(3):
                for c in range(3):
                    indices[at + c] = column + c
                    if all_full:
                        data[at + c] = table[mask, row, slot, c]
                        continue
                    total = 0.0
                    for p in range(pair_counts[slot]):
                        bit, here, there = pairs[slot, p]
                        total += scales[node, bit] * blocks[here, there, row, c]
                    data[at + c] = total
                at += width
