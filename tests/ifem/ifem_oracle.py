"""Slow obvious truths for the tests: triplet assembly, random crops, rigid modes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ifem_export.mesh.pad_mesh import PadMesh


def triplet_assembly(mesh: PadMesh, element_matrix: np.ndarray) -> sparse.csr_array:
    """K by the textbook: one triplet per element entry, duplicates summed by SciPy."""
    unknowns = (3 * mesh.hexes.astype(np.int64)[:, :, None] + np.arange(3)).reshape(-1, 24)
    rows = np.repeat(unknowns, 24, axis=1).ravel()
    columns = np.tile(unknowns, (1, 24)).ravel()
    values = np.tile(element_matrix.ravel(), len(unknowns))
    n = 3 * mesh.n_nodes
    return sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()


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
