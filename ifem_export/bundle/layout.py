"""Conversion between the parts of a bundle and its named arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.bundle.bundle import ELEMENT_MATRIX, Bundle
from ifem_export.bundle.imported import Imported
from ifem_export.bundle.manifest import ADJOINT_VERSION, MANIFEST, REBUILD
from ifem_export.bundle.self_test import SelfTest
from ifem_export.elements.material import Material
from ifem_export.elements.skin import Skin
from ifem_export.errors import BundleError, IfemError
from ifem_export.markers.field import MarkerField
from ifem_export.markers.thin_plate import ThinPlate
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.operator_ladder import OperatorLadder


def bundle_arrays(bundle: Bundle) -> dict[str, NDArray[Any]]:
    """Every array of a bundle by the name under which it is stored."""
    mesh = bundle.mesh
    arrays: dict[str, Any] = {
        "nodes_mm": mesh.nodes_mm,
        "hexes": mesh.hexes,
        "occupancy": mesh.occupancy,
        "bonded_nodes": mesh.bonded,
        "free_nodes": mesh.free,
        "surface_nodes": mesh.surface,
        "side_nodes": mesh.sides,
        ELEMENT_MATRIX: bundle.element_matrix,
        "self_test_displacement_mm": bundle.self_test.displacement_mm,
        "self_test_force_n": bundle.self_test.force_n,
    }
    if mesh.fill is not None:
        arrays["cell_fill"] = mesh.fill
    if mesh.surface_shift is not None:
        arrays["surface_shift"] = mesh.surface_shift
    if bundle.stiffness is not None:
        arrays["stiffness_data_n_per_mm"] = bundle.stiffness.data
        arrays["stiffness_indices"] = bundle.stiffness.indices
        arrays["stiffness_indptr"] = bundle.stiffness.indptr
    if bundle.markers is not None:
        arrays["marker_positions_mm"] = bundle.markers.positions_mm
        arrays["interpolation_data"] = bundle.markers.to_surface.data
        arrays["interpolation_indices"] = bundle.markers.to_surface.indices
        arrays["interpolation_indptr"] = bundle.markers.to_surface.indptr
        if bundle.markers.spline is not None:
            arrays["thin_plate"] = bundle.markers.spline.to_nodes
            arrays["thin_plate_bending"] = bundle.markers.spline.bending
        for name, values in bundle.markers.arrays.items():
            arrays[f"marker_{name}"] = values
    if bundle.stored_adjoint is not None:
        arrays["adjoint_fields"] = bundle.stored_adjoint
    for name, values in bundle.light.items():
        arrays[f"light_{name}"] = values
    return arrays


def bundle_from(
    manifest: dict[str, Any],
    arrays: dict[str, NDArray[Any]],
    ladder: tuple[OperatorLadder | None, str] = (None, ""),
) -> Bundle:
    """Make a bundle from its manifest and the opened arrays; only the element's values are read.

    Raises:
        BundleError: A section or array is missing or does not fit the others.
    """
    take = _Arrays(arrays)
    with _told_as_malformed():
        material = Material(**manifest["material"])
        formulation = manifest["element"]["formulation"]
        has_stiffness = bool(manifest["stiffness"]["stored"])
    mesh = _mesh_from(manifest, take)
    n = mesh.n_nodes
    with _told_as_damaged():
        return Bundle(
            mesh=mesh,
            material=material,
            formulation=formulation,
            element_matrix=take(ELEMENT_MATRIX, "<f8", (24, 24)),
            stiffness=take.csr("stiffness", "stiffness_data_n_per_mm", (3 * n, 3 * n))
            if has_stiffness
            else None,
            markers=_markers_from(manifest, take, len(mesh.surface)),
            camera=manifest["camera"],
            self_test=SelfTest(
                take("self_test_displacement_mm", "<f8", (n, 3)),
                take("self_test_force_n", "<f8", (n, 3)),
            ),
            spec_hash=manifest["spec_hash"],
            ladder=ladder[0],
            operator=ladder[1],
            outline=_outline_from(manifest),
            tolerances=dict(manifest.get("tolerances") or {}),
            light={name: take(f"light_{name}") for name in manifest.get("light") or ()},
            stored_adjoint=_adjoint_from(manifest, take, len(mesh.surface)),
            skin=_skin_from(manifest),
            imported=_imported_from(manifest),
        )


@contextmanager
def _told_as_damaged() -> Iterator[None]:
    """Raise BundleError where the element matrix is not that of mesh and material."""
    try:
        yield
    except BundleError:
        raise
    except IfemError as error:
        file = f"{ELEMENT_MATRIX}.npy" if error.field == ELEMENT_MATRIX else MANIFEST
        raise BundleError(file, str(error), REBUILD) from error


@contextmanager
def _told_as_malformed() -> Iterator[None]:
    """Raise BundleError where a section of the manifest lacks a value or has a wrong one."""
    try:
        yield
    except (KeyError, TypeError, ValueError) as error:
        reason = str(error) if isinstance(error, IfemError) else f"is malformed ({error!r})"
        raise BundleError(MANIFEST, reason, REBUILD) from error


def _mesh_from(manifest: dict[str, Any], take: _Arrays) -> PadMesh:
    """The mesh, whose arrays must fit the sizes that the manifest states."""
    with _told_as_malformed():
        section = manifest["mesh"]
        size = tuple(float(v) for v in section["cell_size_mm"])
        origin = tuple(float(v) for v in section["origin_mm"])
        n, m = int(section["nodes"]), int(section["elements"])
        cells = tuple(int(c) for c in section["cells"])
        weighted = bool(section.get("weighted", False))
        crowned = bool(section.get("crowned", False))
    if len(size) != 3 or len(origin) != 3:
        raise BundleError(MANIFEST, "cell_size_mm and origin_mm must have 3 values", REBUILD)
    mesh = PadMesh(
        nodes_mm=take("nodes_mm", "<f8", (n, 3)),
        hexes=take("hexes", "<i4", (m, 8)),
        bonded=take("bonded_nodes", "<i4", (None,)),
        surface=take("surface_nodes", "<i4", (None,)),
        sides=take("side_nodes", "<i4", (None,)),
        cell_size_mm=(size[0], size[1], size[2]),
        origin_mm=(origin[0], origin[1], origin[2]),
        occupancy=take("occupancy", "|b1", cells),
        fill=take("cell_fill", "<f8", cells) if weighted else None,
        surface_shift=take("surface_shift", "<f8", (None,)) if crowned else None,
    )
    take("free_nodes", "<i4", (n - len(mesh.bonded),))
    return mesh


def _skin_from(manifest: dict[str, Any]) -> Skin | None:
    """Coat and fabric; None for bundles without."""
    record = manifest.get("skin")
    if record is None:
        return None
    try:
        return Skin.from_record(record)
    except (KeyError, TypeError, IfemError) as error:
        raise BundleError(MANIFEST, f"section 'skin' is malformed ({error})", REBUILD) from error


def _imported_from(manifest: dict[str, Any]) -> Imported | None:
    """Where the knowledge of an imported sensor comes from; None for a generated one."""
    record = manifest.get("imported")
    if record is None:
        return None
    try:
        return Imported.from_record(record)
    except (KeyError, TypeError, ValueError, IfemError) as error:
        reason = f"section 'imported' is malformed ({error})"
        raise BundleError(MANIFEST, reason, "import the sensor again") from error


def _adjoint_from(
    manifest: dict[str, Any], take: _Arrays, n_surface: int
) -> NDArray[np.float64] | None:
    """Stored adjoint fields; None for bundles without, or with those of another version."""
    section = manifest.get("adjoint")
    if not isinstance(section, dict) or section.get("version") != ADJOINT_VERSION:
        return None
    fields: NDArray[np.float64] = take("adjoint_fields", "<f8", (6, n_surface, 3))
    return fields


def _outline_from(manifest: dict[str, Any]) -> RoundedRectangle | None:
    section = manifest.get("outline")
    if section is None:
        return None
    try:
        return RoundedRectangle(**section)
    except (TypeError, IfemError) as error:
        raise BundleError(MANIFEST, f"section 'outline': {error}", REBUILD) from error


def _markers_from(manifest: dict[str, Any], take: _Arrays, n_surface: int) -> MarkerField | None:
    section = manifest["markers"]
    if section is None:
        return None
    count, names = section.get("count"), section.get("arrays")
    if not isinstance(count, int) or not isinstance(names, list):
        raise BundleError(MANIFEST, "section 'markers' is malformed", REBUILD)
    spline = None
    if section.get("thin_plate"):
        spline = ThinPlate(
            take("thin_plate", "<f8", (n_surface, count)),
            take("thin_plate_bending", "<f8", (count, count)),
        )
    return MarkerField(
        positions_mm=take("marker_positions_mm", "<f8", (count, None)),
        to_surface=take.csr("interpolation", "interpolation_data", (n_surface, count)),
        arrays={name: take(f"marker_{name}") for name in names},
        spline=spline,
    )


class _Arrays:
    """The arrays of a bundle, each checked for presence, type and shape when it is requested."""

    def __init__(self, arrays: dict[str, NDArray[Any]]) -> None:
        self._arrays = arrays

    def __call__(
        self, name: str, dtype: str | None = None, shape: tuple[int | None, ...] | None = None
    ) -> Any:
        array = self._arrays.get(name)
        if array is None:
            raise BundleError(f"{name}.npy", "is not listed in the manifest", REBUILD)
        fits = shape is None or (
            array.ndim == len(shape)
            and all(w in (None, s) for w, s in zip(shape, array.shape, strict=True))
        )
        if not fits or (dtype is not None and array.dtype.str != dtype):
            raise BundleError(
                f"{name}.npy",
                f"holds {array.dtype} {array.shape}, expected {dtype} {shape}",
                REBUILD,
            )
        return array

    def csr(self, name: str, data: str, shape: tuple[int, int]) -> sparse.csr_array:
        """A sparse matrix on the mapped arrays, which are neither copied nor read."""
        values = self(data, "<f8", (None,))
        indices = self(f"{name}_indices", None, (len(values),))
        indptr = self(f"{name}_indptr", indices.dtype.str, (shape[0] + 1,))
        if indices.dtype.str not in ("<i4", "<i8"):
            raise BundleError(f"{name}_indices.npy", "must hold 32- or 64-bit integers", REBUILD)
        if indptr[0] != 0 or indptr[-1] != len(values):
            raise BundleError(f"{name}_indptr.npy", "does not span the values", REBUILD)
        matrix = sparse.csr_array((values, indices, indptr), shape=shape, copy=False)
        matrix.has_sorted_indices = True
        matrix.has_canonical_format = True
        return matrix
