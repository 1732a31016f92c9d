"""Compiled search for the bins whose light changed. Import this module only where it runs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def bins_above_noise(
    change: Any, noise: Any, valid: Any, least_power: Any, least_valid: Any, found: Any, box: Any
) -> None:
    """Bins around which the mean squared change over the noise is large.

    The mean is that of the valid ones of the 3 x 3 bins around each; beyond the edge of the picture
    the bins at the edge are repeated.

    Args:
        change: (c, rows, columns).
        noise: (c, rows, columns) its standard deviation.
        valid: (rows, columns).
        least_power: Mean beyond which a bin has changed.
        least_valid: Share of valid bins beyond which it tells.
        found: (rows, columns) receives the bins.
        box: (4,) receives the first row with one, that after the last, and the same of the columns;
            0, 0, 0, 0 without any.
    """
    layers, rows, columns = change.shape
    across = np.empty((2, rows, columns))
    power, seen = np.zeros(columns + 2), np.zeros(columns + 2)
    for i in range(rows):
        for j in range(columns):
            power[j + 1], seen[j + 1] = 0.0, valid[i, j]
        for c in range(layers):
            for j in range(columns):
                sigmas = change[c, i, j] / noise[c, i, j]
                power[j + 1] += seen[j + 1] * sigmas * sigmas
        power[0], power[columns + 1] = power[1], power[columns]
        seen[0], seen[columns + 1] = seen[1], seen[columns]
        for j in range(columns):
            across[0, i, j] = power[j] + power[j + 1] + power[j + 2]
            across[1, i, j] = seen[j] + seen[j + 1] + seen[j + 2]
    box[0], box[1], box[2], box[3] = rows, 0, columns, 0
    for i in range(rows):
        above, below = max(i - 1, 0), min(i + 1, rows - 1)
        any_here = False
        for j in range(columns):
            count = across[1, above, j] + across[1, i, j] + across[1, below, j]
            total = across[0, above, j] + across[0, i, j] + across[0, below, j]
            found[i, j] = (count > 9 * least_valid) & (total > least_power * count)
            any_here |= found[i, j]
        if any_here:
            box[0], box[1] = min(box[0], i), i + 1
            for j in range(columns):
                if found[i, j]:
                    box[2], box[3] = min(box[2], j), max(box[3], j + 1)
    if box[1] == 0:
        box[:] = 0
