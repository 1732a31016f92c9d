"""Slow obvious truths for the tests: triplet assembly, random crops, rigid modes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ifem_export.elements.material import Material
from ifem_export.finite_strain.element import GaussStates, gauss_states
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
from ifem_export.mesh.pad_mesh import PadMesh


def triplet_assembly(mesh: PadMesh, element_matrix: np.ndarray) -> sparse.csr_array:
    """K by the textbook: one triplet per element entry, duplicates summed by SciPy."""
    unknowns = (3 * mesh.hexes.astype(np.int64)[:, :, None] + np.arange(3)).reshape(-1, 24)
    rows = np.repeat(unknowns, 24, axis=1).ravel()
    columns = np.tile(unknowns, (1, 24)).ravel()
    values = np.tile(element_matrix.ravel(), len(unknowns))
    n = 3 * mesh.n_nodes
    return sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()


def elasticity_matrix(material: Material) -> np.ndarray:
    """D (6, 6) in MPa of Hooke's law, with engineering shear strains."""
    d = material.shear_modulus_mpa * np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    d[:3, :3] += material.lame_lambda_mpa
    return d


def random_occupancy(seed: int, shape=(5, 4, 3), fill: float = 0.6) -> np.ndarray:
    occupancy = np.random.default_rng(seed).random(shape) < fill
    occupancy[0, 0, 0] = True
    return occupancy


def rigid_modes(nodes: np.ndarray) -> np.ndarray:
    """(3n, 6) three translations and three infinitesimal rotations."""
    modes = []
    for i in range(3):
        modes.append(np.broadcast_to(np.eye(3)[i], nodes.shape).ravel())
        modes.append(np.cross(np.eye(3)[i], nodes).ravel())
    return np.stack(modes, axis=1)


def _states(pad: NeoHookeanPad, u: np.ndarray) -> tuple[GaussStates, np.ndarray]:
    states = gauss_states(u[pad.mesh.hexes], pad.mesh.cell_size_mm)
    return states, np.einsum("cgij,cgij->cg", states.deformation, states.deformation)


def neo_hookean_energy(pad: NeoHookeanPad, u: np.ndarray) -> float:
    """Strain energy in N mm by the definition: Ψ = G/2 (J^(-2/3) tr C - 3) + κ/2 (J̄ - 1)²."""
    states, trace = _states(pad, u)
    shear, bulk = pad.material.shear_modulus_mpa, pad.material.bulk_modulus_mpa
    isochoric = ((1.0 + states.dilatation) ** (-2.0 / 3.0) * trace - 3.0).sum()
    volumetric = 8 * (states.mean_dilatation**2).sum()
    return float(states.weight_mm3 * 0.5 * (shear * isochoric + bulk * volumetric))


def neo_hookean_force(pad: NeoHookeanPad, u: np.ndarray) -> np.ndarray:
    """Nodal forces (n, 3) in N from the first Piola-Kirchhoff stress, in plain NumPy."""
    states, trace = _states(pad, u)
    j = 1.0 + states.dilatation
    a = pad.material.shear_modulus_mpa * j ** (-2.0 / 3.0)
    b = (pad.material.bulk_modulus_mpa * states.mean_dilatation)[:, None] - a * trace / (3.0 * j)
    stress = a[..., None, None] * states.deformation + b[..., None, None] * states.cofactor
    corners = states.weight_mm3 * np.einsum("cgij,gaj->cai", stress, states.gradients)
    force = np.zeros((pad.mesh.n_nodes, 3))
    np.add.at(force, pad.mesh.hexes.ravel(), corners.reshape(-1, 3))
    return force
