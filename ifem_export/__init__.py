"""Mesh, stiffness and surface operators of the gel pad, and the bundle that stores them.

It works without CAD.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from ifem_export.assembly.assembly import mesh_stiffness
    from ifem_export.bundle.bundle import Bundle, build_bundle
    from ifem_export.bundle.files import load_bundle, summarise_bundle, write_bundle
    from ifem_export.elements.hex8 import hex8_stiffness
    from ifem_export.elements.material import Material
    from ifem_export.errors import BundleError, IfemError
    from ifem_export.exports.matrix_files import export_matrix
    from ifem_export.exports.solver_files import export_mesh
    from ifem_export.exports.surface_matrices import export_surface_matrix
    from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
    from ifem_export.inverse.contact_inverse import masked_force
    from ifem_export.markers.grid import MarkerGrid, build_marker_grid
    from ifem_export.markers.interpolation import marker_to_node
    from ifem_export.mesh.crown import Paraboloid
    from ifem_export.mesh.outline import RoundedRectangle
    from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
    from ifem_export.mesh.vtu import write_vtu
    from ifem_export.operators.ladder import measure_ladder
    from ifem_export.operators.operator_ladder import OperatorLadder
    from ifem_export.operators.surface_operator import SurfaceOperator, surface_operator

__all__ = [
    "Bundle",
    "BundleError",
    "IfemError",
    "MarkerGrid",
    "Material",
    "NeoHookeanPad",
    "OperatorLadder",
    "PadMesh",
    "Paraboloid",
    "RoundedRectangle",
    "SurfaceOperator",
    "build_bundle",
    "build_marker_grid",
    "build_pad_mesh",
    "export_matrix",
    "export_mesh",
    "export_surface_matrix",
    "hex8_stiffness",
    "load_bundle",
    "marker_to_node",
    "masked_force",
    "measure_ladder",
    "mesh_stiffness",
    "summarise_bundle",
    "surface_operator",
    "write_bundle",
    "write_vtu",
]

__getattr__, __dir__ = lazy_exports(__name__)
