"""Element stiffness of an 8-node box hexahedron (Hex-8), in three formulations.

Isotropic elasticity splits into a deviatoric and a volumetric part,
K = ∫ Bᵀ D_dev B dV + κ ∫ b bᵀ dV, where the row b of shape-function gradients gives the volume
change. Full integration evaluates both at 2x2x2 Gauss points, which is exact for a box. B-bar
(mean dilatation: Nagtegaal, Parks & Rice 1974; Hughes, The Finite Element Method, §4.5) replaces b
by its element mean, which removes volumetric locking from two layers on.

The incompatible element enriches the trilinear strain B u by twelve modes inside the cell, which
are condensed statically. This removes shear locking in bending as well. The modes are

- nine incompatible displacements, (1-ξ²), (1-η²) and (1-ζ²) in each direction (Wilson, Taylor,
  Doherty & Ghaboussi 1973). They supply the curvature and the Poisson contraction of bending,
  to which the trilinear cell responds with parasitic shear;
- three dilatations ξη, ηζ and ζξ, equal in the three normal strains (Simo, Armero & Taylor
  1993, "QM1/E12"). They release the volume constraints that still lock the nine-mode element
  as ν → 0.5.

The mean of every mode over a box is zero, so a constant stress does no work on it and the patch
test holds without Taylor's correction. The strain is not averaged: with mean dilatation the twelve
modes would leave three spurious zero-energy modes. The twelve mode strains and the eighteen
straining displacements are linearly independent polynomials. Therefore the energy of the
condensed element vanishes for the six rigid motions only, for every cell shape and every positive
definite D.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ifem_export.elements.kinematics import (
    GAUSS,
    TRACE,
    deviatoric_matrix,
    shape_gradients,
    strain_displacement,
)
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import checked_cell_size

Formulation = Literal["full", "bbar", "incompatible"]
FORMULATIONS: tuple[str, ...] = get_args(Formulation)


def hex8_stiffness(
    cell_size_mm: Sequence[float], material: Material, formulation: Formulation
) -> NDArray[np.float64]:
    """Element stiffness matrix of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz), > 0.
        material: The elastic solid.
        formulation: "full" (2x2x2 integration of both parts), "bbar" (mean dilatation) or
            "incompatible" (nine incompatible modes and three enhanced dilatations).

    Returns:
        (24, 24) in N/mm, exactly symmetric, with six zero eigenvalues. Unknown 3a+i is
        displacement i of corner a in VTK_HEXAHEDRON order.

    Raises:
        MeshError: A cell size is not positive, or the formulation is unknown.
    """
    size = checked_cell_size(cell_size_mm)
    if formulation not in FORMULATIONS:
        raise MeshError(
            f"element {formulation!r}: must be one of {', '.join(FORMULATIONS)}",
            field="formulation",
            value=formulation,
        )
    if formulation == "incompatible":
        stiffness = incompatible_stiffness(size, material)
    else:
        stiffness = _split_stiffness(size, material, formulation)
    return np.asarray(0.5 * (stiffness + stiffness.T))


def _split_stiffness(
    size_mm: NDArray[np.float64], material: Material, formulation: Formulation
) -> NDArray[np.float64]:
    weight = float(size_mm.prod()) / len(GAUSS)
    b = strain_displacement(shape_gradients(size_mm, GAUSS))
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


def mode_strains(
    cell_size_mm: Sequence[float] | NDArray[np.float64], local: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Strains of the twelve enriching modes of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz).
        local: (..., 3) points in [-1, 1]³.

    Returns:
        (..., 6, 12): column 3m+i is the strain in 1/mm of (1 - ξ_m²) along i; columns 9 to 11
        are the dilatations ηζ, ξζ and ξη, without unit.
    """
    size = np.asarray(cell_size_mm, dtype=float)
    gradients = np.zeros((*local.shape[:-1], 3, 3))
    for m in range(3):
        gradients[..., m, m] = -2.0 * local[..., m] * (2.0 / size[m])
    x, y, z = local[..., 0], local[..., 1], local[..., 2]
    dilatations = TRACE[:, None] * np.stack([y * z, x * z, x * y], axis=-1)[..., None, :]
    return np.concatenate([strain_displacement(gradients), dilatations], axis=-1)


def incompatible_stiffness(size_mm: NDArray[np.float64], material: Material) -> NDArray[np.float64]:
    """Element stiffness (24, 24) in N/mm with the twelve modes condensed.

    The amplitudes of the modes minimise the energy, which is a least-squares problem in the square
    root of the energy. Its solution by QR leaves rigid motions free of energy to rounding at every
    ν and cell shape, whereas K_uu - K_ua K_aa⁻¹ K_au suffers from cancellation.
    """
    root = _energy_root(material) * math.sqrt(float(size_mm.prod()) / len(GAUSS))
    compatible = strain_displacement(shape_gradients(size_mm, GAUSS))
    trilinear = (root @ compatible).reshape(-1, 24)
    basis = np.linalg.qr((root @ mode_strains(size_mm, GAUSS)).reshape(-1, 12)).Q
    remainder = trilinear - basis @ (basis.T @ trilinear)
    # The first projection leaves rounding errors as large as those of what it removed.
    remainder -= basis @ (basis.T @ remainder)
    return np.asarray(remainder.T @ remainder)


def _energy_root(material: Material) -> NDArray[np.float64]:
    """R (7, 6) with Rᵀ R = D. The volumetric row is separate, so that a large κ cancels nothing."""
    root = np.zeros((7, 6))
    root[:6] = np.diag(np.sqrt([2.0, 2.0, 2.0, 1.0, 1.0, 1.0]))
    root[:3, :3] -= math.sqrt(2.0) / 3.0
    root *= math.sqrt(material.shear_modulus_mpa)
    root[6] = math.sqrt(material.bulk_modulus_mpa) * TRACE
    return root
