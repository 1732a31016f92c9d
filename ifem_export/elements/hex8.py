"""Element stiffness of an 8-node box hexahedron (Hex-8).

Isotropic elasticity splits into a deviatoric and a volumetric part,
K = ∫ Bᵀ D_dev B dV + κ ∫ b bᵀ dV, with b the row of shape-function gradients that gives the
volume change. Full integration evaluates both at 2x2x2 Gauss points, exact for a box. B-bar
(mean dilatation: Nagtegaal, Parks & Rice 1974; Hughes, The Finite Element Method, §4.5)
replaces b by its element mean, which removes volumetric locking from two layers on. The
incompatible-mode element (`element_incompatible`) enriches the strain inside the cell, which
removes shear locking in bending as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ifem_export.elements.incompatible import incompatible_stiffness
from ifem_export.elements.kinematics import (
    GAUSS,
    TRACE,
    deviatoric_matrix,
    elasticity_matrix,
    shape_gradients,
    strain_displacement,
)
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError

__all__ = [
    "FORMULATIONS",
    "Formulation",
    "elasticity_matrix",
    "hex8_stiffness",
    "shape_gradients",
    "strain_displacement",
]

Formulation = Literal["full", "bbar", "incompatible"]
FORMULATIONS: tuple[str, ...] = get_args(Formulation)


def hex8_stiffness(
    cell_size_mm: Sequence[float], material: Material, formulation: Formulation
) -> NDArray[np.float64]:
    """Element stiffness matrix of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz), > 0.
        material: the elastic solid.
        formulation: "full" (2x2x2 integration throughout), "bbar" (mean dilatation) or
            "incompatible" (nine incompatible modes and three enhanced dilatations).

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
    if formulation == "incompatible":
        stiffness = incompatible_stiffness(cell_size_mm, material)
    else:
        stiffness = _split_stiffness(cell_size_mm, material, formulation)
    return np.asarray(0.5 * (stiffness + stiffness.T))


def _split_stiffness(
    cell_size_mm: Sequence[float], material: Material, formulation: Formulation
) -> NDArray[np.float64]:
    weight = float(np.asarray(cell_size_mm, dtype=float).prod()) / len(GAUSS)
    b = strain_displacement(shape_gradients(cell_size_mm, GAUSS))
    stiffness = weight * np.einsum("gri,rs,gsj->ij", b, deviatoric_matrix(material), b)
    dilatation = TRACE @ b
    stiffness += material.bulk_modulus_mpa * weight * _volumetric(dilatation, formulation)
    return np.asarray(stiffness)


def _volumetric(dilatation: NDArray[Any], formulation: Formulation) -> NDArray[Any]:
    """Sum over Gauss points of b bᵀ, (24, 24) in 1/mm², from rows b (8, 24)."""
    if formulation == "bbar":
        mean = dilatation.mean(axis=0)
        return np.asarray(len(dilatation) * np.outer(mean, mean))
    return np.asarray(dilatation.T @ dilatation)
