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

    The innermost loop runs along a row of nodes, for the compiler to take several at once, and
    makes the three forces of each from what it reads once.
    """
    layers, count = out.shape[1], out.shape[3]
    for k in range(layers):
        blocks = table[masks[k]]
        for j in range(out.shape[2]):
            x, y, z = out[0, k, j], out[1, k, j], out[2, k, j]
            x[:] = 0.0
            y[:] = 0.0
            z[:] = 0.0
            for dz in range(3):
                if k + dz == 0 or k + dz == layers + 1:
                    # These layers of `u` are zero.
                    continue
                for dy in range(3):
                    slot = 9 * dz + 3 * dy
                    for other in range(3):
                        moved = u[other, k + dz, j + dy]
                        xa, xb, xc = _row(blocks, slot, 0, other)
                        ya, yb, yc = _row(blocks, slot, 1, other)
                        za, zb, zc = _row(blocks, slot, 2, other)
                        for i in range(count):
                            before, here, after = moved[i], moved[i + 1], moved[i + 2]
                            x[i] += xa * before + xb * here + xc * after
                            y[i] += ya * before + yb * here + yc * after
                            z[i] += za * before + zb * here + zc * after


@njit(cache=True, nogil=True)
def _row(blocks: Any, slot: Any, axis: Any, other: Any) -> Any:
    """Stiffness of three neighbours in a row."""
    return blocks[slot, axis, other], blocks[slot + 1, axis, other], blocks[slot + 2, axis, other]


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
