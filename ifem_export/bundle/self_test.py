"""A displacement and its forces, by which whoever reads a bundle checks the stiffness it has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
_SEED = 20190521
_AMPLITUDE_MM = 0.1


@dataclass(frozen=True, eq=False)
class SelfTest:
    """A displacement and its nodal forces F = K u, checked whenever the bundle is loaded.

    Attributes:
        displacement_mm: (n, 3).
        force_n: (n, 3).
    """

    displacement_mm: Array
    force_n: Array

    @classmethod
    def drawn(cls, mesh: PadMesh, element_matrix: Array) -> SelfTest:
        """One with random motions of the free nodes, always the same; bonded nodes stay."""
        moved = np.random.default_rng(_SEED).uniform(
            -_AMPLITUDE_MM, _AMPLITUDE_MM, (mesh.n_nodes, 3)
        )
        moved[mesh.bonded] = 0.0
        return cls(moved, elementwise_force(mesh, element_matrix, moved))

    def on(self, mesh: PadMesh, element_matrix: Array) -> SelfTest:
        """The same displacement with the forces on cells of another gel."""
        moved = np.asarray(self.displacement_mm)
        return SelfTest(moved, elementwise_force(mesh, element_matrix, moved))


def elementwise_force(
    mesh: PadMesh, element_matrix: NDArray[np.float64], displacement_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """F = K u (n, 3) in N summed over the elements: an independent check of the assembled K."""
    per_element = displacement_mm[mesh.hexes].reshape(-1, 24) @ element_matrix
    if mesh.fill is not None:
        # Cells are numbered x fastest, z slowest.
        cells = np.asarray(mesh.fill).transpose(2, 1, 0)
        per_element *= cells[np.asarray(mesh.occupancy).transpose(2, 1, 0)][:, None]
    nodes = np.asarray(mesh.hexes).reshape(-1)
    components = per_element.reshape(-1, 3)
    return np.stack(
        [np.bincount(nodes, weights=components[:, i], minlength=mesh.n_nodes) for i in range(3)],
        axis=1,
    )
