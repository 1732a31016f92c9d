"""Mesh, stiffness and surface operators of the gel pad, and the bundle that stores them.

It works without CAD.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from ifem_export.assembly.assembly import mesh_stiffness
    from ifem_export.bundle.bundle import Bundle, build_bundle
    from ifem_export.bundle.export_matrix import export_matrix
    from ifem_export.bundle.files import load_bundle, summarise_bundle, write_bundle
    from ifem_export.elements.hex8 import hex8_stiffness
    from ifem_export.elements.material import Material
    from ifem_export.errors import BundleError, IfemError
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

__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "Bundle": "ifem_export.bundle.bundle",
        "BundleError": "ifem_export.errors",
        "IfemError": "ifem_export.errors",
        "MarkerGrid": "ifem_export.markers.grid",
        "Material": "ifem_export.elements.material",
        "NeoHookeanPad": "ifem_export.finite_strain.neo_hookean",
        "OperatorLadder": "ifem_export.operators.operator_ladder",
        "PadMesh": "ifem_export.mesh.pad_mesh",
        "Paraboloid": "ifem_export.mesh.crown",
        "RoundedRectangle": "ifem_export.mesh.outline",
        "SurfaceOperator": "ifem_export.operators.surface_operator",
        "build_bundle": "ifem_export.bundle.bundle",
        "build_marker_grid": "ifem_export.markers.grid",
        "build_pad_mesh": "ifem_export.mesh.pad_mesh",
        "export_matrix": "ifem_export.bundle.export_matrix",
        "hex8_stiffness": "ifem_export.elements.hex8",
        "load_bundle": "ifem_export.bundle.files",
        "marker_to_node": "ifem_export.markers.interpolation",
        "masked_force": "ifem_export.inverse.contact_inverse",
        "measure_ladder": "ifem_export.operators.ladder",
        "mesh_stiffness": "ifem_export.assembly.assembly",
        "summarise_bundle": "ifem_export.bundle.files",
        "surface_operator": "ifem_export.operators.surface_operator",
        "write_bundle": "ifem_export.bundle.files",
        "write_vtu": "ifem_export.mesh.vtu",
    },
)
