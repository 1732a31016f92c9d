"""Compiled look at pictures of regions. Import this module only where it runs (numba)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
FAR = 1 << 30


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


@njit(**COMPILED)
def city_block(picture: Any, outside: Any, distance: Any) -> None:
    """Steps along rows and columns to the nearest true place, by two passes.

    Args:
        picture: (rows, columns).
        outside: Whether all that lies outside counts as true.
        distance: Receives (rows, columns); `FAR` where nothing is true.
    """
    rows, columns = picture.shape
    edge = 0 if outside else FAR
    for i in range(rows):
        for j in range(columns):
            above = distance[i - 1, j] if i > 0 else edge
            before = distance[i, j - 1] if j > 0 else edge
            distance[i, j] = 0 if picture[i, j] else min(FAR, above + 1, before + 1)
    for i in range(rows - 1, -1, -1):
        for j in range(columns - 1, -1, -1):
            below = distance[i + 1, j] if i < rows - 1 else edge
            after = distance[i, j + 1] if j < columns - 1 else edge
            distance[i, j] = min(distance[i, j], below + 1, after + 1)


@njit(**COMPILED)
def widen_nodes(nodes: Any, place: Any, steps: Any, distance: Any, found: Any) -> None:
    """Mark in `found` (c,) the nodes up to `steps` along a lattice away from one of `nodes` (c,).

    Args:
        nodes: (c,) marks.
        place: (c, 2) of the nodes on the lattice.
        steps: Along rows and columns, also over places without a node.
        distance: (rows, columns) is overwritten.
        found: Receives the marks.
    """
    picture = np.zeros(distance.shape, dtype=np.bool_)
    for n in range(len(nodes)):
        picture[place[n, 0], place[n, 1]] = nodes[n]
    city_block(picture, False, distance)
    for n in range(len(nodes)):
        found[n] = distance[place[n, 0], place[n, 1]] <= steps


@njit(**COMPILED)
def fill_holes(picture: Any, found: Any) -> None:
    """Write to `found` a picture with all false places that the edge does not reach made true.

    Steps go along rows and columns.

    Args:
        picture: (rows, columns).
        found: Receives (rows, columns).
    """
    rows, columns = picture.shape
    found[:] = True
    waiting, count = np.empty((rows * columns, 2), dtype=np.intp), 0
    for i in range(rows):
        step = 1 if i in (0, rows - 1) else max(columns - 1, 1)
        for j in range(0, columns, step):
            if not picture[i, j]:
                found[i, j] = False
                waiting[count, 0], waiting[count, 1] = i, j
                count += 1
    while count > 0:
        count -= 1
        i, j = waiting[count]
        for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if 0 <= a < rows and 0 <= b < columns and found[a, b] and not picture[a, b]:
                found[a, b] = False
                waiting[count, 0], waiting[count, 1] = a, b
                count += 1
