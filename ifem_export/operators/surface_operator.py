"""From the motion of the pad's outer surface to the forces on it, and back: F = S u, u = C F.

No force acts on inner nodes, so they condense away exactly: S = K_ss - K_si K_ii⁻¹ K_is. The rungs
differ in how K_ii⁻¹ is applied, from the paper's single layer, which has no inner nodes, to a
factor of K_ii. Fields are (c, 3) over the nodes of `PadMesh.surface`, mm and N.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.elements.hex8 import Formulation, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.convolved_operator import Convolved, missing_resultant, truncated
from ifem_export.operators.crowned_system import pad_system
from ifem_export.operators.paper_operator import Paper
from ifem_export.operators.solver import Method, Solver, SparseFactor, inner_solver, pad_solver
from ifem_export.operators.surface_field import SolvedCompliance, checked

Array = NDArray[np.float64]
Rung = Literal["paper", "truncated", "fft", "pcg", "factor", "dense32"]
RUNGS: tuple[Rung, ...] = get_args(Rung)
CROWNED_RUNGS: tuple[Rung, ...] = ("pcg", "factor", "dense32")
DEFAULT_RTOL = 1e-4
DEFAULT_RADIUS = 6
DENSE_BATCH = 256


class SurfaceOperator(Protocol):
    """Stiffness of the outer surface; both ways raise IfemError for a field of a wrong shape."""

    @property
    def name(self) -> str:
        """The rung."""

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces (c, 3) in N that hold the surface nodes at (c, 3) mm."""

    def displacement(self, force_n: ArrayLike) -> Array:
        """Displacement (c, 3) in mm under forces (c, 3) in N."""

    @property
    def n_bytes(self) -> int:
        """Memory of what the operator keeps."""


def surface_operator(
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    rung: Rung,
    *,
    rtol: float = DEFAULT_RTOL,
    radius: int = DEFAULT_RADIUS,
    lumped: bool | float = False,
) -> SurfaceOperator:
    """Operator of a rung for a flat or crowned pad.

    `rtol` is the residual of the inner solve (pcg), `radius` the reach in nodes (truncated).
    `lumped` makes the resultant of `fft` exact, as that of `truncated` always is.
    `paper` takes one layer of fully integrated elements over the mesh's outline and thickness;
    a pad of one layer has no other operator. Raises IfemError for an unknown rung, MeshError for a
    pad whose layers differ unless it is crowned, and for a crowned one with a rung that needs one
    thickness.
    """
    if rung not in RUNGS:
        raise IfemError(f"surface operator {rung!r}: must be one of {', '.join(RUNGS)}")
    if mesh.surface_shift is not None and rung not in CROWNED_RUNGS:
        raise MeshError(
            f"the pad is crowned: {rung!r} needs one thickness; use one of "
            f"{', '.join(CROWNED_RUNGS)}"
        )
    if rung == "paper":
        mesh, formulation = one_layer(mesh), "full"
    system = pad_system(mesh, hex8_stiffness(mesh.cell_size_mm, material, formulation))
    if system.layers == 1:
        return Paper(system)
    if rung == "fft":
        missing = missing_resultant(system, system.surface_guess) if lumped else None
        return Convolved("fft", system, system.surface_guess, missing)
    if rung == "truncated":
        near = truncated(system.surface_guess, radius)
        return Convolved("truncated", system, near, missing_resultant(system, near))
    if rung == "dense32":
        return Dense(system)
    iterative: Method = "auto" if system.is_cut else "pcg"
    solver = inner_solver(system, "direct" if rung == "factor" else iterative)
    return Condensed(system, rung, solver, rtol if rung == "pcg" else 1e-10)


def one_layer(mesh: PadMesh) -> PadMesh:
    """The paper's mesh: the same outline with a single layer of cells."""
    hx, hy, hz = mesh.cell_size_mm
    cells = np.ascontiguousarray(np.asarray(mesh.occupancy)[:, :, :1])
    fill = None if mesh.fill is None else np.ascontiguousarray(np.asarray(mesh.fill)[:, :, :1])
    return PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers), mesh.origin_mm, fill)


@dataclass(frozen=True, eq=False)
class Condensed(SolvedCompliance):
    """Exact condensation; the inner nodes are solved for at each call."""

    name: str
    inner: Solver
    rtol: float = DEFAULT_RTOL

    def force(self, displacement_mm: ArrayLike) -> Array:
        """F = K_ss u + K_si u_i with K_ii u_i = -K_is u."""
        u = checked(displacement_mm, self.system.columns).reshape(-1)
        held = self.inner.solve(-(self.system.surface_to_inner @ u), self.rtol).x
        force = self.system.surface @ u + self.system.inner_to_surface @ held
        return np.asarray(force.reshape(-1, 3))

    @cached_property
    def whole(self) -> Solver:
        """Solver of all free nodes."""
        return pad_solver(self.system, "direct" if self.name == "factor" else "auto")

    @property
    def n_bytes(self) -> int:
        """Bytes of the blocks that a call reads."""
        s = self.system
        parts = (s.surface, s.inner, s.surface_to_inner, s.inner_to_surface)
        kept = sum(p.data.nbytes + p.indices.nbytes + p.indptr.nbytes for p in parts)
        if isinstance(self.inner, SparseFactor):
            return int(kept + 12 * self.inner.factor.nnz)
        return int(kept + s.inner_guess.blocks.nbytes)


@dataclass(frozen=True, eq=False)
class Dense(SolvedCompliance):
    """S as a dense float32 matrix, made column by column."""

    name: str = "dense32"

    @cached_property
    def matrix(self) -> NDArray[np.float32]:
        """S (3c, 3c) in N/mm, symmetric."""
        s = self.system
        factor = SparseFactor(s.inner).factor
        n = s.surface.shape[0]
        dense = np.empty((n, n), dtype=np.float32)
        across = sparse.csc_array(s.surface_to_inner)
        for first in range(0, n, DENSE_BATCH):
            part = slice(first, min(first + DENSE_BATCH, n))
            held = factor.solve(across[:, part].toarray())
            block = s.surface[:, part].toarray() - s.inner_to_surface @ held
            dense[:, part] = block
        return np.asarray((dense + dense.T) / 2, dtype=np.float32)

    def force(self, displacement_mm: ArrayLike) -> Array:
        """One matrix-vector product."""
        u = checked(displacement_mm, self.system.columns).astype(np.float32)
        return np.asarray(self.matrix @ u.reshape(-1), dtype=float).reshape(-1, 3)

    @property
    def n_bytes(self) -> int:
        """Bytes of the matrix."""
        return int(self.matrix.nbytes)
