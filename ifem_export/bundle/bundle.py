"""The stiffness bundle: all a force pipeline needs to know about one sensor.

`build_bundle` makes one from a mesh and a material, `bundle_io` writes and reads it, and
`force` applies the paper's operator, F = K u with the lower face fixed to the acrylic. With one
layer every free node is on the outer surface and observed; the paper's form is that case.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from gelslim_core.budget.budget import Budget
from ifem_export.assembly.weighted_assembly import mesh_stiffness
from ifem_export.elements.hex8 import Formulation, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.markers.field import MarkerField, marker_field
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.operator_ladder import OperatorLadder, chosen_rung
from ifem_export.operators.surface_operator import Rung, SurfaceOperator, surface_operator

_SELF_TEST_SEED = 20190521
_SELF_TEST_AMPLITUDE = 0.1


@dataclass(frozen=True, eq=False)
class SelfTest:
    """A displacement (n, 3) in mm and the nodal forces (n, 3) in N that K gives for it."""

    displacement_mm: NDArray[np.float64]
    force_n: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bundle:
    """Mesh, element recipe, optional stiffness matrix, markers and camera of one sensor.

    Args:
        mesh: the cropped pad.
        material: the gel.
        formulation: Hex-8 formulation of `element_matrix`.
        element_matrix: (24, 24) in N/mm; with the mesh's occupancy and fill it determines K.
        stiffness: materialised K, (3n, 3n) CSR in N/mm, or None.
        markers: marker grid, or None for a bare pad.
        camera: camera parameters, any JSON-able mapping; passed through untouched.
        self_test: reference pair checked when the bundle is loaded.
        spec_hash: identifies the spec the bundle was made from.
        ladder: surface operators with their measured error and time, or None.
        operator: label of the ladder's rung that the bundle's maker chose, or "".
    """

    mesh: PadMesh
    material: Material
    formulation: Formulation
    element_matrix: NDArray[np.float64]
    stiffness: sparse.csr_array | None
    markers: MarkerField | None
    camera: Mapping[str, Any]
    self_test: SelfTest
    spec_hash: str
    ladder: OperatorLadder | None = None
    operator: str = ""

    def surface_operator(
        self,
        rung: Rung | None = None,
        *,
        budget: Budget | None = None,
        **parameters: Any,
    ) -> SurfaceOperator:
        """Operator on the outer surface, F = S u and u = C F.

        By name with its parameters, or by budget from the measured ladder; else the maker's
        choice, else `pcg`. Raises BudgetError where no rung keeps the budget, IfemError where none
        was measured.
        """
        if rung is None:
            chosen = chosen_rung(self.ladder, self.operator, budget)
            if chosen is not None:
                rung, parameters = chosen.rung, dict(chosen.parameters)
        return surface_operator(
            self.mesh, self.material, self.formulation, rung or "pcg", **parameters
        )

    @cached_property
    def stiffness_matrix(self) -> sparse.csr_array:
        """K, (3n, 3n) in N/mm: the stored one, else assembled from the recipe once."""
        if self.stiffness is not None:
            return self.stiffness
        return mesh_stiffness(self.mesh, np.asarray(self.element_matrix))

    @property
    def times_key(self) -> str:
        """Names this sensor's operators among the times of a machine."""
        parts = f"{self.geometry_hash}|{self.material}|{self.formulation}"
        return f"operators-{hashlib.sha256(parts.encode()).hexdigest()[:32]}"

    @cached_property
    def geometry_hash(self) -> str:
        """SHA-256 of pad lattice and marker positions, see `geometry_hash`."""
        return geometry_hash(self.mesh, self.markers)


def build_bundle(
    mesh: PadMesh,
    material: Material,
    formulation: Formulation,
    *,
    marker_positions_mm: ArrayLike | None = None,
    marker_arrays: Mapping[str, ArrayLike] | None = None,
    camera: Mapping[str, Any] | None = None,
    spec_hash: str = "",
    with_stiffness: bool = True,
    ladder: OperatorLadder | None = None,
    operator: str = "",
) -> Bundle:
    """Make a bundle.

    Args:
        mesh: the cropped pad.
        material: the gel.
        formulation: "full" (the paper's standard element), "bbar" or "incompatible".
        marker_positions_mm: (k, 2) or (k, 3) in the sensor frame.
        marker_arrays: further arrays of length k by name.
        camera: JSON-able mapping of camera parameters.
        spec_hash: hash of the spec this sensor comes from.
        with_stiffness: materialise K.
        ladder: measured surface operators of this pad.
        operator: label of the rung to use unless told otherwise.

    Raises:
        IfemError: markers that carry no field, marker arrays of another length, or a camera
            that is not plain JSON.
    """
    plain_camera = _plain_json(camera or {})
    matrix = hex8_stiffness(mesh.cell_size_mm, material, formulation)
    stiffness = None
    if with_stiffness:
        stiffness = mesh_stiffness(mesh, matrix)
    displacement = _test_displacement(mesh)
    return Bundle(
        mesh=mesh,
        material=material,
        formulation=formulation,
        element_matrix=matrix,
        stiffness=stiffness,
        markers=marker_field(mesh, marker_positions_mm, marker_arrays),
        camera=plain_camera,
        self_test=SelfTest(displacement, recipe_force(mesh, matrix, displacement)),
        spec_hash=spec_hash,
        ladder=ladder,
        operator=operator,
    )


