"""Marker grid and pad mesh."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension

ROWS = "given, or ⌊({} - 2 margin - d) / pitch⌋ + 1, not below 0; 0 without markers"


@dimension("marker_grid.rows", formula=ROWS.format("L"))
def marker_grid_rows(
    markers_pattern: str,
    markers_rows: Real | None,
    gel_length_mm: Real,
    markers_edge_margin_mm: Real,
    markers_diameter_mm: Real,
    markers_pitch_mm: Real,
) -> Real:
    """Marker rows along the finger."""
    if markers_pattern == "none":
        return 0.0 * gel_length_mm
    if markers_rows is not None:
        return markers_rows
    return _fill(gel_length_mm, markers_edge_margin_mm, markers_diameter_mm, markers_pitch_mm)


@dimension("marker_grid.columns", formula=ROWS.format("W"))
def marker_grid_columns(
    markers_pattern: str,
    markers_columns: Real | None,
    gel_width_mm: Real,
    markers_edge_margin_mm: Real,
    markers_diameter_mm: Real,
    markers_pitch_mm: Real,
) -> Real:
    """Marker columns across the finger."""
    if markers_pattern == "none":
        return 0.0 * gel_width_mm
    if markers_columns is not None:
        return markers_columns
    return _fill(gel_width_mm, markers_edge_margin_mm, markers_diameter_mm, markers_pitch_mm)


def _fill(side_mm: Real, margin_mm: Real, diameter_mm: Real, pitch_mm: Real) -> Real:
    whole = np.floor((side_mm - 2 * margin_mm - diameter_mm) / pitch_mm + 1e-9) + 1
    return np.maximum(whole, 0.0)


@dimension("marker_grid.span_x_mm", formula="(rows - 1) pitch")
def marker_grid_span_x_mm(marker_grid_rows: Real, markers_pitch_mm: Real) -> Real:
    """Lattice size along the finger, centre to centre."""
    return np.maximum(marker_grid_rows - 1, 0) * markers_pitch_mm


@dimension("marker_grid.span_y_mm", formula="(columns - 1) pitch")
def marker_grid_span_y_mm(marker_grid_columns: Real, markers_pitch_mm: Real) -> Real:
    """Lattice size across the finger, centre to centre."""
    return np.maximum(marker_grid_columns - 1, 0) * markers_pitch_mm


@dimension("pad_mesh.cells_x", formula="given, or 2⌈L / 2h⌉ with the parity of the lattice")
def pad_mesh_cells_x(
    mesh_cells_along: Real | None,
    mesh_nodes_per_marker_pitch: Real,
    gel_length_mm: Real,
    markers_pitch_mm: Real,
    marker_grid_rows: Real,
) -> Real:
    """Mesh cells along the finger."""
    if mesh_cells_along is not None:
        return mesh_cells_along
    return _cells(gel_length_mm, markers_pitch_mm, mesh_nodes_per_marker_pitch, marker_grid_rows)


@dimension("pad_mesh.cells_y", formula="given, or 2⌈W / 2h⌉ with the parity of the lattice")
def pad_mesh_cells_y(
    mesh_cells_across: Real | None,
    mesh_nodes_per_marker_pitch: Real,
    gel_width_mm: Real,
    markers_pitch_mm: Real,
    marker_grid_columns: Real,
) -> Real:
    """Mesh cells across the finger."""
    if mesh_cells_across is not None:
        return mesh_cells_across
    return _cells(gel_width_mm, markers_pitch_mm, mesh_nodes_per_marker_pitch, marker_grid_columns)


def _cells(side_mm: Real, pitch_mm: Real, per_pitch: Real, markers: Real) -> Real:
    """Cells over at least the gel, centred, with a node on every marker."""
    cell = pitch_mm / per_pitch
    parity = np.mod((markers - 1) * per_pitch, 2)
    return 2 * np.ceil((side_mm / cell - parity) / 2 - 1e-9) + parity


@dimension("pad_mesh.cell_x_mm", formula="pitch / nodes per pitch, or L / given cells")
def pad_mesh_cell_x_mm(
    mesh_cells_along: Real | None,
    gel_length_mm: Real,
    markers_pitch_mm: Real,
    mesh_nodes_per_marker_pitch: Real,
) -> Real:
    """Cell size along the finger."""
    if mesh_cells_along is not None:
        return gel_length_mm / mesh_cells_along
    return markers_pitch_mm / mesh_nodes_per_marker_pitch


@dimension("pad_mesh.cell_y_mm", formula="pitch / nodes per pitch, or W / given cells")
def pad_mesh_cell_y_mm(
    mesh_cells_across: Real | None,
    gel_width_mm: Real,
    markers_pitch_mm: Real,
    mesh_nodes_per_marker_pitch: Real,
) -> Real:
    """Cell size across the finger."""
    if mesh_cells_across is not None:
        return gel_width_mm / mesh_cells_across
    return markers_pitch_mm / mesh_nodes_per_marker_pitch


@dimension("pad_mesh.cell_z_mm", formula="(gel thickness + crown) / layers")
def pad_mesh_cell_z_mm(
    gel_thickness_mm: Real, gel_crown_height_mm: Real, mesh_layers: Real
) -> Real:
    """Cell size through the thickness."""
    return (gel_thickness_mm + gel_crown_height_mm) / mesh_layers


@dimension("pad_mesh.box_node_count", formula="(nx + 1)(ny + 1)(layers + 1), before the crop")
def pad_mesh_box_node_count(
    pad_mesh_cells_x: Real, pad_mesh_cells_y: Real, mesh_layers: Real
) -> Real:
    """Nodes of the uncropped mesh box."""
    return (pad_mesh_cells_x + 1) * (pad_mesh_cells_y + 1) * (mesh_layers + 1)


@dimension("pad_mesh.element_count", formula="nx ny layers, before the crop")
def pad_mesh_element_count(
    pad_mesh_cells_x: Real, pad_mesh_cells_y: Real, mesh_layers: Real
) -> Real:
    """Elements of the uncropped mesh box."""
    return pad_mesh_cells_x * pad_mesh_cells_y * mesh_layers


@dimension(
    "pad_mesh.alignment_mm",
    formula="largest distance of a lattice line to the nearest node line",
)
def pad_mesh_alignment_mm(
    marker_grid_rows: Real,
    marker_grid_columns: Real,
    markers_pitch_mm: Real,
    pad_mesh_cells_x: Real,
    pad_mesh_cells_y: Real,
    pad_mesh_cell_x_mm: Real,
    pad_mesh_cell_y_mm: Real,
) -> Real:
    """How far markers may lie from the nearest mesh node, per axis."""
    worst: Real = 0.0
    for count, cells, cell in (
        (marker_grid_rows, pad_mesh_cells_x, pad_mesh_cell_x_mm),
        (marker_grid_columns, pad_mesh_cells_y, pad_mesh_cell_y_mm),
    ):
        for line in range(8):
            place = ((line - (count - 1) / 2) * markers_pitch_mm) / cell + cells / 2
            worst = np.maximum(worst, np.abs(place - np.round(place)) * cell)
    return worst
