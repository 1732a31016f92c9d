"""From displacements of the pad's outer surface to forces on it and back: F = S u, u = C F.

No force acts on the inner nodes, so they are condensed exactly: S = K_ss - K_si K_ii⁻¹ K_is. The
rungs differ in how they apply K_ii⁻¹, from the paper's single layer, which has no inner nodes, to
a factor of K_ii. Fields are (c, 3) over the nodes of `PadMesh.surface`, in mm and N.
"""

from __future__ import annotations

from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.elements.hex8 import Formulation, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.elements.skin import Membrane
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.adjoint_fields import AdjointFields, adjoint_fields, use_stored
from ifem_export.operators.condensed_operators import (
    CondensedOperator,
    DenseOperator,
    PaperOperator,
)
from ifem_export.operators.convolved_operator import (
    ConvolvedOperator,
    missing_resultant,
    truncated,
)
from ifem_export.operators.crowned_system import pad_system
from ifem_export.operators.matrix_free import held_surface_solver
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import inner_solver

Array = NDArray[np.float64]
Rung = Literal["paper", "truncated", "fft", "pcg", "factor", "dense32"]
RUNGS: tuple[Rung, ...] = get_args(Rung)
CROWNED_RUNGS: tuple[Rung, ...] = ("pcg", "factor", "dense32")
DEFAULT_RTOL = 1e-4
DEFAULT_RADIUS = 6
FACTOR_RTOL = 1e-10
EXACT_RTOL = 1e-7
"""From this residual of the inner solution on, force and torque need no correction."""


class SurfaceOperator(Protocol):
    """Stiffness and compliance of the outer surface."""

    @property
    def name(self) -> str:
        """Name of the rung."""

    @property
    def n_bytes(self) -> int:
        """Bytes of memory that a call of `force` reads."""

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Nodal forces that belong to given displacements.

        Args:
            displacement_mm: (c, 3) displacements of the surface nodes.

        Returns:
            (c, 3) in N.

        Raises:
            IfemError: The shape is wrong, or a value is not finite.
        """

    def displacement(self, force_n: ArrayLike) -> Array:
        """Displacements under given nodal forces.

        Args:
            force_n: (c, 3) forces on the surface nodes.

        Returns:
            (c, 3) in mm.

        Raises:
            IfemError: The shape is wrong, or a value is not finite.
        """


def surface_operator(
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    rung: Rung,
    *,
    rtol: float = DEFAULT_RTOL,
    radius: int = DEFAULT_RADIUS,
    lumped: bool | float = False,
    adjoint: AdjointFields | None = None,
    membranes: tuple[Membrane, ...] = (),
) -> SurfaceOperator:
    """Make the surface operator of one rung for a flat or crowned pad.

    Args:
        mesh: The pad. A flat pad of one layer has the rung "paper" only.
        material: The gel.
        formulation: Hex-8 formulation of the elements.
        rung: "paper" (one layer of fully integrated elements with the pad's outline and
            thickness), "truncated" or "fft" (convolution with the infinite pad's stiffness),
            "pcg" or "factor" (exact condensation) or "dense32" (S as a dense matrix).
        rtol: Relative residual of the inner solution ("pcg").
        radius: Reach of the convolution in nodes ("truncated").
        lumped: Whether "fft" is corrected at the rim, node by node, by what it misses of uniform
            motions; "truncated" always is.
        adjoint: Adjoint fields of this pad, where they are stored; else they are computed.
        membranes: Coat and fabric on a flat pad. They add to the forces of the nodes; force and
            torque of a motion do not depend on them.

    Returns:
        The operator. Force and torque of a motion are exact for all but "paper", whose single
        layer is another pad.

    Raises:
        IfemError: The rung is unknown or the radius is below 1.
        MeshError: The pad is neither flat nor crowned, or it is crowned and the rung needs a
            uniform thickness, or there are membranes on it.
    """
    if rung not in RUNGS:
        raise IfemError(
            f"surface operator {rung!r}: must be one of {', '.join(RUNGS)}",
            field="rung",
            value=rung,
        )
    if mesh.surface_shift is not None and rung not in CROWNED_RUNGS:
        raise MeshError(
            f"the pad is crowned: {rung!r} needs one thickness; use one of "
            f"{', '.join(CROWNED_RUNGS)}",
            field="rung",
            value=rung,
        )
    if rung == "paper":
        mesh, formulation = one_layer(mesh), "full"
    element = hex8_stiffness(mesh.cell_size_mm, material, formulation)
    system = pad_system(mesh, element, membranes)
    if adjoint is not None and rung != "paper":
        use_stored(system, adjoint)
    return system_operator(system, rung, rtol=rtol, radius=radius, lumped=lumped)


def system_operator(
    system: PadSystem,
    rung: Rung,
    *,
    rtol: float = DEFAULT_RTOL,
    radius: int = DEFAULT_RADIUS,
    lumped: bool | float = False,
) -> SurfaceOperator:
    """As `surface_operator`, for a system whose matrices several operators may share.

    A system of one layer has the rung "paper" only, whatever `rung` is.
    """
    if system.layers == 1:
        return PaperOperator(system)
    if rung == "fft":
        infinite = system.infinite_stiffness
        fields = adjoint_fields(system)
        missing = missing_resultant(fields, infinite) if lumped else None
        return ConvolvedOperator("fft", system, infinite, missing, fields)
    if rung == "truncated":
        fields = adjoint_fields(system)
        near = truncated(system.infinite_stiffness, radius)
        missing = missing_resultant(fields, near)
        return ConvolvedOperator("truncated", system, near, missing, fields)
    if rung == "dense32":
        return DenseOperator(system)
    if rung == "factor":
        return CondensedOperator(system, rung, inner_solver(system, "direct"), FACTOR_RTOL)
    solver = inner_solver(system) if system.is_cut else held_surface_solver(system)
    corrected = adjoint_fields(system) if rtol > EXACT_RTOL else None
    return CondensedOperator(system, rung, solver, rtol, corrected)


def one_layer(mesh: PadMesh) -> PadMesh:
    """The paper's mesh: the same outline and thickness with a single layer of cells."""
    hx, hy, hz = mesh.cell_size_mm
    cells = np.ascontiguousarray(np.asarray(mesh.occupancy)[:, :, :1])
    fill = None if mesh.fill is None else np.ascontiguousarray(np.asarray(mesh.fill)[:, :, :1])
    return PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers), mesh.origin_mm, fill)
