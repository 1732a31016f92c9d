"""Checks that the parts of a bundle agree: values, indices, mesh and self-test pair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.assembly.assembly import corner_fill
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.layout import bundle_arrays
from ifem_export.bundle.manifest import REBUILD
from ifem_export.bundle.self_test import elementwise_force
from ifem_export.errors import BundleError, IfemError
from ifem_export.markers.field import MarkerField
from ifem_export.markers.thin_plate import affine
from ifem_export.mesh.crown import column_tops
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.adjoint_fields import rigid_motions

_SELF_TEST_TOLERANCE = 1e-10
_ROW_TOLERANCE = 1e-9
_ADJOINT_TOLERANCE = 1e-6


def check_bundle(bundle: Bundle) -> None:
    """Check that every part of the bundle agrees with the others.

    Raises:
        BundleError: A part is damaged or does not agree with the others.
    """
    _check_finite(bundle)
    _check_mesh(bundle.mesh)
    if bundle.stiffness is not None:
        _check_csr("stiffness", bundle.stiffness)
    _check_markers(bundle.markers)
    _check_self_test(bundle)


def _fail(array: str, reason: str) -> None:
    raise BundleError(f"{array}.npy", reason, REBUILD)


def _check_finite(bundle: Bundle) -> None:
    for name, array in bundle_arrays(bundle).items():
        if array.dtype.kind == "f":
            bad = int(array.size - np.isfinite(array).sum())
            if bad:
                _fail(name, f"holds {bad} values that are not finite")


def _check_mesh(mesh: PadMesh) -> None:
    try:
        built = PadMesh.from_occupancy(
            np.asarray(mesh.occupancy), mesh.cell_size_mm, mesh.origin_mm
        )
        if mesh.surface_shift is not None:
            built = replace(built, surface=_stored_surface(mesh))
    except BundleError:
        raise
    except IfemError as error:
        raise BundleError("occupancy.npy", str(error), REBUILD) from error
    if mesh.fill is not None:
        try:
            corner_fill(np.asarray(mesh.occupancy), np.asarray(mesh.fill))
        except IfemError as error:
            raise BundleError("cell_fill.npy", str(error), REBUILD) from error
        if np.asarray(mesh.fill).max() > 1.0 + 1e-12:
            _fail("cell_fill", "holds a fraction above 1")
    for name, array in (
        ("hexes", "hexes"),
        ("bonded", "bonded_nodes"),
        ("surface", "surface_nodes"),
        ("sides", "side_nodes"),
    ):
        if not np.array_equal(getattr(mesh, name), getattr(built, name)):
            _fail(array, "does not follow from the occupancy")
    size = max(mesh.cell_size_mm)
    if (
        mesh.nodes_mm.shape != built.nodes_mm.shape
        or np.abs(mesh.nodes_mm - built.nodes_mm).max() > 1e-9 * size
    ):
        _fail("nodes_mm", "does not follow from the occupancy and cell size")


def _stored_surface(mesh: PadMesh) -> NDArray[np.int32]:
    """Surface nodes of a crowned mesh, after checking that there is one per column."""
    shift = np.asarray(mesh.surface_shift)
    if shift.shape != np.asarray(mesh.surface).shape:
        _fail("surface_shift", f"holds {shift.size} heights for {len(mesh.surface)} surface nodes")
    if not (np.isfinite(shift).all() and (np.abs(shift) <= 0.5).all()):
        _fail("surface_shift", "a height is outside -1/2 to 1/2")
    nodes = np.asarray(mesh.surface)
    if nodes.min() < 0 or nodes.max() >= mesh.n_nodes:
        _fail("surface_nodes", "a node number is out of range")
    numbering = mesh.numbering
    k, j, i = np.unravel_index(numbering.positions[nodes], numbering.shape)
    tops = column_tops(np.asarray(mesh.occupancy), numbering)
    if len(nodes) != (tops >= 0).sum() or len(np.unique(j * tops.shape[1] + i)) != len(nodes):
        _fail("surface_nodes", "does not follow from the occupancy: one per column")
    top = tops[j, i]
    if (k < 1).any() or ((k == top) & (shift > 0.0)).any() or (np.diff(nodes) <= 0).any():
        _fail("surface_nodes", "does not follow from the occupancy: off its columns")
    return nodes


def _check_markers(markers: MarkerField | None) -> None:
    if markers is None:
        return
    _check_csr("interpolation", markers.to_surface)
    rows = np.asarray(markers.to_surface.sum(axis=1)).reshape(-1)
    if np.abs(rows - 1.0).max() > _ROW_TOLERANCE:
        _fail("interpolation_data", "rows do not sum to one")
    if markers.spline is None:
        return
    to_nodes, bending = markers.spline.to_nodes, markers.spline.bending
    if np.abs(to_nodes.sum(axis=1) - 1.0).max() > _ROW_TOLERANCE:
        _fail("thin_plate", "rows do not sum to one")
    # The values of lost markers rely on this form: symmetric and zero on affine fields.
    planes = affine(np.asarray(markers.positions_mm)[:, :2])
    scale = np.abs(bending).max()
    deviation = np.abs(bending @ planes).max() / np.abs(planes).max()
    asymmetry = np.abs(bending - bending.T).max()
    if max(asymmetry, deviation) > _ROW_TOLERANCE * scale:
        _fail("thin_plate_bending", "is not the bending energy of a spline through the markers")


def check_adjoint(bundle: Bundle) -> None:
    """Raise BundleError for adjoint fields that belong to no stiffness.

    The work of one rigid motion's forces in another is symmetric, and that in itself positive.
    """
    if bundle.stored_adjoint is None:
        return
    motions = rigid_motions(np.asarray(bundle.mesh.surface_mm)).reshape(6, -1)
    work = np.asarray(bundle.stored_adjoint).reshape(6, -1) @ motions.T
    size = np.sqrt(np.abs(np.diag(work)))
    scaled = work / np.outer(size, size) if size.all() else work
    if np.abs(scaled - scaled.T).max() > _ADJOINT_TOLERANCE:
        _fail("adjoint_fields", "are not forces of a symmetric stiffness")
    if np.linalg.eigvalsh((scaled + scaled.T) / 2).min() <= 0.0:
        _fail("adjoint_fields", "give a rigid motion work that is not positive")


def _check_csr(name: str, matrix: sparse.csr_array) -> None:
    """Raise BundleError for indices with which a product would read outside the arrays."""
    steps = np.diff(matrix.indptr)
    if matrix.indptr[0] != 0 or matrix.indptr[-1] != len(matrix.indices) or (steps < 0).any():
        _fail(f"{name}_indptr", "row pointers are out of order")
    if len(matrix.indices) and (
        matrix.indices.min() < 0 or matrix.indices.max() >= matrix.shape[1]
    ):
        _fail(f"{name}_indices", "a column index is out of range")


def _check_self_test(bundle: Bundle) -> None:
    u = np.asarray(bundle.self_test.displacement_mm)
    stored = np.asarray(bundle.self_test.force_n)
    scale = np.abs(stored).max()
    if not scale > 0.0:
        _fail("self_test_force_n", "is zero everywhere")
    found = elementwise_force(bundle.mesh, np.asarray(bundle.element_matrix), u)
    error = np.abs(found - stored).max() / scale
    if error > _SELF_TEST_TOLERANCE:
        _fail("self_test_force_n", f"the elements give other forces, by {error:.2g}")
    if bundle.stiffness is None:
        return
    found = (bundle.stiffness @ u.reshape(-1)).reshape(-1, 3)
    error = np.abs(found - stored).max() / scale
    if error > _SELF_TEST_TOLERANCE:
        _fail("stiffness_data_n_per_mm", f"K gives other forces than its elements, by {error:.2g}")
