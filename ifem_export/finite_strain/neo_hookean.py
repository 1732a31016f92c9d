"""Internal force of a neo-Hookean pad at large deformation (F-bar Hex-8).

For the energy and the element see `ifem_export.finite_strain.element`. All free nodes of a
one-layer pad lie on the surface, so one evaluation gives its contact forces. With more layers,
Newton's method uses the tangent to find the inner nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.assembly.assembly import block_pattern
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError, MeshError
from ifem_export.finite_strain import element
from ifem_export.mesh.lattice import zyx
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
# Cells per tangent batch, which keeps the intermediate arrays at tens of megabytes.
_BATCH = 1024
# A completely flattened cell has a J that differs from 0 by rounding only.
LEAST_J = 1e-12


class FiniteStrainError(IfemError):
    """A displacement that no continuous deformation of the pad can produce.

    Attributes:
        cell: Lattice position (i, j, k) of the first inverted cell, or None.
        volume_ratio: Smallest volume ratio J in this cell, or None.
    """

    def __init__(
        self,
        message: str,
        cell: tuple[int, int, int] | None = None,
        volume_ratio: float | None = None,
        **data: Any,
    ) -> None:
        super().__init__(message, **data)
        self.cell = cell
        self.volume_ratio = volume_ratio


@dataclass(frozen=True, eq=False)
class NeoHookeanPad:
    """A flat pad of equal cells of a compressible neo-Hookean solid.

    Attributes:
        mesh: The pad, flat and without cut cells.
        material: Young's modulus and Poisson's ratio of the neo-Hookean law at rest.

    Raises:
        MeshError: The pad is crowned or has cut cells.
    """

    mesh: PadMesh
    material: Material

    def __post_init__(self) -> None:
        if self.mesh.fill is not None or self.mesh.surface_shift is not None:
            raise MeshError(
                "the finite-strain law needs a flat pad without cut cells: mesh with "
                "weighting 'cell_centre' and no crown",
                field="mesh",
            )

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return self.mesh.n_nodes

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Nodal forces that hold the pad in a displacement: the gradient of its strain energy.

        Args:
            displacement_mm: (n, 3), in the node order of `PadMesh`.

        Returns:
            (n, 3) in N; positive components pull the node along the axis.

        Raises:
            FiniteStrainError: The shape is wrong, a value is not finite, or J <= 0 at a Gauss
                point of a cell.
        """
        from ifem_export.finite_strain import kernel

        u = self._checked(displacement_mm)
        hexes, total = self.mesh.hexes, np.empty((self.n_nodes, 3))
        size = np.array(self.mesh.cell_size_mm)
        g, bulk = self.material.shear_modulus_mpa, self.material.bulk_modulus_mpa
        cell = int(kernel.nodal_forces(hexes, u, size, g, bulk, LEAST_J, total))
        if cell >= 0:
            states = element.gauss_states(u[hexes[cell : cell + 1]], self.mesh.cell_size_mm)
            raise self._inversion(cell, states.dilatation[0])
        return total

    def predicted_pressure_mpa(self, displacement_mm: ArrayLike, step_mm: Array) -> Array:
        """Mean pressure (m,) of the cells after a step (n, 3), to first order in the step.

        It is positive in cells that have expanded, and for a step of 0 it is the pressure in
        `force`. Raises as `force`.
        """
        states = self._states(self._checked(displacement_mm))
        return element.predicted_pressures(
            states, self.material, np.asarray(step_mm)[self.mesh.hexes]
        )

    def tangent(
        self, displacement_mm: ArrayLike, pressure_mpa: Array | None = None
    ) -> sparse.bsr_array:
        """Tangent stiffness ∂force/∂u as (3n, 3n) BSR in N/mm, symmetric to the bit.

        At rest it is the stiffness of the "bbar" element. `pressure_mpa` (m,) replaces the
        pressure of the cells in the geometric stiffness. Away from equilibrium the pressure in a
        nearly incompressible gel is mostly error. With the pressure that the last step predicted,
        Newton's method converges to the same solution in far fewer steps (Magisano, Leonetti and
        Garcea 2017). Raises as `force`.
        """
        u = self._checked(displacement_mm)
        indptr, indices, gather = self._blocks
        corners = u[self.mesh.hexes]
        blocks = np.empty((len(corners), 8, 8, 3, 3))
        for start in range(0, len(corners), _BATCH):
            part = corners[start : start + _BATCH]
            states = element.gauss_states(part, self.mesh.cell_size_mm)
            self._check_inversion(states.dilatation, start)
            given = None if pressure_mpa is None else pressure_mpa[start : start + _BATCH]
            matrices = element.element_tangents(states, self.material, given)
            split = matrices.reshape(-1, 8, 3, 8, 3).transpose(0, 1, 3, 2, 4)
            blocks[start : start + _BATCH] = split
        data = gather @ blocks.reshape(-1, 9)
        shape = (3 * self.n_nodes, 3 * self.n_nodes)
        tangent = sparse.bsr_array((data.reshape(-1, 3, 3), indices, indptr), shape=shape)
        tangent.has_sorted_indices = True
        return tangent

    def _checked(self, displacement_mm: ArrayLike) -> Array:
        try:
            u = np.ascontiguousarray(displacement_mm, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FiniteStrainError(
                f"displacement_mm: must be numbers, {error}", field="displacement_mm"
            ) from None
        if u.shape != (self.n_nodes, 3):
            raise FiniteStrainError(
                f"displacement_mm has shape {u.shape}: must be ({self.n_nodes}, 3), a row per node",
                field="displacement_mm",
                value=u.shape,
            )
        if not np.isfinite(u).all():
            node = int(np.flatnonzero(~np.isfinite(u).all(axis=1))[0])
            raise FiniteStrainError(
                f"displacement_mm of node {node} is {u[node]}: must be finite",
                field="node",
                value=node,
            )
        return u

    def _states(self, u: Array) -> element.GaussStates:
        states = element.gauss_states(u[self.mesh.hexes], self.mesh.cell_size_mm)
        self._check_inversion(states.dilatation, 0)
        return states

    def _check_inversion(self, dilatation: Array, first_cell: int) -> None:
        bad = ~((dilatation > LEAST_J - 1.0) & (dilatation < np.inf)).all(axis=1)
        if bad.any():
            local = int(np.flatnonzero(bad)[0])
            raise self._inversion(first_cell + local, dilatation[local])

    def _inversion(self, number: int, dilatation: Array) -> FiniteStrainError:
        k, j, i = (int(v) for v in np.argwhere(zyx(np.asarray(self.mesh.occupancy)))[number])
        least = 1.0 + float(dilatation.min())
        return FiniteStrainError(
            f"cell {number} at lattice position ({i}, {j}, {k}) is inverted: its volume ratio J "
            f"reaches {least:.3g} and must be finite and > 0 (beyond rounding); check the "
            f"displacement of nodes {self.mesh.hexes[number].tolist()} or use a smaller step",
            (i, j, k),
            least,
        )

    @cached_property
    def _blocks(self) -> tuple[NDArray[np.int32], NDArray[np.int32], sparse.csr_array]:
        """Pattern of the blocks, and the matrix that sums the element blocks (64m) into them."""
        indptr, indices = block_pattern(self.mesh.numbering)
        n, hexes = self.n_nodes, self.mesh.hexes.astype(np.int64)
        row = np.repeat(np.arange(n), np.diff(indptr))
        wanted = hexes[:, :, None] * n + hexes[:, None, :]
        block = np.searchsorted(row * n + indices, wanted.ravel())
        order = np.argsort(block, kind="stable")
        ends = np.concatenate([[0], np.cumsum(np.bincount(block, minlength=len(row)))])
        ones = np.ones(len(order))
        sums = sparse.csr_array((ones, order, ends), shape=(len(row), len(order)))
        return indptr, indices, sums
