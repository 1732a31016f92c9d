"""What a mesh leaves out of the motion near a force, and what a pad without edges moves.

A pad that gives the truth is finer than the one that is tested, and still too soft near a force: by
1 to 2 % of a contact's depth. An endless layer, solved without cells along the plane, is not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from layer_waves import hat_response
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from ifem_export.compliance.node_convolution import LatticeKernel
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.layer_elimination import layer_elimination

Array = NDArray[np.float64]
_PERIOD, _NEAR = 128, 40
"""Nodes after which endless layers repeat, and those about a force where they are compared."""


@dataclass(frozen=True, eq=False)
class NearForces:
    """Of a pad with n surface nodes, of uniform thickness.

    Attributes:
        mesh: The pad.
        gel: Its material.
    """

    mesh: PadMesh
    gel: Material

    def missing(self, force_n: Array) -> Array:
        """What the mesh leaves out of the motion (n, 3) under forces (n, 3).

        Each force is a traction that falls to zero at the next nodes.
        """
        return self._convolved(self._beyond_mesh, force_n)

    def endless(self, force_n: Array) -> Array:
        """Motion (n, 3) under forces (n, 3) of the same mesh without edges."""
        reach = int(self._place.max())
        near = np.arange(-reach, reach + 1)
        return self._convolved(self._endless_mesh[np.ix_(near, near)], force_n)

    @cached_property
    def _place(self) -> NDArray[np.intp]:
        """(n, 2) column and row of the nodes."""
        points, step = np.asarray(self.mesh.surface_mm)[:, :2], np.array(self.mesh.cell_size_mm[:2])
        return np.rint((points - points.min(axis=0)) / step).astype(np.intp)

    def _convolved(self, response: Array, force_n: Array) -> Array:
        """Motion (n, 3) by responses (2m + 1, 2m + 1, 3, 3) about each force (n, 3)."""
        columns, rows = self._place.T
        load = np.zeros((rows.max() + 1, columns.max() + 1, 3))
        load[rows, columns] = force_n
        found = np.zeros_like(load)
        for i, j in product(range(3), np.flatnonzero(force_n.any(axis=0))):
            whole = fftconvolve(load[..., j], response[..., i, j])
            edge = len(response) // 2
            found[..., i] += whole[edge : edge + len(load), edge : edge + load.shape[1]]
        return found[rows, columns]

    @cached_property
    def _endless_mesh(self) -> Array:
        """(rows, columns, 3, 3) motion of the endless mesh by a force on the first node."""
        element = hex8_stiffness(self.mesh.cell_size_mm, self.gel, "bbar")
        last = np.array([[_PERIOD - 1, _PERIOD - 1]])
        layer = layer_elimination(element, self.mesh.layers, last, (0, 0))
        return LatticeKernel(layer.surface_compliance.blocks, layer.shape).response

    @cached_property
    def _beyond_mesh(self) -> Array:
        """(2m + 1, 2m + 1, 3, 3) motion about a force, by rows and columns, less that of a mesh."""
        gel, (x, y, z) = self.gel, self.mesh.cell_size_mm
        law = gel.youngs_modulus_mpa, gel.poissons_ratio
        layer = hat_response(_PERIOD, (x, y), self.mesh.layers * z, law)
        near = np.arange(-_NEAR, _NEAR + 1)
        return np.asarray((layer - self._endless_mesh)[np.ix_(near, near)])