def force(bundle: Bundle, displacement_mm: ArrayLike) -> NDArray[np.float64]:
    """Nodal forces F = K u with the lower face fixed.

    Args:
        bundle: the sensor.
        displacement_mm: (n, 3) displacement of every node, zero on the bonded nodes.

    Returns:
        (n, 3) in N: external force on the gel at each free node, and on the bonded nodes the
        reaction of the acrylic; the rows sum to zero.

    Raises:
        IfemError: wrong shape, a value that is not finite, or a bonded node that moves.
    """
    u = np.asarray(displacement_mm, dtype=float)
    n = bundle.mesh.n_nodes
    if u.shape != (n, 3):
        raise IfemError(f"displacement has shape {u.shape}: must be ({n}, 3), one row per node")
    if not np.isfinite(u).all():
        raise IfemError("displacement holds a value that is not finite: fill lost markers first")
    if u[bundle.mesh.bonded].any():
        worst = np.abs(u[bundle.mesh.bonded]).max()
        raise IfemError(
            f"displacement moves a bonded node by {worst:.3g} mm: the lower face is fixed to the "
            "acrylic, so those rows must be zero"
        )
    return np.asarray(bundle.stiffness_matrix @ u.reshape(-1)).reshape(n, 3)


def node_displacement(bundle: Bundle, marker_displacement_mm: ArrayLike) -> NDArray[np.float64]:
    """Displacement of every node from that of the markers.

    Args:
        bundle: the sensor.
        marker_displacement_mm: (k, 3).

    Returns:
        (n, 3) in mm: interpolated on the surface nodes, zero on all others, which is complete
        for one layer.

    Raises:
        IfemError: the bundle has no markers or the shape is wrong.
    """
    if bundle.markers is None:
        raise IfemError("the bundle has no markers: rebuild it with marker positions")
    d = np.asarray(marker_displacement_mm, dtype=float)
    k = len(bundle.markers.positions_mm)
    if d.shape != (k, 3):
        raise IfemError(f"marker displacement has shape {d.shape}: must be ({k}, 3)")
    u = np.zeros((bundle.mesh.n_nodes, 3))
    u[bundle.mesh.surface] = bundle.markers.to_surface @ d
    return u


def recipe_force(
    mesh: PadMesh, element_matrix: NDArray[np.float64], displacement_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """F = K u element by element, without K: an independent check of the assembled matrix."""
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


def geometry_hash(mesh: PadMesh, markers: MarkerField | None) -> str:
    """SHA-256 of what makes a pad another pad: lattice, occupancy and marker positions.

    Lengths are rounded to 1e-9 mm, so that rounding between machines does not matter. Material
    and camera are left out: both may be recalibrated on the same pad.
    """
    digest = hashlib.sha256(b"gelslim-geometry/1")
    lengths = np.array([*mesh.cell_size_mm, *mesh.origin_mm])
    parts: list[NDArray[Any]] = [
        np.array(mesh.occupancy.shape, dtype="<i8"),
        np.packbits(mesh.occupancy),
        _rounded(lengths),
    ]
    for name, part in (("fill", mesh.fill), ("surface_shift", mesh.surface_shift)):
        if part is not None:
            parts += [np.frombuffer(name.encode(), dtype="u1"), _rounded(np.asarray(part))]
    if mesh.surface_shift is not None:
        parts.append(np.asarray(mesh.surface, dtype="<i8"))
    if markers is not None:
        parts += [
            np.array(markers.positions_mm.shape, dtype="<i8"),
            _rounded(np.asarray(markers.positions_mm)),
        ]
    for part in parts:
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()


def _rounded(lengths_mm: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.rint(lengths_mm * 1e9).astype("<i8")


def _test_displacement(mesh: PadMesh) -> NDArray[np.float64]:
    """Fixed pseudo-random displacement of the free nodes, zero on the bonded ones."""
    rng = np.random.default_rng(_SELF_TEST_SEED)
    u = rng.uniform(-_SELF_TEST_AMPLITUDE, _SELF_TEST_AMPLITUDE, (mesh.n_nodes, 3))
    u[mesh.bonded] = 0.0
    return u


def _plain_json(camera: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping as it will be read back from JSON (tuples become lists)."""
    try:
        plain: dict[str, Any] = json.loads(json.dumps(dict(camera), allow_nan=False))
    except (TypeError, ValueError) as error:
        raise IfemError(
            f"camera is not plain JSON ({error}): use only finite numbers, text, lists and maps"
        ) from error
    return plain
