"""Cubic Hermite splines over mesh lines: their values, and integrals of their products.

Each mesh line has two splines: of value 1 and slope 0 there, and of value 0 and slope 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integrals = dict[tuple[int, int], Array]
"""Matrices (n, 2 · lines, 2 · lines) by the derivatives of the two factors."""
POINTS = 4
"""Gauss points along an element: exact for the products of two cubics."""
PAIRS = ((0, 0), (2, 2), (1, 1), (0, 2), (2, 0))


def _hermite(s: Array, length: Array, derivative: int) -> Array:
    """The four cubics of an element (..., 4): value and slope at its start, then at its end."""
    one = np.ones_like(s)
    if derivative == 0:
        values = (
            1 - 3 * s**2 + 2 * s**3,
            length * (s - 2 * s**2 + s**3),
            3 * s**2 - 2 * s**3,
            length * (s**3 - s**2),
        )
    elif derivative == 1:
        slope = (6 * s**2 - 6 * s) / length
        values = (slope, 1 - 4 * s + 3 * s**2, -slope, 3 * s**2 - 2 * s)
    else:
        bend = (12 * s - 6) / length**2
        values = (bend, (6 * s - 4) / length, -bend, (6 * s - 2) / length)
    return np.stack([v * one for v in values], axis=-1)


def splines(lines: Array, points: Array) -> Array:
    """All splines (n, p, 2 · lines) at points (n, p): value and slope at each line."""
    n, p = points.shape
    found = np.zeros((n, p, 2 * lines.shape[1]))
    last = lines.shape[1] - 2
    # Points beyond the plate continue the outermost element.
    element = np.sum(points[:, :, None] >= lines[:, None, 1:-1], axis=2)
    for e in range(last + 1):
        start, length = lines[:, e, None], (lines[:, e + 1] - lines[:, e])[:, None]
        values = _hermite((points - start) / length, np.broadcast_to(length, (n, p)), 0)
        found[:, :, 2 * e : 2 * e + 4] += np.where((element == e)[:, :, None], values, 0.0)
    return found


def integrals(
    lines: Array, low: Array, high: Array, pairs: Sequence[tuple[int, int]] = PAIRS
) -> Integrals:
    """Integrals (n, 2 · lines, 2 · lines) of products of derivatives over intervals."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    n, size = len(lines), 2 * lines.shape[1]
    start, end = lines[:, :-1], lines[:, 1:]
    first, last = np.maximum(low[:, None], start), np.minimum(high[:, None], end)
    half = np.maximum(last - first, 0.0)[..., None] / 2
    length = np.broadcast_to((end - start)[..., None], (*start.shape, POINTS))
    local = (((first + last) / 2)[..., None] + half * nodes - start[..., None]) / length
    values = {k: _hermite(local, length, k) for k in {k for pair in pairs for k in pair}}
    found = {}
    for a, b in pairs:
        blocks = (values[a] * (half * weights)[..., None]).swapaxes(2, 3) @ values[b]
        whole = found[a, b] = np.zeros((n, size, size))
        for e in range(start.shape[1]):
            here = slice(2 * e, 2 * e + 4)
            whole[:, here, here] += blocks[:, e]
    return found


def even(values: Array) -> Array:
    """The splines that are even about the first line: its slope is left out."""
    return np.delete(values, 1, axis=-1)


def even_integrals(
    lines: Array, low: Array, high: Array, pairs: Sequence[tuple[int, int]] = PAIRS
) -> Integrals:
    """As `integrals`, for the even splines."""
    return {
        key: np.delete(even(value), 1, axis=1)
        for key, value in integrals(lines, low, high, pairs).items()
    }
