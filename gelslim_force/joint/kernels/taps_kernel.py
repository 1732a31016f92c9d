"""Compiled interpolation on a lattice of nodes. Import this module only where it runs (numba)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_TAPS = 4


@njit(**COMPILED)
def cubic(t: Any, weight: Any, steep: Any) -> None:
    """Weights (4,) of cubic convolution at the fraction t of a cell, and their derivatives."""
    weight[0] = -0.5 * t + t * t - 0.5 * t * t * t
    weight[1] = 1 - 2.5 * t * t + 1.5 * t * t * t
    weight[2] = 0.5 * t + 2 * t * t - 1.5 * t * t * t
    weight[3] = -0.5 * t * t + 0.5 * t * t * t
    steep[0] = -0.5 + 2 * t - 1.5 * t * t
    steep[1] = -5 * t + 4.5 * t * t
    steep[2] = 0.5 + 4 * t - 4.5 * t * t
    steep[3] = -t + 1.5 * t * t


@njit(**COMPILED)
def blurred_cubic(t: Any, blur: Any, weight: Any, steep: Any) -> None:
    """`cubic` of the mean over a blur, whose variance is 2 `blur` squared steps: f + blur f″.

    The second derivative is linear between the second differences at the nodes.
    """
    cubic(t, weight, steep)
    weight[0] += blur * (1 - t)
    weight[1] += blur * (3 * t - 2)
    weight[2] += blur * (1 - 3 * t)
    weight[3] += blur * t
    steep[0] -= blur
    steep[1] += 3 * blur
    steep[2] -= 3 * blur
    steep[3] += blur


@njit(**COMPILED)
def _taps_of_point(
    k: Any, at: Any, stride: Any, step: Any, blur: Any, number: Any, by_x: Any, steep_x: Any,
    by_y: Any, steep_y: Any, nodes: Any, along: Any, across: Any,
) -> None:  # fmt: skip
    """The taps of point k by every node of a lattice, or every `stride`-th one.

    Arguments as in `cubic_taps`; the weights by x and y and their derivatives (4,) are overwritten.
    """
    rows, columns = number.shape
    x, y = at[k, 0] / stride, at[k, 1] / stride
    i = min(max(int(np.floor(x)), 0), (rows - 1) // stride - 1)
    j = min(max(int(np.floor(y)), 0), (columns - 1) // stride - 1)
    blurred_cubic(x - i, blur[0] / stride**2, by_x, steep_x)
    blurred_cubic(y - j, blur[1] / stride**2, by_y, steep_y)
    for a in range(_TAPS):
        row = min(max(stride * (i + a - 1), 0), rows - 1)
        for b in range(_TAPS):
            node = number[row, min(max(stride * (j + b - 1), 0), columns - 1)]
            tap = _TAPS * a + b
            held = 1.0 if node >= 0 else 0.0
            nodes[k, tap] = max(node, 0)
            along[k, tap] = held * steep_x[a] * by_y[b] / (stride * step[0])
            across[k, tap] = held * by_x[a] * steep_y[b] / (stride * step[1])


@njit(**COMPILED)
def cubic_taps(
    at: Any, step: Any, blur: Any, number: Any, nodes: Any, along: Any, across: Any
) -> None:
    """Nodes (n, 16), and weights (n, 16) of slopes along x and y, of cubic convolution.

    Args:
        at: (n, 2) in steps of the lattice.
        step: (2,) of the lattice.
        blur: (2,) half the variance of the blur in squared steps.
        number: (nx, ny) number of the node at each place; -1 where there is none.
        nodes: Receives the nodes.
        along: Receives the weights along x; 0 where there is no node.
        across: Receives those along y.
    """
    by_x, steep_x = np.empty(_TAPS), np.empty(_TAPS)
    by_y, steep_y = np.empty(_TAPS), np.empty(_TAPS)
    for k in range(len(at)):
        _taps_of_point(
            k, at, 1, step, blur, number, by_x, steep_x, by_y, steep_y, nodes, along, across
        )


@njit(**COMPILED)
def taps_of_two_pitches(
    at: Any, step: Any, blur: Any, number: Any, close: Any, nodes: Any, along: Any, across: Any
) -> None:
    """Places (n, 16), and weights (n, 16) of slopes along x and y, of cubic convolution.

    The interpolation uses all places of a finer lattice about the places marked in `close`, and
    only every other place elsewhere.

    Args:
        at: (n, 2) in steps of the finer lattice.
        step: (2,) of the finer lattice.
        blur: (2,) half the variance of the blur in its squared steps.
        number: (nx, ny) number of each place; -1 where there is none.
        close: (nx, ny) places of the lattice of every other place, about which all are used.
        nodes: Receives the places.
        along: Receives the weights along x; 0 where there is no place.
        across: Receives those along y.
    """
    by_x, steep_x = np.empty(_TAPS), np.empty(_TAPS)
    by_y, steep_y = np.empty(_TAPS), np.empty(_TAPS)
    for k in range(len(at)):
        row = min(max(round(at[k, 0] / 2), 0), close.shape[0] - 1)
        column = min(max(round(at[k, 1] / 2), 0), close.shape[1] - 1)
        stride = 1 if close[row, column] else 2
        _taps_of_point(
            k, at, stride, step, blur, number, by_x, steep_x, by_y, steep_y, nodes, along, across
        )


@njit(**COMPILED)
def bilinear(at: Any, number: Any, values: Any, found: Any) -> None:
    """Bilinear interpolation of nodal values.

    Args:
        at: (n, 2) in steps of the lattice; beyond it the values at its edge are taken.
        number: (nx, ny) number of the node at each place; -1 where there is none, which counts as
            the value 0.
        values: (c, k).
        found: Receives (n, k).
    """
    rows, columns = number.shape
    for k in range(len(at)):
        i = min(max(int(np.floor(at[k, 0])), 0), rows - 2)
        j = min(max(int(np.floor(at[k, 1])), 0), columns - 2)
        u = min(max(at[k, 0] - i, 0.0), 1.0)
        v = min(max(at[k, 1] - j, 0.0), 1.0)
        for column in range(values.shape[1]):
            found[k, column] = 0.0
        for di in range(2):
            for dj in range(2):
                node = number[i + di, j + dj]
                weight = (u if di else 1 - u) * (v if dj else 1 - v)
                if node >= 0:
                    for column in range(values.shape[1]):
                        found[k, column] += weight * values[node, column]
