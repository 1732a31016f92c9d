"""Internal force of a neo-Hookean pad at large deformation (F-bar Hex-8).

For the energy and the element see `finite_strain_reference`. All nodes of a one-layer pad are
observed, so its contact forces follow from the measured displacement by one evaluation, with no
solve; the tangent serves Newton's method where interior nodes must be found.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.assembly.assembly import assemble_bsr
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError, MeshError
from ifem_export.finite_strain import reference
from ifem_export.mesh.lattice import Numbering, hexahedra, number_nodes, zyx
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
Engine = Literal["compiled", "numpy"]
# Cells per tangent batch: keeps the intermediates in tens of megabytes.
_BATCH = 1024
# A cell flattened to nothing has a J that is 0 up to rounding only.
LEAST_J = 1e-12


class FiniteStrainError(IfemError):
    """A displacement that no continuous deformation of the pad has.

    Attributes:
        cell: (i, j, k) of the first inverted cell in the lattice; None if none is named.
    """

    def __init__(self, message: str, cell: tuple[int, int, int] | None = None) -> None:
        super().__init__(message)
        self.cell = cell

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.cell))


def internal_force(
    mesh: PadMesh | tuple[NDArray[np.bool_], Sequence[float]],
    material: Material,
    displacement_mm: ArrayLike,
) -> Array:
    """Nodal forces (n, 3) in N that hold the pad in a displacement (n, 3) in mm.

    For many frames build a `NeoHookeanPad` once and call its `force`.

    Args:
        mesh: the pad, or its occupancy (nx, ny, nz) and cell size (hx, hy, hz) in mm.
        material: E and ν of the small-strain law that the neo-Hookean law has at rest.
        displacement_mm: (n, 3), in the node order of `PadMesh`.

    Raises:
        MeshError: impossible cell size or empty occupancy.
        FiniteStrainError: wrong shape, a value that is not finite, or an inverted cell.
    """
    return NeoHookeanPad.of(mesh, material).force(displacement_mm)


@dataclass(frozen=True, eq=False)
class NeoHookeanPad:
    """A pad of equal cells of compressible neo-Hookean solid; make one by `of`.

    Args:
        occupancy: (nx, ny, nz) bool.
        cell_size_mm: (hx, hy, hz).
        material: elastic constants at rest.
        numbering: node numbers of the occupancy.
        hexes: (m, 8) int32 corner nodes in VTK_HEXAHEDRON order.
    """

    occupancy: NDArray[np.bool_]
    cell_size_mm: tuple[float, float, float]
    material: Material
    numbering: Numbering
    hexes: NDArray[np.int32]

    @classmethod
    def of(
        cls, mesh: PadMesh | tuple[NDArray[np.bool_], Sequence[float]], material: Material
    ) -> NeoHookeanPad:
        """From a pad mesh, or from an occupancy and a cell size; raises MeshError."""
        if isinstance(mesh, PadMesh):
            if mesh.fill is not None or mesh.surface_shift is not None:
                raise MeshError(
                    "the finite-strain law takes flat pads of whole cells only: mesh with "
                    "weighting 'cell_centre' and no crown"
                )
            return cls(mesh.occupancy, mesh.cell_size_mm, material, mesh.numbering, mesh.hexes)
        occupancy, size = mesh
        h = np.asarray(size, dtype=float)
        if h.shape != (3,) or not np.isfinite(h).all() or (h <= 0.0).any():
            raise MeshError(f"cell_size_mm = {size}: must be three numbers > 0")
        numbering = number_nodes(occupancy)
        cell_size = (float(h[0]), float(h[1]), float(h[2]))
        hexes = hexahedra(occupancy, numbering)
        # As in PadMesh: the compiled loop tells read-only arrays from others.
        hexes.flags.writeable = False
        return cls(occupancy, cell_size, material, numbering, hexes)

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return self.numbering.n_nodes

    def force(
        self, displacement_mm: ArrayLike, *, threads: int = 1, engine: Engine = "compiled"
    ) -> Array:
        """Internal force, the gradient of `energy_n_mm`; the same bits for any `threads`.

        Args:
            displacement_mm: (n, 3).
            threads: worker threads of the compiled engine.
            engine: "compiled" (numba) or "numpy" (the slow reference).

        Returns:
            (n, 3) in N; positive components pull the node along the axis.

        Raises:
            FiniteStrainError: wrong shape, a value that is not finite, or J <= 0 at a Gauss
                point: the message names the cell.
        """
        u = self._checked(displacement_mm)
        if engine == "numpy":
            corners = reference.element_forces(self._states(u), self.material)
            flat = self.hexes.ravel()
            columns = [
                np.bincount(flat, corners[..., i].ravel(), minlength=self.n_nodes) for i in range(3)
            ]
            return np.stack(columns, axis=1)
        if engine != "compiled":
            raise FiniteStrainError(f"engine {engine!r}: must be compiled or numpy")
        if threads < 1:
            raise FiniteStrainError(f"threads = {threads}: must be >= 1")
        return self._compiled_force(u, threads)

    def energy_n_mm(self, displacement_mm: ArrayLike) -> float:
        """Strain energy in N mm (mJ); raises as `force`."""
        states = self._states(self._checked(displacement_mm))
        return float(reference.element_energies(states, self.material).sum())

    def ahead_pressure_mpa(self, displacement_mm: ArrayLike, step_mm: Array) -> Array:
        """Mean pressure (m,) of the cells after a step (n, 3), to first order in it.

        Positive where a cell is swollen. For a step of 0 it is the pressure that `force` has.
        Raises as `force`.
        """
        states = self._states(self._checked(displacement_mm))
        return reference.ahead_pressures(states, self.material, np.asarray(step_mm)[self.hexes])

    def tangent(
        self, displacement_mm: ArrayLike, pressure_mpa: Array | None = None
    ) -> sparse.bsr_array:
        """Tangent stiffness ∂force/∂u as (3n, 3n) BSR in N/mm, symmetric to the bit.

        At rest it is the stiffness of the "bbar" element. With `pressure_mpa` (m,) cells' shapes
        are as stiff as under that pressure. In nearly incompressible gel off balance, a cell's own
        is mostly error; Newton's method that takes what the last step predicts has the same
        solution and far fewer steps (Magisano, Leonetti and Garcea 2017). Raises as `force`.
        """
        u = self._checked(displacement_mm)
        pattern, gather = self._block_pattern
        corners = u[self.hexes]
        blocks = np.empty((len(corners), 8, 8, 3, 3))
        for start in range(0, len(corners), _BATCH):
            part = corners[start : start + _BATCH]
            states = reference.gauss_states(part, self.cell_size_mm)
            self._check_inversion(states.dilatation, start)
            given = None if pressure_mpa is None else pressure_mpa[start : start + _BATCH]
            matrices = reference.element_tangents(states, self.material, given)
            split = matrices.reshape(-1, 8, 3, 8, 3).transpose(0, 1, 3, 2, 4)
            blocks[start : start + _BATCH] = split
        data = gather @ blocks.reshape(-1, 9)
        parts = (data.reshape(-1, 3, 3), pattern.indices, pattern.indptr)
        tangent = sparse.bsr_array(parts, shape=pattern.shape)
        tangent.has_sorted_indices = True
        return tangent

    def _checked(self, displacement_mm: ArrayLike) -> Array:
        try:
            u = np.ascontiguousarray(displacement_mm, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FiniteStrainError(f"displacement_mm: must be numbers, {error}") from None
        if u.shape != (self.n_nodes, 3):
            raise FiniteStrainError(
                f"displacement_mm has shape {u.shape}: must be ({self.n_nodes}, 3), a row per node"
            )
        if not np.isfinite(u).all():
            node = int(np.flatnonzero(~np.isfinite(u).all(axis=1))[0])
            raise FiniteStrainError(f"displacement_mm of node {node} is {u[node]}: must be finite")
        return u

    def _states(self, u: Array) -> reference.GaussStates:
        states = reference.gauss_states(u[self.hexes], self.cell_size_mm)
        self._check_inversion(states.dilatation, 0)
        return states

    def _check_inversion(self, dilatation: Array, first_cell: int) -> None:
        bad = ~((dilatation > LEAST_J - 1.0) & (dilatation < np.inf)).all(axis=1)
        if bad.any():
            local = int(np.flatnonzero(bad)[0])
            raise self._inversion(first_cell + local, dilatation[local])

    def _inversion(self, number: int, dilatation: Array) -> FiniteStrainError:
        k, j, i = (int(v) for v in np.argwhere(zyx(np.asarray(self.occupancy)))[number])
        least = 1.0 + float(dilatation.min())
        return FiniteStrainError(
            f"cell {number} at lattice position ({i}, {j}, {k}) is turned inside out or torn: "
            f"its volume ratio J reaches {least:.3g}, must be finite and > 0 (beyond rounding); "
            f"check the displacement of nodes {self.hexes[number].tolist()} or use a smaller step",
            (i, j, k),
        )

    def _compiled_force(self, u: Array, threads: int) -> Array:
        from ifem_export.finite_strain import kernel

        starts, entries = self._incidence
        corners = np.empty((len(self.hexes), 8, 3))
        total = np.empty((self.n_nodes, 3))
        size = np.array(self.cell_size_mm)
        g, bulk = self.material.shear_modulus_mpa, self.material.bulk_modulus_mpa
        hexes = self.hexes

        def fill(a: int, b: int) -> int:
            return int(kernel.element_forces(a, b, hexes, u, size, g, bulk, LEAST_J, corners))

        def gather(a: int, b: int) -> None:
            kernel.gather(a, b, starts, entries, corners.reshape(-1, 3), total)

        inverted = [cell for cell in _split(fill, len(hexes), threads) if cell >= 0]
        if inverted:
            cell = inverted[0]
            states = reference.gauss_states(u[hexes[cell : cell + 1]], self.cell_size_mm)
            raise self._inversion(cell, states.dilatation[0])
        _split(gather, self.n_nodes, threads)
        return total

    @cached_property
    def _incidence(self) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """Corner entries (8 cell + corner) of each node in increasing order, as CSR."""
        flat = self.hexes.ravel()
        entries = np.argsort(flat, kind="stable").astype(np.int32)
        counts = np.bincount(flat, minlength=self.n_nodes)
        return np.concatenate([[0], np.cumsum(counts)]), entries

    @cached_property
    def _block_pattern(self) -> tuple[sparse.bsr_array, sparse.csr_array]:
        """K's pattern, and the sum of element blocks (64m) into its blocks."""
        empty = np.zeros((24, 24))
        pattern = assemble_bsr(np.asarray(self.occupancy), empty, numbering=self.numbering)
        n, hexes = self.n_nodes, self.hexes.astype(np.int64)
        row = np.repeat(np.arange(n), np.diff(pattern.indptr))
        wanted = hexes[:, :, None] * n + hexes[:, None, :]
        place = np.searchsorted(row * n + pattern.indices, wanted.ravel())
        order = np.argsort(place, kind="stable")
        ends = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=len(row)))])
        ones = np.ones(len(order))
        return pattern, sparse.csr_array((ones, order, ends), shape=(len(row), len(order)))


def _split(job: Any, n: int, threads: int) -> list[Any]:
    """Results of job(start, stop) over 0 … n in `threads` ranges."""
    workers = min(threads, n)
    if workers == 1:
        return [job(0, n)]
    bounds = np.linspace(0, n, workers + 1).astype(int)
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(lambda ab: job(int(ab[0]), int(ab[1])), itertools.pairwise(bounds)))
