"""Compiled loops of the surface operators. Import this module only where they run (numba)."""

from __future__ import annotations

from typing import Any

from numba import njit


@njit(cache=True, nogil=True, fastmath=False)
def apply_stencil(types: Any, neighbours: Any, table: Any, u: Any, f: Any) -> None:
    """f = K u for nodes that are coupled to a few neighbours each.

    `types` (c,) selects the blocks of `table` (t, 3, 3, k) (row, column, neighbour). `neighbours`
    (c, k) are rows of `u` (m, 3); for one that is absent, a row of zeros.
    """
    count = neighbours.shape[1]
    for node in range(len(types)):
        blocks = table[types[node]]
        a = b = c = 0.0
        for slot in range(count):
            other = neighbours[node, slot]
            x, y, z = u[other, 0], u[other, 1], u[other, 2]
            a += blocks[0, 0, slot] * x + blocks[0, 1, slot] * y + blocks[0, 2, slot] * z
            b += blocks[1, 0, slot] * x + blocks[1, 1, slot] * y + blocks[1, 2, slot] * z
            c += blocks[2, 0, slot] * x + blocks[2, 1, slot] * y + blocks[2, 2, slot] * z
        f[node, 0], f[node, 1], f[node, 2] = a, b, c


@njit(cache=True, nogil=True, error_model="numpy")
def gather_products(kernel: Any, positions: Any, out: Any) -> None:
    """Write the products (3n, 3n) of nodes at lattice `positions` (n, 2).

    They come from a periodic `kernel` (rows, columns, 3, 3).
    """
    rows, columns = kernel.shape[0], kernel.shape[1]
    for i in range(len(positions)):
        for j in range(i + 1):
            y = (positions[i, 0] - positions[j, 0]) % rows
            x = (positions[i, 1] - positions[j, 1]) % columns
            for a in range(3):
                for b in range(3):
                    value = kernel[y, x, a, b]
                    out[3 * i + a, 3 * j + b] = value
                    out[3 * j + b, 3 * i + a] = value
