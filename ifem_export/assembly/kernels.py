"""Compiled loops. Import this module only where they run: it loads numba."""

from __future__ import annotations

from typing import Any

from numba import njit

# Arguments shared by the two fills: nodes [start, stop) are written; `masks`, `positions` and
# `first_block` are per node, `node_index` is over the lattice, `counts` and `slots` are the
# neighbour pattern and `strides` the lattice offset of each slot. A node's rows depend on
# nothing that another node writes, so any split over threads gives the same bits.


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
    table: Any,
    indptr: Any,
    indices: Any,
    data: Any,
) -> None:
    """Write the scalar CSR rows 3·start … 3·stop; `table` is (256, 3, 27, 3)."""
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
                    data[at + c] = table[mask, row, slot, c]
                at += width


@njit(cache=True, nogil=True)
def fill_bsr(
    start: int,
    stop: int,
    masks: Any,
    positions: Any,
    first_block: Any,
    node_index: Any,
    counts: Any,
    slots: Any,
    strides: Any,
    table: Any,
    indptr: Any,
    indices: Any,
    data: Any,
) -> None:
    """Write the block rows start … stop; `table` is (256, 27, 3, 3), `data` (blocks, 3, 3)."""
    for node in range(start, stop):
        mask = masks[node]
        position = positions[node]
        at = first_block[node]
        indptr[node] = at
        for b in range(counts[mask]):
            slot = slots[mask, b]
            indices[at + b] = node_index[position + strides[slot]]
            for row in range(3):
                for c in range(3):
                    data[at + b, row, c] = table[mask, slot, row, c]
