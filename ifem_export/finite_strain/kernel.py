"""Compiled neo-Hookean element forces. Import this module only where they run (numba).

Eight cells are processed at a time, with the cell as the innermost index, so that one vector
instruction serves several cells. Local corners and Gauss points are numbered by bits,
x + 2y + 4z.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

LANES = 8
# VTK_HEXAHEDRON corner of each bit-numbered corner.
_VTK = (0, 1, 3, 2, 4, 5, 7, 6)
# Trilinear interpolation along one axis from two ends to a Gauss point: near and far end.
_NEAR = 0.5 + 0.5 / math.sqrt(3.0)
_FAR = 0.5 - 0.5 / math.sqrt(3.0)


@njit(cache=True, nogil=True, error_model="numpy")
def element_forces(
    hexes: Any,
    displacement: Any,
    cell_size: Any,
    shear: float,
    bulk: float,
    least_j: float,
    forces: Any,
) -> int:
    """Write the corner forces (m, 8, 3) of all cells.

    Returns:
        The first cell with J <= least_j, infinite or NaN at a Gauss point, or -1.
    """
    weight = cell_size[0] * cell_size[1] * cell_size[2] / 8.0
    floor = least_j - 1.0
    u = np.empty((3, 8, LANES))
    # h holds the displacement gradient and then the stress: [3 i + j, Gauss point, cell].
    h = np.empty((9, 8, LANES))
    c = np.empty((9, 8, LANES))
    iso = np.empty((8, LANES))
    dilatation = np.empty((8, LANES))
    mean = np.empty(LANES)
    for first in range(0, len(hexes), LANES):
        used = min(LANES, len(hexes) - first)
        for lane in range(LANES):
            # Spare lanes repeat the last cell; their forces are not stored.
            cell = first + min(lane, used - 1)
            for corner in range(8):
                node = hexes[cell, _VTK[corner]]
                for i in range(3):
                    u[i, corner, lane] = displacement[node, i]
        _gradients(u, cell_size, h)
        _determinants(h, c, dilatation)
        for lane in range(LANES):
            mean[lane] = 0.0
        for g in range(8):
            for lane in range(LANES):
                mean[lane] += 0.125 * dilatation[g, lane]
        for lane in range(used):
            for g in range(8):
                if not floor < dilatation[g, lane] < np.inf:
                    return first + lane
        for g in range(8):
            for lane in range(LANES):
                iso[g, lane] = (1.0 + dilatation[g, lane]) ** (-2.0 / 3.0)
        for lane in range(LANES):
            mean[lane] *= bulk
        _stresses(h, c, dilatation, iso, mean, shear)
        _nodal(h, cell_size, weight, u)
        for lane in range(used):
            cell = first + lane
            for corner in range(8):
                for i in range(3):
                    forces[cell, _VTK[corner], i] = u[i, corner, lane]
    return -1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _gradients(u: Any, cell_size: Any, h: Any) -> None:
    """Displacement gradients: differences along the edges j, interpolated along the other axes."""
    for i in range(3):
        for j in range(3):
            along = 1 << j
            p = 1 << ((j + 1) % 3)
            q = 1 << ((j + 2) % 3)
            near = _NEAR / cell_size[j]
            far = _FAR / cell_size[j]
            for lane in range(LANES):
                d00 = u[i, along, lane] - u[i, 0, lane]
                d10 = u[i, along + p, lane] - u[i, p, lane]
                d01 = u[i, along + q, lane] - u[i, q, lane]
                d11 = u[i, along + p + q, lane] - u[i, p + q, lane]
                e00 = near * d00 + far * d10
                e10 = far * d00 + near * d10
                e01 = near * d01 + far * d11
                e11 = far * d01 + near * d11
                f00 = _NEAR * e00 + _FAR * e01
                f10 = _NEAR * e10 + _FAR * e11
                f01 = _FAR * e00 + _NEAR * e01
                f11 = _FAR * e10 + _NEAR * e11
                h[3 * i + j, 0, lane] = f00
                h[3 * i + j, along, lane] = f00
                h[3 * i + j, p, lane] = f10
                h[3 * i + j, along + p, lane] = f10
                h[3 * i + j, q, lane] = f01
                h[3 * i + j, along + q, lane] = f01
                h[3 * i + j, p + q, lane] = f11
                h[3 * i + j, along + p + q, lane] = f11


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _determinants(h: Any, c: Any, dilatation: Any) -> None:
    """Cofactors of F = 1 + H, and J - 1 computed from H without cancellation."""
    for g in range(8):
        for lane in range(LANES):
            h0, h1, h2 = h[0, g, lane], h[1, g, lane], h[2, g, lane]
            h3, h4, h5 = h[3, g, lane], h[4, g, lane], h[5, g, lane]
            h6, h7, h8 = h[6, g, lane], h[7, g, lane], h[8, g, lane]
            m0 = h4 * h8 - h5 * h7
            m1 = h5 * h6 - h3 * h8
            m2 = h3 * h7 - h4 * h6
            m4 = h0 * h8 - h2 * h6
            m8 = h0 * h4 - h1 * h3
            c[0, g, lane] = 1.0 + h4 + h8 + m0
            c[1, g, lane] = m1 - h3
            c[2, g, lane] = m2 - h6
            c[3, g, lane] = h2 * h7 - h1 * h8 - h1
            c[4, g, lane] = 1.0 + h0 + h8 + m4
            c[5, g, lane] = h1 * h6 - h0 * h7 - h7
            c[6, g, lane] = h1 * h5 - h2 * h4 - h2
            c[7, g, lane] = h2 * h3 - h0 * h5 - h5
            c[8, g, lane] = 1.0 + h0 + h4 + m8
            dilatation[g, lane] = (h0 + h4 + h8) + (m0 + m4 + m8) + (h0 * m0 + h1 * m1 + h2 * m2)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _stresses(h: Any, c: Any, dilatation: Any, iso: Any, pressure: Any, shear: float) -> None:
    """Replace the displacement gradient by the first Piola-Kirchhoff stress."""
    for g in range(8):
        for lane in range(LANES):
            h0, h1, h2 = 1.0 + h[0, g, lane], h[1, g, lane], h[2, g, lane]
            h3, h4, h5 = h[3, g, lane], 1.0 + h[4, g, lane], h[5, g, lane]
            h6, h7, h8 = h[6, g, lane], h[7, g, lane], 1.0 + h[8, g, lane]
            trace = h0 * h0 + h1 * h1 + h2 * h2 + h3 * h3 + h4 * h4
            trace += h5 * h5 + h6 * h6 + h7 * h7 + h8 * h8
            a = shear * iso[g, lane]
            b = pressure[lane] - a * trace / (3.0 * (1.0 + dilatation[g, lane]))
            h[0, g, lane] = a * h0 + b * c[0, g, lane]
            h[1, g, lane] = a * h1 + b * c[1, g, lane]
            h[2, g, lane] = a * h2 + b * c[2, g, lane]
            h[3, g, lane] = a * h3 + b * c[3, g, lane]
            h[4, g, lane] = a * h4 + b * c[4, g, lane]
            h[5, g, lane] = a * h5 + b * c[5, g, lane]
            h[6, g, lane] = a * h6 + b * c[6, g, lane]
            h[7, g, lane] = a * h7 + b * c[7, g, lane]
            h[8, g, lane] = a * h8 + b * c[8, g, lane]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _nodal(h: Any, cell_size: Any, weight: float, f: Any) -> None:
    """Corner forces from stresses by the transpose of `_gradients`."""
    for i in range(3):
        for corner in range(8):
            for lane in range(LANES):
                f[i, corner, lane] = 0.0
        for j in range(3):
            along = 1 << j
            p = 1 << ((j + 1) % 3)
            q = 1 << ((j + 2) % 3)
            near = weight * _NEAR / cell_size[j]
            far = weight * _FAR / cell_size[j]
            for lane in range(LANES):
                f00 = h[3 * i + j, 0, lane] + h[3 * i + j, along, lane]
                f10 = h[3 * i + j, p, lane] + h[3 * i + j, along + p, lane]
                f01 = h[3 * i + j, q, lane] + h[3 * i + j, along + q, lane]
                f11 = h[3 * i + j, p + q, lane] + h[3 * i + j, along + p + q, lane]
                e00 = _NEAR * f00 + _FAR * f01
                e10 = _NEAR * f10 + _FAR * f11
                e01 = _FAR * f00 + _NEAR * f01
                e11 = _FAR * f10 + _NEAR * f11
                d00 = near * e00 + far * e10
                d10 = far * e00 + near * e10
                d01 = near * e01 + far * e11
                d11 = far * e01 + near * e11
                f[i, 0, lane] -= d00
                f[i, along, lane] += d00
                f[i, p, lane] -= d10
                f[i, along + p, lane] += d10
                f[i, q, lane] -= d01
                f[i, along + q, lane] += d01
                f[i, p + q, lane] -= d11
                f[i, along + p + q, lane] += d11


@njit(cache=True, nogil=True)
def gather(starts: Any, entries: Any, forces: Any, total: Any) -> None:
    """Sum the corner forces (8m, 3) at each node, cells in increasing order."""
    for node in range(len(total)):
        x = 0.0
        y = 0.0
        z = 0.0
        for at in range(starts[node], starts[node + 1]):
            entry = entries[at]
            x += forces[entry, 0]
            y += forces[entry, 1]
            z += forces[entry, 2]
        total[node, 0] = x
        total[node, 1] = y
        total[node, 2] = z
