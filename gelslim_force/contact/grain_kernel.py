"""Compiled errors of blocks of bins. Import this module only where it runs: numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def block_sizes(
    change: Any, noise: Any, valid: Any, block: Any, tile: Any, least_valid: Any, found: Any
) -> Any:
    """Sizes of the changes of whole blocks of bins in each tile of blocks, over their noise.

    The change of a block is the sum over its valid bins, over the standard deviation that this sum
    has where the errors of bins are independent. The size of k of them is √(Σ z⁴ / (3 Σ z²)): that
    of normal values is their standard deviation, and that of a few among zeros is theirs.

    Args:
        change: (c, rows, columns) of the bins.
        noise: (c, rows, columns) its standard deviation.
        valid: (rows, columns).
        block: Bins along the side of a block.
        tile: Blocks along the side of a tile.
        least_valid: Share of the bins of a block, and of the blocks of a tile, that tell.
        found: (c, tiles) receives the sizes of the tiles that tell, in its first columns.

    Returns:
        How many tiles tell.
    """
    layers, rows, columns = change.shape
    side = block * tile
    count = 0
    fourth, second = np.empty(layers), np.empty(layers)
    total, variance = np.empty(layers), np.empty(layers)
    for top in range(0, rows - side + 1, side):
        for left in range(0, columns - side + 1, side):
            blocks = 0
            fourth[:] = 0.0
            second[:] = 0.0
            for first in range(top, top + side, block):
                for before in range(left, left + side, block):
                    bins = 0
                    total[:] = 0.0
                    variance[:] = 0.0
                    for i in range(first, first + block):
                        for j in range(before, before + block):
                            if valid[i, j]:
                                bins += 1
                                for c in range(layers):
                                    total[c] += change[c, i, j]
                                    variance[c] += noise[c, i, j] * noise[c, i, j]
                    if bins < least_valid * block * block:
                        continue
                    blocks += 1
                    for c in range(layers):
                        square = total[c] * total[c] / variance[c]
                        second[c] += square
                        fourth[c] += square * square
            if blocks < least_valid * tile * tile:
                continue
            for c in range(layers):
                found[c, count] = math.sqrt(fourth[c] / max(3 * second[c], 1e-12))
            count += 1
    return count
