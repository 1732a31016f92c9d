"""Hex-8 with nine incompatible modes and three enhanced dilatations, statically condensed.

The trilinear strain B u is enriched inside the cell by twelve modes that no neighbour sees:

- nine incompatible displacements, (1-ξ²), (1-η²) and (1-ζ²) in each direction (Wilson, Taylor,
  Doherty & Ghaboussi 1973). They supply the curvature and the Poisson contraction of bending,
  which the trilinear cell answers with parasitic shear;
- three dilatations ξη, ηζ and ζξ, equal in the three normal strains (Simo, Armero & Taylor
  1993, "QM1/E12"). They release the volume constraints that still lock the nine-mode element
  as ν → 0.5.

Every mode has zero mean over a box, so a constant stress does no work on it and the patch test
holds without Taylor's correction. The strain is kept whole: twelve modes under *mean*
dilatation would leave three spurious zero modes. Here the twelve mode strains and the eighteen
straining displacements are linearly independent as polynomials, so the energy of the condensed
element vanishes for the six rigid motions only, whatever the cell's shape, for every
positive-definite D.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ifem_export.elements.kinematics import (
    GAUSS,
    TRACE,
    shape_gradients,
    strain_displacement,
)
from ifem_export.elements.material import Material


def mode_strains(cell_size_mm: Sequence[float], local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Strains of the twelve enriching modes of a box cell.

    Args:
        cell_size_mm: (hx, hy, hz).
        local: (..., 3) points in [-1, 1]³.

    Returns:
        (..., 6, 12): column 3m+i is the strain in 1/mm of (1 - ξ_m²) along i, columns 9 to 11
        the dilatations ηζ, ξζ and ξη, without unit.
    """
    size = np.asarray(cell_size_mm, dtype=float)
    gradients = np.zeros((*local.shape[:-1], 3, 3))
    for m in range(3):
        gradients[..., m, m] = -2.0 * local[..., m] * (2.0 / size[m])
    x, y, z = local[..., 0], local[..., 1], local[..., 2]
    dilatations = TRACE[:, None] * np.stack([y * z, x * z, x * y], axis=-1)[..., None, :]
    return np.concatenate([strain_displacement(gradients), dilatations], axis=-1)


def incompatible_stiffness(
    cell_size_mm: Sequence[float], material: Material
) -> NDArray[np.float64]:
    """Element stiffness with the twelve modes condensed.

    The modes' amplitudes minimise the energy, a least-squares problem in the square root of
    the energy. Solving it by QR keeps rigid motions free to rounding at any ν and cell
    shape, where K_uu - K_ua K_aa⁻¹ K_au cancels.

    Args:
        cell_size_mm: (hx, hy, hz), > 0.
        material: the elastic solid.

    Returns:
        (24, 24) in N/mm, positive semidefinite with six zero eigenvalues; symmetric to rounding.
    """
    volume = float(np.asarray(cell_size_mm, dtype=float).prod())
    compatible = strain_displacement(shape_gradients(cell_size_mm, GAUSS))
    modes = mode_strains(cell_size_mm, GAUSS)
    root = _energy_root(material) * math.sqrt(volume / len(GAUSS))
    whole = (root @ compatible).reshape(-1, 24)
    basis = np.linalg.qr((root @ modes).reshape(-1, 12)).Q
    rest = whole - basis @ (basis.T @ whole)
    # Once more: the first projection leaves rounding of the size of what it took away.
    rest -= basis @ (basis.T @ rest)
    return np.asarray(rest.T @ rest)


def _energy_root(material: Material) -> NDArray[np.float64]:
    """R (7, 6) with Rᵀ R = D; its volumetric row is apart, so that a large κ cancels nothing."""
    root = np.zeros((7, 6))
    root[:6] = np.diag(np.sqrt([2.0, 2.0, 2.0, 1.0, 1.0, 1.0]))
    root[:3, :3] -= math.sqrt(2.0) / 3.0
    root *= math.sqrt(material.shear_modulus_mpa)
    root[6] = math.sqrt(material.bulk_modulus_mpa) * TRACE
    return root
