"""The paper's operator as a stencil, compiled. Import this module only where it runs: numba."""

from __future__ import annotations

from typing import Any

from numba import njit


@njit(cache=True, nogil=True, fastmath=False)
def apply_stencil(types: Any, neighbours: Any, table: Any, u: Any, f: Any) -> None:
    """f = K u for surface nodes that see their eight neighbours only.

    `types` (c,) chooses the blocks of `table` (t, 3, 3, 9) (row, column, neighbour);
    `neighbours` (c, 9) are node numbers, c for an absent one; `u` (c + 1, 3) ends in zeros.
    """
    for node in range(len(types)):
        blocks = table[types[node]]
        a = b = c = 0.0
        for slot in range(9):
            other = neighbours[node, slot]
            x, y, z = u[other, 0], u[other, 1], u[other, 2]
            a += blocks[0, 0, slot] * x + blocks[0, 1, slot] * y + blocks[0, 2, slot] * z
            b += blocks[1, 0, slot] * x + blocks[1, 1, slot] * y + blocks[1, 2, slot] * z
            c += blocks[2, 0, slot] * x + blocks[2, 1, slot] * y + blocks[2, 2, slot] * z
        f[node, 0], f[node, 1], f[node, 2] = a, b, c
