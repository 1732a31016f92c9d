"""Compiled elimination of a pad's layers, wave vector by wave vector. It loads numba.

See `layer_elimination` for the blocks, and `mirrored_kernel` for the waves.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gelslim_core.kernel_cache import drop_stale
from ifem_export.operators.mirrored_kernel import load_pair, store_pair

drop_stale(["layer_kernel"], ["mirrored_kernel"], Path(__file__).parent)


@njit(cache=True, nogil=True)
def solve_layers(inverses: Any, coupling: Any, waves: Any) -> None:
    """Solve the block tridiagonal equations of all waves (rows, kx, 3L), in place.

    `inverses` (ky >= 0, kx, L, 3, 3) belong to the layers after those below them are eliminated,
    `coupling` (ky >= 0, kx, 3, 3) is the block of a layer and the one above it.
    """
    count, size = len(waves), waves.shape[2]
    layers = size // 3
    field = np.empty((size, 4))
    for ky in range(len(inverses)):
        opposite = (count - ky) % count
        for kx in range(waves.shape[1]):
            load_pair(waves[ky, kx], waves[opposite, kx], field)
            up, own = coupling[ky, kx], inverses[ky, kx]
            for layer in range(layers):
                _multiply(own[layer], field, 3 * layer)
                if layer < layers - 1:
                    _subtract_below(up, field, 3 * layer)
            for layer in range(layers - 2, -1, -1):
                _subtract_above(own[layer], up, field, 3 * layer)
            store_pair(field, waves[ky, kx], waves[opposite, kx])


@njit(cache=True, nogil=True)
def _multiply(block: Any, field: Any, at: int) -> None:
    """Multiply three rows of `field` (3L, 4) by a block (3, 3)."""
    for column in range(4):
        x, y, z = field[at, column], field[at + 1, column], field[at + 2, column]
        for i in range(3):
            field[at + i, column] = block[i, 0] * x + block[i, 1] * y + block[i, 2] * z


@njit(cache=True, nogil=True)
def _subtract_below(up: Any, field: Any, at: int) -> None:
    """Subtract from the layer above what the motion of a layer causes there."""
    for column in range(4):
        x, y, z = field[at, column], field[at + 1, column], field[at + 2, column]
        for i in range(3):
            field[at + 3 + i, column] -= up[0, i] * x + up[1, i] * y + up[2, i] * z


@njit(cache=True, nogil=True)
def _subtract_above(inverse: Any, up: Any, field: Any, at: int) -> None:
    """Subtract from a layer its motion by that of the layer above."""
    for column in range(4):
        x, y, z = field[at + 3, column], field[at + 4, column], field[at + 5, column]
        a = up[0, 0] * x + up[0, 1] * y + up[0, 2] * z
        b = up[1, 0] * x + up[1, 1] * y + up[1, 2] * z
        c = up[2, 0] * x + up[2, 1] * y + up[2, 2] * z
        for i in range(3):
            field[at + i, column] -= inverse[i, 0] * a + inverse[i, 1] * b + inverse[i, 2] * c
