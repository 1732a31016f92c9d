"""Compiled neo-Hookean forces. Import this module only where they run (numba).

Sixteen cells are processed at a time, with the cell as the innermost index, so that one vector
instruction serves several cells; loops over eight cells are unrolled before they are vectorised,
which takes more than twice as long. Local corners and Gauss points are numbered by bits,
x + 2y + 4z. The displacement gradient along an axis is the same at both Gauss points along it, so
that four values serve eight points.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

LANES = 16
# Sums are not reordered.
COMPILED: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz"},
}
# VTK_HEXAHEDRON corner of each bit-numbered corner.
_VTK = (0, 1, 3, 2, 4, 5, 7, 6)
# Trilinear interpolation along one axis from two ends to a Gauss point: near and far end.
_NEAR = 0.5 + 0.5 / math.sqrt(3.0)
_FAR = 0.5 - 0.5 / math.sqrt(3.0)
# J - 1 within which the approximation of `_isochoric` holds.
_LEAST_DILATATION, _MOST_DILATATION = -0.75, 3.0


@njit(cache=True, **COMPILED)
def nodal_forces(
    hexes: Any,
    displacement: Any,
    cell_size: Any,
    shear: float,
    bulk: float,
    least_j: float,
    total: Any,
) -> int:
    """Write the sums (n, 3) of the corner forces of all cells at the nodes, cells in their order.

    Returns:
        The first cell with J <= least_j, infinite or NaN at a Gauss point, or -1.
    """
    weight = cell_size[0] * cell_size[1] * cell_size[2] / 8.0
    floor = least_j - 1.0
    u = np.empty((3, 8, LANES))
    h = np.empty((9, 4, LANES))
    stress = np.empty((9, 4, LANES))
    cofactor = np.empty((8, 9, LANES))
    dilatation, iso = np.empty((8, LANES)), np.empty((8, LANES))
    pressure = np.empty(LANES)
    total[:] = 0.0
    for first in range(0, len(hexes), LANES):
        used = min(LANES, len(hexes) - first)
        for lane in range(LANES):
            # Spare lanes repeat the last cell; their forces are not added.
            cell = first + min(lane, used - 1)
            for corner in range(8):
                node = hexes[cell, _VTK[corner]]
                for i in range(3):
                    u[i, corner, lane] = displacement[node, i]
        _gradients(u, cell_size, h)
        _determinants(h, cofactor, dilatation)
        for lane in range(used):
            for g in range(8):
                if not floor < dilatation[g, lane] < np.inf:
                    return first + lane
        _isochoric(dilatation, iso)
        for lane in range(LANES):
            pressure[lane] = 0.0
        for g in range(8):
            for lane in range(LANES):
                pressure[lane] += 0.125 * bulk * dilatation[g, lane]
        _stresses(h, cofactor, dilatation, iso, pressure, shear, stress)
        _corner_forces(stress, cell_size, weight, u)
        for lane in range(used):
            for corner in range(8):
                node = hexes[first + lane, _VTK[corner]]
                for i in range(3):
                    total[node, i] += u[i, corner, lane]
    return -1


@njit(inline="always", **COMPILED)
def _gradients(u: Any, cell_size: Any, h: Any) -> None:
    """Displacement gradients (9, 4, cells): differences along the edges j, interpolated along the
    other axes. The four are numbered by the bits of these axes, j + 1 + 2 (j + 2)."""
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
                h[3 * i + j, 0, lane] = _NEAR * e00 + _FAR * e01
                h[3 * i + j, 1, lane] = _NEAR * e10 + _FAR * e11
                h[3 * i + j, 2, lane] = _FAR * e00 + _NEAR * e01
                h[3 * i + j, 3, lane] = _FAR * e10 + _NEAR * e11


@njit(inline="always", **COMPILED)
def _beside(g: Any) -> Any:
    """Which of the four gradients along each axis a Gauss point has."""
    x, y, z = g & 1, (g >> 1) & 1, g >> 2
    return y + 2 * z, z + 2 * x, x + 2 * y


@njit(inline="always", **COMPILED)
def _determinants(h: Any, cofactor: Any, dilatation: Any) -> None:
    """Cofactors of F = 1 + H, and J - 1 computed from H without cancellation."""
    for g in range(8):
        x, y, z = _beside(g)
        for lane in range(LANES):
            h0, h1, h2 = h[0, x, lane], h[1, y, lane], h[2, z, lane]
            h3, h4, h5 = h[3, x, lane], h[4, y, lane], h[5, z, lane]
            h6, h7, h8 = h[6, x, lane], h[7, y, lane], h[8, z, lane]
            m0 = h4 * h8 - h5 * h7
            m1 = h5 * h6 - h3 * h8
            m2 = h3 * h7 - h4 * h6
            m4 = h0 * h8 - h2 * h6
            m8 = h0 * h4 - h1 * h3
            cofactor[g, 0, lane] = 1.0 + h4 + h8 + m0
            cofactor[g, 1, lane] = m1 - h3
            cofactor[g, 2, lane] = m2 - h6
            cofactor[g, 3, lane] = h2 * h7 - h1 * h8 - h1
            cofactor[g, 4, lane] = 1.0 + h0 + h8 + m4
            cofactor[g, 5, lane] = h1 * h6 - h0 * h7 - h7
            cofactor[g, 6, lane] = h1 * h5 - h2 * h4 - h2
            cofactor[g, 7, lane] = h2 * h3 - h0 * h5 - h5
            cofactor[g, 8, lane] = 1.0 + h0 + h4 + m8
            dilatation[g, lane] = (h0 + h4 + h8) + (m0 + m4 + m8) + (h0 * m0 + h1 * m1 + h2 * m2)


@njit(inline="always", **COMPILED)
def _isochoric(dilatation: Any, iso: Any) -> None:
    """J^(-2/3), to rounding.

    y = J^(-1/3) starts from the Padé approximant of order 2/2 about J = 1, which is within 0.7 %
    for the dilatations looked at. With r = 1 - J y³ the exact value is y (1 - r)^(-1/3); two steps
    by the first three terms of this series leave 3e-6 and then less than rounding. Vector units
    have no powers.
    """
    far = False
    for g in range(8):
        for lane in range(LANES):
            d = dilatation[g, lane]
            far |= (d < _LEAST_DILATATION) | (d > _MOST_DILATATION)
    for g in range(8):
        if far:
            for lane in range(LANES):
                iso[g, lane] = (1.0 + dilatation[g, lane]) ** (-2.0 / 3.0)
            continue
        for lane in range(LANES):
            d = dilatation[g, lane]
            j = 1.0 + d
            y = (1.0 + d * (5.0 / 6.0 + d * (5.0 / 54.0))) / (
                1.0 + d * (7.0 / 6.0 + d * (7.0 / 27.0))
            )
            r = 1.0 - j * (y * y * y)
            y *= 1.0 + r * (1.0 / 3.0 + r * (2.0 / 9.0))
            r = 1.0 - j * (y * y * y)
            y *= 1.0 + r * (1.0 / 3.0 + r * (2.0 / 9.0))
            iso[g, lane] = y * y


@njit(inline="always", **COMPILED)
def _stresses(
    h: Any, cofactor: Any, dilatation: Any, iso: Any, pressure: Any, shear: float, stress: Any
) -> None:
    """First Piola-Kirchhoff stress (9, 4, cells): sums over both Gauss points along each axis."""
    for entry in range(9):
        for beside in range(4):
            for lane in range(LANES):
                stress[entry, beside, lane] = 0.0
    for g in range(8):
        x, y, z = _beside(g)
        for lane in range(LANES):
            f0, f1, f2 = 1.0 + h[0, x, lane], h[1, y, lane], h[2, z, lane]
            f3, f4, f5 = h[3, x, lane], 1.0 + h[4, y, lane], h[5, z, lane]
            f6, f7, f8 = h[6, x, lane], h[7, y, lane], 1.0 + h[8, z, lane]
            trace = f0 * f0 + f1 * f1 + f2 * f2 + f3 * f3 + f4 * f4
            trace += f5 * f5 + f6 * f6 + f7 * f7 + f8 * f8
            a = shear * iso[g, lane]
            b = pressure[lane] - a * trace / (3.0 * (1.0 + dilatation[g, lane]))
            stress[0, x, lane] += a * f0 + b * cofactor[g, 0, lane]
            stress[1, y, lane] += a * f1 + b * cofactor[g, 1, lane]
            stress[2, z, lane] += a * f2 + b * cofactor[g, 2, lane]
            stress[3, x, lane] += a * f3 + b * cofactor[g, 3, lane]
            stress[4, y, lane] += a * f4 + b * cofactor[g, 4, lane]
            stress[5, z, lane] += a * f5 + b * cofactor[g, 5, lane]
            stress[6, x, lane] += a * f6 + b * cofactor[g, 6, lane]
            stress[7, y, lane] += a * f7 + b * cofactor[g, 7, lane]
            stress[8, z, lane] += a * f8 + b * cofactor[g, 8, lane]


@njit(inline="always", **COMPILED)
def _corner_forces(stress: Any, cell_size: Any, weight: float, f: Any) -> None:
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
                f00, f10 = stress[3 * i + j, 0, lane], stress[3 * i + j, 1, lane]
                f01, f11 = stress[3 * i + j, 2, lane], stress[3 * i + j, 3, lane]
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
