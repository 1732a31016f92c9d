"""Rules on gel mechanics, mesh and the finger's envelope."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.spec.spec import STIFF_GEL_MPA

MOST_NODES = 400_000


@rule(
    "gel.modulus_mpa",
    title="Gel stiffness is that of a tactile gel",
    parameter="material.gel.youngs_modulus_mpa",
    why="above 1 MPa a pad hardly deforms under a grasp, and no tactile gel is above 5 MPa",
    advice="check the unit: tactile gels have 0.05 to 1 MPa",
    unit="MPa",
)
def gel_modulus(material_gel_youngs_modulus_mpa: Real, material_allow_stiff_gel: bool) -> Finding:
    """Young's modulus against the upper limit, unless the spec allows a stiffer gel."""
    limit = np.inf if material_allow_stiff_gel else STIFF_GEL_MPA
    return Finding(material_gel_youngs_modulus_mpa, limit, caution=1.0)


@rule(
    "gel.too_soft_mpa",
    title="Gel is firm enough to handle",
    parameter="material.gel.youngs_modulus_mpa",
    why="below 0.02 MPa a gel tears and creeps",
    advice="check the unit: tactile gels have 0.05 to 1 MPa",
    unit="MPa",
)
def gel_soft(material_gel_youngs_modulus_mpa: Real) -> Finding:
    """Young's modulus against the lower limit of tactile gels."""
    return Finding(material_gel_youngs_modulus_mpa, 0.02, least=True, advisory=True)


@rule(
    "mesh.layers",
    title="Layers against Poisson's ratio",
    parameter="mesh.layers",
    why="one bonded layer locks as Poisson's ratio nears 0.5, whatever the element",
    advice="use at least two layers (four for a good field) and the bbar or incompatible element",
    of_markers=True,
)
def mesh_layers(mesh_layers: Real, mesh_element: str, material_gel_poissons_ratio: Real) -> Finding:
    """Poisson's ratio against the largest that layers and element can represent."""
    one = np.asarray(mesh_layers) <= 1
    full = mesh_element == "full"
    limit = np.where(one, 0.45, 0.48 if full else 0.49995)
    caution = np.where(one, 0.4, 0.45 if full else 0.4999)
    return Finding(material_gel_poissons_ratio, limit, caution=caution)


@rule(
    "mesh.alignment_mm",
    title="Mesh nodes meet the markers",
    parameter="mesh.nodes_per_marker_pitch",
    why="where they do not, displacements are interpolated between markers",
    advice="use nodes_per_marker_pitch instead of cell counts",
    of_markers=True,
)
def mesh_alignment(pad_mesh_alignment_mm: Real) -> Finding:
    """Largest distance of a marker line to a node line."""
    return Finding(pad_mesh_alignment_mm, 0.0, advisory=True, tolerance=1e-6)


@rule(
    "mesh.aspect",
    title="Cell aspect ratio",
    parameter="mesh.layers",
    why="flat or tall cells cost accuracy and condition",
    advice="change layers or cell size",
    of_markers=True,
)
def mesh_aspect(
    pad_mesh_cell_x_mm: Real, pad_mesh_cell_y_mm: Real, pad_mesh_cell_z_mm: Real
) -> Finding:
    """Ratio of the longest to the shortest edge of a cell."""
    edges = np.broadcast_arrays(pad_mesh_cell_x_mm, pad_mesh_cell_y_mm, pad_mesh_cell_z_mm)
    ratio = np.maximum.reduce(edges) / np.minimum.reduce(edges)
    return Finding(ratio, 50.0, caution=5.0)


@rule(
    "mesh.crown_mm",
    title="Rim of a crowned gel holds a layer",
    parameter="mesh.layers",
    why="every column of the mesh needs a whole cell under the gel's surface",
    advice="use more layers, a thicker gel or a lower crown",
    of_markers=True,
)
def mesh_crown(
    gel_thickness_mm: Real, gel_crown_height_mm: Real, pad_mesh_cell_z_mm: Real
) -> Finding:
    """Thickness of the gel at its rim against the height of a cell."""
    crowned = np.asarray(gel_crown_height_mm) > 0
    least = np.where(crowned, pad_mesh_cell_z_mm, 0.0)
    return Finding(gel_thickness_mm, least, least=True, tolerance=1e-9)


@rule(
    "mesh.size",
    title="Mesh stays manageable",
    parameter="mesh.nodes_per_marker_pitch",
    why="the stiffness matrix takes about 2 kB per node",
    advice="use fewer cells or layers",
    unit="nodes",
    of_markers=True,
)
def mesh_size(pad_mesh_box_node_count: Real) -> Finding:
    """Number of nodes of the pad mesh."""
    return Finding(pad_mesh_box_node_count, MOST_NODES, caution=100_000)


@rule(
    "finger.thickness_mm",
    title="Finger is thin enough",
    parameter="design.envelope.max_thickness_mm",
    why="the envelope of the gripper",
    advice="relax what binds the thickness, as `gelslim check` lists it, or allow more",
)
def thickness(finger_thickness_mm: Real, envelope_max_thickness_mm: Real | None) -> Finding:
    """Thickness against its limit."""
    return _envelope(finger_thickness_mm, envelope_max_thickness_mm)


@rule(
    "finger.width_mm",
    title="Finger is narrow enough",
    parameter="design.envelope.max_width_mm",
    why="the envelope of the gripper",
    advice="narrow the gel, use a smaller bend radius ratio or thinner acrylic",
)
def width(finger_width_mm: Real, envelope_max_width_mm: Real | None) -> Finding:
    """Width against its limit."""
    return _envelope(finger_width_mm, envelope_max_width_mm)


@rule(
    "finger.length_mm",
    title="Finger is short enough",
    parameter="design.envelope.max_length_mm",
    why="the envelope of the gripper",
    advice="shorten the gel or the tongue, or use a wider field of view",
)
def length(finger_length_mm: Real, envelope_max_length_mm: Real | None) -> Finding:
    """Length against its limit."""
    return _envelope(finger_length_mm, envelope_max_length_mm)


def _envelope(value: Real, limit: Real | None) -> Finding:
    return Finding(value, np.inf if limit is None else limit, tolerance=1e-9)
