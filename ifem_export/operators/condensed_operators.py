"""Surface operators that condense the inner nodes of the pad's own equations, F = S u.

`PaperOperator` is the single layer of the GelSlim 2.0 paper, which has no inner nodes.
`CondensedOperator` solves for the inner nodes at each call. `DenseOperator` stores S.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.operators.adjoint_fields import AdjointFields
from ifem_export.operators.layer_coupling import BESIDE, Coupling, Stencil, coupling, stencil
from ifem_export.operators.pad_system import PadSystem, checked_field
from ifem_export.operators.solver import Solver, SparseFactor, matrix_bytes, pad_solver

Array = NDArray[np.float64]
COMPLIANCE_RTOL = 1e-8
DENSE_BATCH = 256


@dataclass(frozen=True, eq=False)
class _WithCompliance:
    """Displacement under surface forces, by solving the equations of all free nodes."""

    system: PadSystem

    @cached_property
    def pad_solver(self) -> Solver:
        """Solver of all free nodes."""
        return pad_solver(self.system)

    def displacement(self, force_n: ArrayLike) -> Array:
        """Surface part of the solution of K_ff u = f for forces (c, 3) on the surface alone."""
        columns = self.system.columns
        load = np.zeros((len(self.system.mesh.free), 3))
        load[-columns:] = checked_field(force_n, columns)
        u = self.pad_solver.solve(load, COMPLIANCE_RTOL).x.reshape(-1, 3)
        return np.asarray(u[-columns:])


@dataclass(frozen=True, eq=False)
class PaperOperator(_WithCompliance):
    """Surface stiffness of a pad of one layer, applied as a stencil of nine neighbours."""

    name: str = "paper"

    def force(self, displacement_mm: ArrayLike) -> Array:
        """K_ss u."""
        u = checked_field(displacement_mm, self.system.columns)
        if self._assembled:
            return np.asarray(self.system.stiffness @ u.ravel()).reshape(-1, 3)
        return self._stencil.force(np.vstack([u, np.zeros((1, 3))]))

    @property
    def n_bytes(self) -> int:
        """Bytes of the stencil, or of the matrix where the stencil does not hold."""
        if self._assembled:
            return matrix_bytes(self.system.stiffness)
        return self._stencil.n_bytes

    @property
    def _assembled(self) -> bool:
        """Whether cells are scaled or membranes added, which the stencil does not know."""
        return self.system.mesh.fill is not None or bool(self.system.membranes)

    @cached_property
    def _stencil(self) -> Stencil:
        return stencil(self.system, 0, BESIDE)


@dataclass(frozen=True, eq=False)
class CondensedOperator(_WithCompliance):
    """Exact condensation that solves for the inner nodes at each call, to a residual `rtol`.

    With `adjoint` force and torque are exact whatever the residual.
    """

    name: str
    inner_solver: Solver
    rtol: float
    adjoint: AdjointFields | None = None

    def force(self, displacement_mm: ArrayLike) -> Array:
        """F = K_ss u + K_si u_i, where K_ii u_i = -K_is u."""
        u = checked_field(displacement_mm, self.system.columns)
        inner = self.inner_solver.solve(-self._coupling.on_inner(u), self.rtol).x
        force = self._coupling.on_surface(u, inner)
        return force if self.adjoint is None else self.adjoint.completed(force, u)

    @cached_property
    def _coupling(self) -> Coupling:
        return coupling(self.system)

    @cached_property
    def pad_solver(self) -> Solver:
        """Solver of all free nodes."""
        return pad_solver(self.system, "direct" if self.name == "factor" else "auto")

    @property
    def n_bytes(self) -> int:
        """Bytes that a call with one iteration reads."""
        adjoint = 0 if self.adjoint is None else self.adjoint.n_bytes
        return self._coupling.n_bytes + self.inner_solver.n_bytes + adjoint


@dataclass(frozen=True, eq=False)
class DenseOperator(_WithCompliance):
    """S as a dense float32 matrix, computed once in batches of columns."""

    name: str = "dense32"

    @cached_property
    def matrix(self) -> NDArray[np.float32]:
        """S (3c, 3c) in N/mm, symmetric."""
        return condensed_stiffness(self.system, np.float32)

    def force(self, displacement_mm: ArrayLike) -> Array:
        """One matrix-vector product."""
        u = checked_field(displacement_mm, self.system.columns).astype(np.float32)
        return np.asarray(self.matrix @ u.ravel(), dtype=float).reshape(-1, 3)

    @property
    def n_bytes(self) -> int:
        """Bytes of the matrix."""
        return int(self.matrix.nbytes)


def condensed_stiffness(system: PadSystem, dtype: type[np.floating[Any]]) -> NDArray[Any]:
    """S = K_ss - K_si K_ii⁻¹ K_is as a dense matrix, computed in batches of columns.

    Args:
        system: The pad's equations.
        dtype: `np.float32` or `np.float64`, in which it is kept.

    Returns:
        (3c, 3c) in N/mm, symmetric.
    """
    if system.inner.shape[0] == 0:
        return np.asarray(system.surface.toarray(), dtype=dtype)
    factor = SparseFactor(system.inner).factor
    n = system.surface.shape[0]
    dense = np.empty((n, n), dtype=dtype)
    coupling = sparse.csc_array(system.surface_to_inner)
    for first in range(0, n, DENSE_BATCH):
        part = slice(first, first + DENSE_BATCH)
        inner = factor.solve(coupling[:, part].toarray())
        dense[:, part] = system.surface[:, part].toarray() - system.inner_to_surface @ inner
    return np.asarray((dense + dense.T) / 2, dtype=dtype)
