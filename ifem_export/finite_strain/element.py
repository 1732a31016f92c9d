"""Neo-Hookean mean-dilatation Hex-8: kinematics and tangent stiffness in NumPy.

Energy per reference volume, with the deformation gradient F, J = det F, C = Fᵀ F and the mean J̄
of J over the element (its volume divided by its volume at rest):

    Ψ = G/2 (J^(-2/3) tr C - 3) + κ/2 (J̄ - 1)².

It is the energy of F̄ = (J̄/J)^(1/3) F (F-bar: Simo, Taylor & Pister 1985; de Souza Neto et al.
1996), because J^(-2/3) tr C is the same for F̄ as for F. The forces are its exact gradient, and
at rest its Hessian is the stiffness of the B-bar element. Stress: first Piola-Kirchhoff,
P = G J^(-2/3) (F - tr C/3 F⁻ᵀ) + κ (J̄ - 1) cof F.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifem_export.elements.kinematics import GAUSS, shape_gradients
from ifem_export.elements.material import Material

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GaussStates:
    """Deformation at the 2x2x2 Gauss points of m cells.

    Attributes:
        gradients: (8, 8, 3) in 1/mm, shape gradients by Gauss point and corner.
        weight_mm3: Volume of each Gauss point.
        deformation: (m, 8, 3, 3) F.
        cofactor: (m, 8, 3, 3) cof F = J F⁻ᵀ.
        dilatation: (m, 8) J - 1, evaluated without cancellation.
    """

    gradients: Array
    weight_mm3: float
    deformation: Array
    cofactor: Array
    dilatation: Array

    @property
    def mean_dilatation(self) -> Array:
        """(m,) J̄ - 1."""
        return np.asarray(self.dilatation.mean(axis=1))


def gauss_states(corners_mm: Array, cell_size_mm: tuple[float, float, float]) -> GaussStates:
    """Kinematics of cells from their corner displacements (m, 8, 3) in mm.

    Displacements beyond the range of floating point give an infinite or NaN dilatation.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _gauss_states(corners_mm, cell_size_mm)


def _gauss_states(corners_mm: Array, cell_size_mm: tuple[float, float, float]) -> GaussStates:
    gradients = shape_gradients(cell_size_mm, GAUSS)
    h = np.einsum("cai,gaj->cgij", corners_mm, gradients)
    f = h + np.eye(3)
    minors = _cofactor(h)
    trace = np.einsum("cgii->cg", h)
    principal = np.einsum("cgii->cg", minors)
    determinant = np.einsum("cgj,cgj->cg", h[..., 0, :], minors[..., 0, :])
    return GaussStates(
        gradients=gradients,
        weight_mm3=float(np.prod(cell_size_mm)) / len(GAUSS),
        deformation=f,
        cofactor=_cofactor(f),
        dilatation=trace + principal + determinant,
    )


def _cofactor(f: Array) -> Array:
    """Cofactors (..., 3, 3): row i is the cross product of the next two rows."""
    return np.stack(
        [np.cross(f[..., (i + 1) % 3, :], f[..., (i + 2) % 3, :]) for i in range(3)], -2
    )


def predicted_pressures(state: GaussStates, material: Material, step_mm: Array) -> Array:
    """First-order pressure κ (J̄ - 1) (m,) in MPa after a step (m, 8, 3) of the cells' corners."""
    gradient = np.einsum("cgij,gaj->cai", state.cofactor, state.gradients) / len(GAUSS)
    dilatation = state.mean_dilatation + (gradient * step_mm).sum(axis=(1, 2))
    return np.asarray(material.bulk_modulus_mpa * dilatation)


def element_tangents(
    state: GaussStates, material: Material, pressure_mpa: Array | None = None
) -> Array:
    """Tangent stiffness (m, 24, 24) in N/mm, the Hessian of the cells' energy Ψ.

    `pressure_mpa` (m,) replaces the cells' own κ (J̄ - 1) in the geometric stiffness.

    With T = F⁻ᵀ, ∂P_iJ/∂F_kL = G J^(-2/3) (δ_ik δ_JL - 2/3 F_iJ T_kL - 2/3 T_iJ F_kL
    + 2/9 tr C T_iJ T_kL + 1/3 tr C T_iL T_kJ) + p J (T_iJ T_kL - T_iL T_kJ) at constant
    p = κ (J̄ - 1); the change of p adds κ/V times the outer product of ∂(volume)/∂u.
    """
    j = 1.0 + state.dilatation
    a = material.shear_modulus_mpa * j ** (-2.0 / 3.0)
    trace = _trace_c(state)
    own = material.bulk_modulus_mpa * state.mean_dilatation
    bulk_part = (own if pressure_mpa is None else pressure_mpa)[:, None] * j
    # Gradients in the deformed configuration, T ∇N, and F ∇N: both (m, 8 points, 8 corners, 3).
    inverse_t = state.cofactor / j[..., None, None]
    t = np.einsum("cgij,gaj->cgai", inverse_t, state.gradients)
    f = np.einsum("cgij,gaj->cgai", state.deformation, state.gradients)
    cross = np.einsum("cg,cgai,cgbk->caibk", -2.0 / 3.0 * a, f, t, optimize=True)
    total = cross + cross.transpose(0, 3, 4, 1, 2)
    both = 2.0 / 9.0 * a * trace + bulk_part
    total += np.einsum("cg,cgai,cgbk->caibk", both, t, t, optimize=True)
    swapped = a * trace / 3.0 - bulk_part
    total += np.einsum("cg,cgak,cgbi->caibk", swapped, t, t, optimize=True)
    spring = np.einsum("cg,gaj,gbj->cab", a, state.gradients, state.gradients, optimize=True)
    total += np.einsum("cab,ik->caibk", spring, np.eye(3))
    total *= state.weight_mm3
    swelling = state.weight_mm3 * np.einsum("cg,cgai->cai", j, t)
    volume = state.weight_mm3 * len(GAUSS)
    total += material.bulk_modulus_mpa / volume * np.einsum("cai,cbk->caibk", swelling, swelling)
    tangent = total.reshape(-1, 24, 24)
    return np.asarray(0.5 * (tangent + tangent.transpose(0, 2, 1)))


def _trace_c(state: GaussStates) -> Array:
    return np.asarray(np.einsum("cgij,cgij->cg", state.deformation, state.deformation))
