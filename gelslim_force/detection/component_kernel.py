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
def components(dark: Any, left: Any, top: Any, right: Any, bottom: Any, least: Any) -> Any:
    """Return the components (n, 11) of pixels whose darkness exceeds `least`.

    Only columns left <= x < right and rows top <= y < bottom are searched. Pixels that share an
    edge or a corner belong together. Centroids and second moments are weighted by darkness.
    """
    most = (bottom - top) * ((right - left) // 2 + 1)
    begin = np.empty(most, dtype=np.int32)
    end = np.empty(most, dtype=np.int32)
    line = np.empty(most, dtype=np.int32)
    parent = np.empty(most, dtype=np.int32)
    count = 0
    previous = 0
    for y in range(top, bottom):
        first = count
        candidate = previous
        x = left
        while x < right:
            if not dark[y, x] > least:
                x += 1
                continue
            start = x
            while x < right and dark[y, x] > least:
                x += 1
            begin[count], end[count], line[count], parent[count] = start, x, y, count
            while candidate < first and end[candidate] < start:
                candidate += 1
            k = candidate
            while k < first and begin[k] <= x:
                a, b = _root(parent, k), _root(parent, count)
                if a < b:
                    parent[b] = a
                else:
                    parent[a] = b
                k += 1
            count += 1
        previous = first
    return _summed(dark, begin[:count], end[:count], line[:count], parent[:count])


@njit(**COMPILED)
def _summed(dark: Any, begin: Any, end: Any, line: Any, parent: Any) -> Any:
    number = np.full(parent.size, -1, dtype=np.int32)
    total = 0
    for k in range(parent.size):
        if parent[k] == k:
            number[k] = total
            total += 1
    table = np.zeros((total, 11))
    mass = np.zeros(total)
    for i in range(total):
        table[i, LEFT] = table[i, TOP] = 1e9
        table[i, RIGHT] = table[i, BOTTOM] = -1.0
    for k in range(parent.size):
        i = number[_root(parent, k)]
        row = table[i]
        y = float(line[k])
        row[AREA] += end[k] - begin[k]
        row[LEFT] = min(row[LEFT], begin[k])
        row[RIGHT] = max(row[RIGHT], end[k] - 1)
        row[TOP] = min(row[TOP], y)
        row[BOTTOM] = max(row[BOTTOM], y)
        for x in range(begin[k], end[k]):
            d = float(dark[line[k], x])
            row[PEAK] = max(row[PEAK], d)
            mass[i] += d
            row[X] += d * x
            row[Y] += d * y
            row[XX] += d * x * x
            row[XY] += d * x * y
            row[YY] += d * y * y
    for i in range(total):
        row = table[i]
        if mass[i] > 0:
            for k in range(X, PEAK):
                row[k] /= mass[i]
        row[XX] -= row[X] * row[X]
        row[XY] -= row[X] * row[Y]
        row[YY] -= row[Y] * row[Y]
    return table
