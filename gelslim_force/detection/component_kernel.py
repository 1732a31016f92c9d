"""Compiled connected components of a picture of darkness; import it only where it runs (numba)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED

AREA, X, Y, XX, XY, YY, PEAK, LEFT, RIGHT, TOP, BOTTOM = range(11)
"""Columns: number of pixels, centroid, second moments, largest darkness, bounding box."""
COLUMNS = 11


@njit(**COMPILED)
def _root(parent: Any, label: Any) -> Any:
    while parent[label] != label:
        parent[label] = parent[parent[label]]
        label = parent[label]
    return label


@njit(**COMPILED)
def whole_rows(height: Any, width: Any) -> Any:
    """Runs (height, 3) that are the rows of a picture."""
    runs = np.zeros((height, 3), dtype=np.int32)
    for y in range(height):
        runs[y, 0], runs[y, 2] = y, width
    return runs


@njit(**COMPILED)
def components(dark: Any, within: Any, least: Any) -> Any:
    """Find the components of pixels whose darkness exceeds `least`.

    A run (row, begin, end) holds the pixels begin <= x < end of a row. Only the runs `within`
    (k, 3), in order of rows and columns, are searched. Pixels that share an edge or a corner
    belong together. Centroids and second moments are weighted by darkness.

    Returns a table (n, 11) of the components, their runs (m, 3) in order, and the component (m,)
    of each run.
    """
    most = 0
    for i in range(len(within)):
        most += (within[i, 2] - within[i, 1]) // 2 + 1
    runs = np.empty((most, 3), dtype=np.int32)
    parent = np.empty(most, dtype=np.int32)
    count = first = candidate = 0
    row = -1
    for i in range(len(within)):
        y, x, right = within[i, 0], within[i, 1], within[i, 2]
        if y != row:
            # Runs from `candidate` to `first` are those of the row above.
            candidate = first if y == row + 1 else count
            first, row = count, y
        line = dark[y]
        while x < right:
            if not line[x] > least:
                x += 1
                continue
            start = x
            while x < right and line[x] > least:
                x += 1
            runs[count, 0], runs[count, 1], runs[count, 2] = y, start, x
            parent[count] = count
            while candidate < first and runs[candidate, 2] < start:
                candidate += 1
            k = candidate
            while k < first and runs[k, 1] <= x:
                a, b = _root(parent, k), _root(parent, count)
                if a < b:
                    parent[b] = a
                else:
                    parent[a] = b
                k += 1
            count += 1
    return _summed(dark, runs[:count].copy(), parent[:count])


@njit(**COMPILED)
def _summed(dark: Any, runs: Any, parent: Any) -> Any:
    number = np.empty(parent.size, dtype=np.int32)
    total = 0
    for k in range(parent.size):
        root = _root(parent, k)
        if root == k:
            number[k] = total
            total += 1
        else:
            number[k] = number[root]
    table = np.zeros((total, 11))
    mass = np.zeros(total)
    for i in range(total):
        table[i, LEFT] = table[i, TOP] = 1e9
        table[i, RIGHT] = table[i, BOTTOM] = -1.0
    for k in range(parent.size):
        i = number[k]
        row, line = table[i], dark[runs[k, 0]]
        begin, end, y = runs[k, 1], runs[k, 2], float(runs[k, 0])
        row[AREA] += end - begin
        row[LEFT] = min(row[LEFT], begin)
        row[RIGHT] = max(row[RIGHT], end - 1)
        row[TOP] = min(row[TOP], y)
        row[BOTTOM] = max(row[BOTTOM], y)
        peak, d0, d1, d2 = row[PEAK], 0.0, 0.0, 0.0
        for x in range(begin, end):
            d = float(line[x])
            peak = max(peak, d)
            d0 += d
            d1 += d * x
            d2 += d * x * x
        row[PEAK] = peak
        mass[i] += d0
        row[X] += d1
        row[Y] += d0 * y
        row[XX] += d2
        row[XY] += d1 * y
        row[YY] += d0 * y * y
    for i in range(total):
        row = table[i]
        if mass[i] > 0:
            for k in range(X, PEAK):
                row[k] /= mass[i]
        row[XX] -= row[X] * row[X]
        row[XY] -= row[X] * row[Y]
        row[YY] -= row[Y] * row[Y]
    return table, runs, number
