"""The stiffness bundle: everything that the force pipeline needs to know about one sensor.

`build_bundle` makes one from a mesh and a material. `ifem_export.bundle.files` writes and reads it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from gelslim_core.budget.budget import Budget
from ifem_export.assembly.assembly import mesh_stiffness
from ifem_export.bundle.imported import Imported
from ifem_export.bundle.self_test import SelfTest
from ifem_export.elements.hex8 import Formulation, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.elements.skin import Membrane, Skin
from ifem_export.errors import IfemError
from ifem_export.markers.field import MarkerField, marker_field
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.adjoint_fields import AdjointFields, adjoint_fields, stored_fields
from ifem_export.operators.crowned_system import pad_system
from ifem_export.operators.operator_ladder import OperatorLadder, chosen_rung
from ifem_export.operators.surface_operator import Rung, SurfaceOperator, surface_operator

ELEMENT_MATRIX = "element_matrix_n_per_mm"
"""Name under which the element matrix is stored."""
ELEMENT_TOLERANCE = 1e-12
"""Largest relative difference between the stored element matrix and that of the material."""
_WITHOUT_ADJOINT = ("paper", "factor", "dense32")


@dataclass(frozen=True, eq=False)
class Bundle:
    """All that force pipeline and twin need of one sensor.

    Attributes:
        mesh: The cropped pad.
        material: The gel.
        formulation: Hex-8 formulation of `element_matrix`.
        element_matrix: (24, 24) in N/mm; with the mesh's occupancy and fill it determines K.
        stiffness: Stored stiffness matrix K, (3n, 3n) CSR in N/mm, or None.
        markers: Markers and their interpolation, or None for a pad without markers.
        camera: Camera parameters, a mapping of JSON values that is stored unchanged.
        self_test: Pair of displacement and force that is checked when the bundle is loaded.
        spec_hash: SHA-256 of the spec from which the bundle was made.
        ladder: Surface operators with their measured error and time, or None.
        operator: Label of the default rung of the ladder, or "".
        outline: The gel seen from above; None where only the mesh is known.
        tolerances: Standard deviations of what the maker states, by name: `youngs_modulus_mpa`,
            `poissons_ratio`, `thickness_mm`.
        light: Arrays of the light on the untouched gel by name, as
            `gelslim_optics.light.light_map.LightMap` has them; empty where it was not traced.
        stored_adjoint: Adjoint fields (6, c, 3) as stored with the bundle, in N/mm and N/rad, or
            None; see `adjoint`.
        skin: Coat and fabric on the gel; None where the gel counts as bare. The operators of the
            surface contain them.
        imported: What is known of a sensor that was not generated; None for a generated one.

    Raises:
        IfemError: `element_matrix` is not that of the mesh and the material; `with_gel` changes all
            of them together.
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
    outline: RoundedRectangle | None = None
    tolerances: Mapping[str, float] = field(default_factory=dict)
    light: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    stored_adjoint: NDArray[np.float64] | None = None
    skin: Skin | None = None
    imported: Imported | None = None

    def __post_init__(self) -> None:
        expected = hex8_stiffness(self.mesh.cell_size_mm, self.material, self.formulation)
        gap = np.abs(self.element_matrix - expected).max() / np.abs(expected).max()
        if not gap <= ELEMENT_TOLERANCE:
            raise IfemError(
                f"the element matrix differs by {gap:.2g} from the {self.formulation} element of "
                "this mesh and material; change them by `with_gel`",
                field=ELEMENT_MATRIX,
            )

    def __str__(self) -> str:
        """The sensor in a line: pad, gel, markers and light."""
        mesh, material, markers = self.mesh, self.material, self.markers
        size_mm = " x ".join(f"{size:.3g}" for size in np.ptp(mesh.nodes_mm, axis=0))
        return (
            f"Bundle(pad of {size_mm} mm with {len(mesh.surface)} surface nodes, "
            f"E = {material.youngs_modulus_mpa:.4g} MPa, ν = {material.poissons_ratio:.4g}, "
            f"{0 if markers is None else len(markers.positions_mm)} markers, "
            f"{'traced light' if self.light else 'no traced light'})"
        )

    __repr__ = __str__

    def surface_operator(
        self,
        rung: Rung | None = None,
        *,
        budget: Budget | None = None,
        membranes: tuple[Membrane, ...] | None = None,
        **parameters: Any,
    ) -> SurfaceOperator:
        """Make the operator on the outer surface, F = S u and u = C F.

        Without a rung and a budget it is the default rung of the bundle, or else `pcg`.

        Args:
            rung: Name of the operator, with its `parameters`.
            budget: Allowed error and time, by which the ladder chooses the operator.
            membranes: Coat and fabric on the gel; None takes those of the bundle.
            **parameters: See `ifem_export.operators.surface_operator.surface_operator`.

        Returns:
            The operator.

        Raises:
            BudgetError: No rung keeps the budget.
            IfemError: A budget is given, but the bundle has no ladder.
        """
        if rung is None:
            chosen = chosen_rung(self.ladder, self.operator, budget)
            if chosen is not None:
                rung, parameters = chosen.rung, dict(chosen.parameters)
        rung = rung or "pcg"
        if rung not in _WITHOUT_ADJOINT:
            parameters = {"adjoint": self.adjoint, **parameters}
        parameters["membranes"] = self.membranes if membranes is None else membranes
        return surface_operator(self.mesh, self.material, self.formulation, rung, **parameters)

    @property
    def membranes(self) -> tuple[Membrane, ...]:
        """Coat and fabric that the operators of the surface contain; none on a crowned pad."""
        if self.skin is None or self.mesh.surface_shift is not None:
            return ()
        return self.skin.membranes

    @cached_property
    def stiffness_matrix(self) -> sparse.csr_array:
        """K (3n, 3n) in N/mm: the stored matrix, or else assembled once."""
        if self.stiffness is not None:
            return self.stiffness
        return mesh_stiffness(self.mesh, np.asarray(self.element_matrix))

    @cached_property
    def adjoint(self) -> AdjointFields:
        """Adjoint fields of the pad: as stored, or else computed once.

        Raises ConvergenceError where the inner nodes cannot be solved for.
        """
        if self.stored_adjoint is not None:
            return stored_fields(self.mesh, self.stored_adjoint)
        return adjoint_fields(pad_system(self.mesh, np.asarray(self.element_matrix)))

    def with_adjoint(self) -> Bundle:
        """The bundle with its adjoint fields stored. Raises as `adjoint`."""
        return replace(self, stored_adjoint=self.adjoint.forces)

    def with_gel(self, material: Material, thickness_ratio: float = 1.0) -> Bundle:
        """The same sensor with a gel of another material and thickness.

        Cells change in height alone, so that nodes, markers and camera keep their order. The ladder
        is that of the gel as designed. The geometry hash is another where the thickness is.

        Args:
            material: The gel.
            thickness_ratio: Thickness over that of this bundle, > 0.

        Raises:
            MeshError: The ratio is not positive and finite.
        """
        mesh = self.mesh.stretched(thickness_ratio)
        matrix = hex8_stiffness(mesh.cell_size_mm, material, self.formulation)
        return replace(
            self,
            mesh=mesh,
            material=material,
            element_matrix=matrix,
            stiffness=None,
            stored_adjoint=None,
            self_test=self.self_test.on(mesh, matrix),
        )

    @property
    def times_key(self) -> str:
        """Key of this sensor's operators among the measured times of a machine."""
        parts = f"{self.geometry_hash}|{self.material}|{self.formulation}"
        return f"operators-{hashlib.sha256(parts.encode()).hexdigest()[:32]}"

    @cached_property
    def geometry_hash(self) -> str:
        """SHA-256 of pad lattice and marker positions; see `geometry_hash`."""
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
    outline: RoundedRectangle | None = None,
    tolerances: Mapping[str, float] | None = None,
    light: Mapping[str, ArrayLike] | None = None,
    skin: Skin | None = None,
    imported: Imported | None = None,
) -> Bundle:
    """Make the bundle of one sensor.

    Args:
        mesh: The cropped pad.
        material: The gel.
        formulation: "full" (the element of the GelSlim 2.0 paper), "bbar" or "incompatible".
        marker_positions_mm: (k, 2) or (k, 3) in the sensor frame.
        marker_arrays: Further arrays of length k by name.
        camera: Camera parameters, a mapping of JSON values.
        spec_hash: SHA-256 of the spec of this sensor.
        with_stiffness: Whether the stiffness matrix is stored.
        ladder: Measured surface operators of this pad.
        operator: Label of the default rung of the ladder.
        outline: The gel seen from above.
        tolerances: Standard deviations of material and thickness by name.
        light: Arrays of the light on the untouched gel by name.
        skin: Coat and fabric on the gel.
        imported: What is known of a sensor that was not generated.

    Returns:
        The bundle.

    Raises:
        IfemError: The markers do not determine a field, a marker array has another length, or the
            camera is not plain JSON.
    """
    plain_camera = _plain_json(camera or {})
    matrix = hex8_stiffness(mesh.cell_size_mm, material, formulation)
    return Bundle(
        mesh=mesh,
        material=material,
        formulation=formulation,
        element_matrix=matrix,
        stiffness=mesh_stiffness(mesh, matrix) if with_stiffness else None,
        markers=marker_field(mesh, marker_positions_mm, marker_arrays),
        camera=plain_camera,
        self_test=SelfTest.drawn(mesh, matrix),
        spec_hash=spec_hash,
        ladder=ladder,
        operator=operator,
        outline=outline,
        tolerances=_plain_json(tolerances or {}),
        light={name: np.asarray(values) for name, values in (light or {}).items()},
        skin=skin,
        imported=imported,
    )


def geometry_hash(mesh: PadMesh, markers: MarkerField | None) -> str:
    """SHA-256 of what distinguishes pads: lattice, occupancy and marker positions.

    Lengths are rounded to 1e-9 mm, so that rounding differences between machines do not matter.
    Material and camera are not included, because both may be recalibrated on the same pad.
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


def _plain_json(camera: Mapping[str, Any]) -> dict[str, Any]:
    """The mapping as it is read back from JSON, where tuples become lists."""
    try:
        plain: dict[str, Any] = json.loads(json.dumps(dict(camera), allow_nan=False))
    except (TypeError, ValueError) as error:
        raise IfemError(
            f"camera is not plain JSON ({error}): use only finite numbers, text, lists and maps",
            field="camera",
        ) from error
    return plain
