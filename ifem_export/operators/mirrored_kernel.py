"""Compiled parts of a convolution that is its own mirror image. It loads numba.

A `field` (L, c, 3) lies on c columns of a padded `lattice` (rows, columns, L, 3), whose transform
along both is `waves`. See `preconditioner` for the blocks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def spread(field: Any, places: Any, lattice: Any) -> None:
    """Write a field at places (c, 2) of the lattice, zero elsewhere."""
    lattice[:] = 0.0
    for node in range(len(places)):
        column = lattice[places[node, 0], places[node, 1]]
        for layer in range(field.shape[0]):
            for axis in range(3):
                column[layer, axis] = field[layer, node, axis]


@njit(cache=True, nogil=True)
def collect(lattice: Any, places: Any, field: Any) -> None:
    """Read a field from places (c, 2) of the lattice."""
    for node in range(len(places)):
        column = lattice[places[node, 0], places[node, 1]]
        for layer in range(field.shape[0]):
            for axis in range(3):
                field[layer, node, axis] = column[layer, axis]


@njit(cache=True, nogil=True)
def multiply(blocks: Any, waves: Any) -> None:
    """Multiply the waves (rows, kx, 3L) by their blocks, in place.

    `blocks` (ky >= 0, kx, 3L, 3L) are P* B P. With Y = diag(1, -1, 1) they serve ky and -ky: two
    complex columns, which are four real ones.
    """
    count, size = len(waves), waves.shape[2]
    before, after = np.empty((size, 4)), np.empty((size, 4))
    for ky in range(len(blocks)):
        opposite = (count - ky) % count
        for kx in range(waves.shape[1]):
            load_pair(waves[ky, kx], waves[opposite, kx], before)
            block = blocks[ky, kx]
            for i in range(size):
                a = b = c = d = 0.0
                for j in range(size):
                    share = block[i, j]
                    a += share * before[j, 0]
                    b += share * before[j, 1]
                    c += share * before[j, 2]
                    d += share * before[j, 3]
                after[i, 0], after[i, 1], after[i, 2], after[i, 3] = a, b, c, d
            store_pair(after, waves[ky, kx], waves[opposite, kx])


@njit(cache=True, nogil=True)
def load_pair(first: Any, second: Any, found: Any) -> None:
    """Write P* of the wave of ky and P* Y of that of -ky as real columns (3L, 4)."""
    for i in range(0, len(first), 3):
        for pair in range(2):
            wave = first if pair == 0 else second
            sign, re, im = 1.0 - 2.0 * pair, 2 * pair, 2 * pair + 1
            found[i, re], found[i, im] = wave[i].real, wave[i].imag
            found[i + 1, re], found[i + 1, im] = sign * wave[i + 1].real, sign * wave[i + 1].imag
            found[i + 2, re], found[i + 2, im] = wave[i + 2].imag, -wave[i + 2].real


@njit(cache=True, nogil=True)
def store_pair(columns: Any, first: Any, second: Any) -> None:
    """The inverse of `load_pair`; where both waves are one, the first counts."""
    for i in range(0, len(first), 3):
        for pair in (1, 0):
            wave = first if pair == 0 else second
            sign, re, im = 1.0 - 2.0 * pair, 2 * pair, 2 * pair + 1
            wave[i] = complex(columns[i, re], columns[i, im])
            wave[i + 1] = complex(sign * columns[i + 1, re], sign * columns[i + 1, im])
            wave[i + 2] = complex(-columns[i + 2, im], columns[i + 2, re])
