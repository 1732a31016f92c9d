"""Shape gradients, strain-displacement matrix and elasticity matrix of a box Hex-8 cell."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ifem_export.elements.material import Material
from ifem_export.mesh.lattice import VTK_CORNERS

# Corner signs (8, 3) in VTK_HEXAHEDRON order, and the 2x2x2 Gauss points in the same order.
SIGNS = (2.0 * VTK_CORNERS - 1.0).astype(np.float64)
GAUSS = (SIGNS / math.sqrt(3.0)).astype(np.float64)
# This row times a strain is its volume change, in the order of `strain_displacement`.
TRACE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def shape_gradients(
    cell_size_mm: Sequence[float] | NDArray[np.float64], local: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Gradients of the trilinear shape functions of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz).
        local: (..., 3) points in [-1, 1]³.

    Returns:
        (..., 8, 3) in 1/mm, ∂N_a/∂x_i.
    """
    size = np.asarray(cell_size_mm, dtype=float)
    factors = 1.0 + local[..., None, :] * SIGNS
    x, y, z = factors[..., 0], factors[..., 1], factors[..., 2]
    transverse = np.stack([y * z, x * z, x * y], axis=-1)
    return np.asarray(SIGNS * transverse / 8.0 * (2.0 / size))


def strain_displacement(gradients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Strain-displacement matrix B from shape gradients.

    Args:
        gradients: (..., n, 3) of n shape functions, 8 for a Hex-8 cell.

    Returns:
        (..., 6, 3n), rows ε_xx, ε_yy, ε_zz, γ_yz, γ_xz, γ_xy; column 3a+i is displacement i of
        shape function a.
    """
    n = gradients.shape[-2]
    b = np.zeros((*gradients.shape[:-2], 6, n, 3))
    for i in range(3):
        b[..., i, :, i] = gradients[..., i]
    for row, (i, j) in enumerate(((1, 2), (0, 2), (0, 1)), start=3):
        b[..., row, :, i] = gradients[..., j]
        b[..., row, :, j] = gradients[..., i]
    return b.reshape(*gradients.shape[:-2], 6, 3 * n)


def deviatoric_matrix(material: Material) -> NDArray[np.float64]:
    """Deviatoric part of D, (6, 6) in MPa, which a pure volume change does not affect."""
    g = material.shear_modulus_mpa
    return np.asarray(
        g * (np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0]) - 2.0 / 3.0 * np.outer(TRACE, TRACE))
    )
