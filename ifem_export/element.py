"""Element stiffness of an 8-node box hexahedron (Hex-8).

Isotropic elasticity splits into a deviatoric and a volumetric part,
K = ∫ Bᵀ D_dev B dV + κ ∫ b bᵀ dV, with b the row of shape-function gradients that gives the
volume change. Full integration evaluates both at 2x2x2 Gauss points, exact for a box. B-bar
(mean dilatation: Nagtegaal, Parks & Rice 1974; Hughes, The Finite Element Method, §4.5)
replaces b by its element mean, which removes volumetric locking from two layers on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import MeshError
from ifem_export.lattice import VTK_CORNERS
from ifem_export.material import Material

Formulation = Literal["full", "bbar"]
FORMULATIONS: tuple[str, ...] = get_args(Formulation)

_SIGNS = (2.0 * VTK_CORNERS - 1.0).astype(np.float64)
_GAUSS = (_SIGNS / math.sqrt(3.0)).astype(np.float64)


def shape_gradients(
    cell_size_mm: Sequence[float], local: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Gradients of the trilinear shape functions of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz).
        local: (..., 3) points in [-1, 1]³.

    Returns:
        (..., 8, 3) in 1/mm, ∂N_a/∂x_i.
    """
    size = np.asarray(cell_size_mm, dtype=float)
    factors = 1.0 + local[..., None, :] * _SIGNS
    x, y, z = factors[..., 0], factors[..., 1], factors[..., 2]
    along = np.stack([y * z, x * z, x * y], axis=-1)
    return np.asarray(_SIGNS * along / 8.0 * (2.0 / size))


def strain_displacement(gradients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Strain-displacement matrix B from shape gradients.

    Args:
        gradients: (..., 8, 3).

    Returns:
        (..., 6, 24), rows ε_xx, ε_yy, ε_zz, γ_yz, γ_xz, γ_xy; column 3a+i is displacement i of
        corner a.
    """
    b = np.zeros((*gradients.shape[:-2], 6, 8, 3))
    for i in range(3):
        b[..., i, :, i] = gradients[..., i]
    for row, (i, j) in enumerate(((1, 2), (0, 2), (0, 1)), start=3):
        b[..., row, :, i] = gradients[..., j]
        b[..., row, :, j] = gradients[..., i]
    return b.reshape(*gradients.shape[:-2], 6, 24)


def elasticity_matrix(material: Material) -> NDArray[np.float64]:
    """6x6 matrix D in MPa, stress = D strain in the order of `strain_displacement`."""
    return _deviatoric(material) + material.bulk_modulus_mpa * np.outer(_TRACE, _TRACE)


_TRACE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def _deviatoric(material: Material) -> NDArray[np.float64]:
    g = material.shear_modulus_mpa
    return np.asarray(
        g * (np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0]) - 2.0 / 3.0 * np.outer(_TRACE, _TRACE))
    )


def hex8_stiffness(
    cell_size_mm: Sequence[float], material: Material, formulation: Formulation
) -> NDArray[np.float64]:
    """Element stiffness matrix of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz), > 0.
        material: the elastic solid.
        formulation: "full" (2x2x2 integration throughout) or "bbar" (mean dilatation).

    Returns:
        (24, 24) in N/mm, symmetric to the bit, six zero eigenvalues; unknown 3a+i is
        displacement i of corner a in VTK_HEXAHEDRON order.

    Raises:
        MeshError: a cell size is not positive, or the formulation is unknown.
    """
    size = np.asarray(cell_size_mm, dtype=float)
    if size.shape != (3,) or not np.isfinite(size).all() or (size <= 0.0).any():
        raise MeshError(f"cell_size_mm = {tuple(cell_size_mm)}: must be three numbers > 0")
    if formulation not in FORMULATIONS:
        raise MeshError(f"element {formulation!r}: must be one of {', '.join(FORMULATIONS)}")
    weight = float(size.prod()) / 8.0
    b = strain_displacement(shape_gradients(cell_size_mm, _GAUSS))
    stiffness = weight * np.einsum("gri,rs,gsj->ij", b, _deviatoric(material), b)
    dilatation = _TRACE @ b
    stiffness += material.bulk_modulus_mpa * weight * _volumetric(dilatation, formulation)
    return np.asarray(0.5 * (stiffness + stiffness.T))


def _volumetric(dilatation: NDArray[Any], formulation: Formulation) -> NDArray[Any]:
    """Sum over Gauss points of b bᵀ, (24, 24) in 1/mm², from rows b (8, 24)."""
    if formulation == "bbar":
        mean = dilatation.mean(axis=0)
        return np.asarray(len(dilatation) * np.outer(mean, mean))
    return np.asarray(dilatation.T @ dilatation)
