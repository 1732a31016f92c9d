"""Compiled convolution on a small lattice by matrices of cosines and sines. It loads numba.

The transform of a field is kept as products of cosines and sines along y and along x. A wave vector
then has four families of real waves, one for each parity along either axis. With P* B P of
`preconditioner`, the same real block leads from each family to itself: the component along an axis
has the other parity there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz"},
}


@njit(**COMPILED)
def convolve(
    field: Any, places: Any, to_y: Any, to_x: Any, from_x: Any, from_y: Any, blocks: Any, found: Any
) -> None:
    """Convolve a field (L, c, 3) on columns of a lattice of ny x nx places.

    Args:
        field: (L, c, 3).
        places: (c, 2) of its columns on the lattice.
        to_y: (2 hy, ny), cosines and then sines of hy wave numbers along y.
        to_x: (nx, 2 hx), the same along x.
        from_x: (2 hx, nx), the inverse of `to_x`.
        from_y: (ny, 2 hy), the inverse of `to_y`.
        blocks: (hy, 3L, 3L, hx), P* B P.
        found: Receives (L, c, 3).
    """
    size, rows = 3 * len(field), to_y.shape[1]
    lattice = np.zeros((size * rows, len(to_x)))
    for layer in range(len(field)):
        for node in range(len(places)):
            y, x = places[node, 0], places[node, 1]
            for axis in range(3):
                lattice[(3 * layer + axis) * rows + y, x] = field[layer, node, axis]
    by_x = lattice @ to_x
    waves = np.empty((size, len(to_y), to_x.shape[1]))
    for k in range(size):
        np.dot(to_y, by_x[k * rows : (k + 1) * rows], waves[k])
    multiply_families(blocks, waves)
    for k in range(size):
        np.dot(from_y, waves[k], by_x[k * rows : (k + 1) * rows])
    np.dot(by_x, from_x, lattice)
    for layer in range(len(field)):
        for node in range(len(places)):
            y, x = places[node, 0], places[node, 1]
            for axis in range(3):
                found[layer, node, axis] = lattice[(3 * layer + axis) * rows + y, x]


@njit(**COMPILED)
def multiply_families(blocks: Any, waves: Any) -> None:
    """Multiply waves (3L, 2 hy, 2 hx) by their blocks (hy, 3L, 3L, hx), in place."""
    size, count = len(waves), blocks.shape[3]
    before, after = np.empty((2, size, 4, count))
    for ky in range(len(blocks)):
        for j in range(size):
            for family in range(4):
                sign, row, first = _part(j, family, ky, len(blocks), count)
                wave, out = waves[j, row], before[j, family]
                for kx in range(count):
                    out[kx] = sign * wave[first + kx]
        for i in range(size):
            for family in range(4):
                out = after[i, family]
                out[:] = 0.0
                # Three at a time, so that the sums are seldom read and written.
                for j in range(0, size, 3):
                    a, b, c = blocks[ky, i, j], blocks[ky, i, j + 1], blocks[ky, i, j + 2]
                    u, v, w = before[j, family], before[j + 1, family], before[j + 2, family]
                    for kx in range(count):
                        out[kx] += a[kx] * u[kx] + b[kx] * v[kx] + c[kx] * w[kx]
        for i in range(size):
            for family in range(4):
                sign, row, first = _part(i, family, ky, len(blocks), count)
                wave, out = waves[i, row], after[i, family]
                for kx in range(count):
                    wave[first + kx] = sign * out[kx]


@njit(inline="always", **COMPILED)
def _part(component: Any, family: Any, ky: Any, rows: Any, columns: Any) -> Any:
    """Sign, row and first column of the waves that a component has in one of the four families.

    Along its own axis a component is a sine where the others are cosines, and in the other family
    a cosine where they are negative sines.
    """
    along_x, along_y = int(component % 3 == 0), int(component % 3 == 1)
    px, py = family & 1, family >> 1
    sign = -1.0 if (px & along_x) != (py & along_y) else 1.0
    return sign, (py ^ along_y) * rows + ky, (px ^ along_x) * columns
