"""Compiled loops of the product without a matrix. Import this module only where they run (numba).

`u` (3, L + 2, rows + 2, columns + 2) holds the displacements of the free nodes of a lattice and
zeros around them; `out` (3, L, rows, columns) the forces. The node (k, j, i) of `out` is the node
(k + 1, j + 1, i + 1) of `u`. `table` (256, 27, 3, 3) is that of `occupancy_table`.
"""

from __future__ import annotations

from typing import Any

from numba import njit


@njit(cache=True, nogil=True)
def spread(field: Any, rows: Any, columns: Any, u: Any) -> None:
    """Write a field (L, c, 3) of the columns at (rows, columns) into `u`."""
    for layer in range(field.shape[0]):
        for node in range(field.shape[1]):
            j, i = rows[node] + 1, columns[node] + 1
            for axis in range(3):
                u[axis, layer + 1, j, i] = field[layer, node, axis]


@njit(cache=True, nogil=True)
def collect(out: Any, rows: Any, columns: Any, field: Any) -> None:
    """Read a field (L, c, 3) of the columns at (rows, columns) from `out`."""
    for layer in range(field.shape[0]):
        for node in range(field.shape[1]):
            for axis in range(3):
                field[layer, node, axis] = out[axis, layer, rows[node], columns[node]]


@njit(cache=True, nogil=True)
def apply_by_layers(u: Any, table: Any, masks: Any, out: Any) -> None:
    """Forces of nodes of which all in layer k have the cells of masks[k].

    The innermost loop runs along a row of nodes, for the compiler to take several at once.
    """
    count = out.shape[3]
    for k in range(out.shape[1]):
        blocks = table[masks[k]]
        for j in range(out.shape[2]):
            for axis in range(3):
                force = out[axis, k, j]
                force[:] = 0.0
                for dz in range(3):
                    for dy in range(3):
                        slot = 9 * dz + 3 * dy
                        for other in range(3):
                            moved = u[other, k + dz, j + dy]
                            before = blocks[slot, axis, other]
                            here = blocks[slot + 1, axis, other]
                            after = blocks[slot + 2, axis, other]
                            for i in range(count):
                                force[i] += (
                                    before * moved[i] + here * moved[i + 1] + after * moved[i + 2]
                                )


@njit(cache=True, nogil=True)
def apply_by_nodes(u: Any, table: Any, nodes: Any, masks: Any, out: Any) -> None:
    """Forces of the nodes (n, 3), each (k, j, i) with the cells of its own mask (n,)."""
    for n in range(len(nodes)):
        k, j, i = nodes[n]
        blocks = table[masks[n]]
        # Three sums at once, because each addition waits for the one before.
        x = y = z = 0.0
        for dz in range(3):
            for dy in range(3):
                slot = 9 * dz + 3 * dy
                for other in range(3):
                    for dx in range(3):
                        moved = u[other, k + dz, j + dy, i + dx]
                        x += blocks[slot + dx, 0, other] * moved
                        y += blocks[slot + dx, 1, other] * moved
                        z += blocks[slot + dx, 2, other] * moved
        out[0, k, j, i], out[1, k, j, i], out[2, k, j, i] = x, y, z
