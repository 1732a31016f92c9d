"""Rules on printing, casting and marking."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.markers.process import MARKING_PROCESSES

LONGEST_BRIDGE_MM = {"sla": 60.0, "fdm": 30.0, "sls": 1e9}
"""The roof of the camera chamber is printed as a bridge, which sags in FDM beyond about 30 mm."""


@rule(
    "print.overhang_mm",
    title="Widest bridge when printed",
    parameter="manufacturing.print_process",
    why="the roof over the camera chamber is printed as a bridge",
    advice="print with supports, or by sla or sls",
)
def overhang(
    finger_width_mm: Real, housing_side_wall_mm: Real, manufacturing_print_process: str
) -> Finding:
    """Inner width of the chamber."""
    bridge = finger_width_mm - 2 * housing_side_wall_mm
    return Finding(bridge, LONGEST_BRIDGE_MM[manufacturing_print_process], advisory=True)


@rule(
    "mould.cure",
    title="Mould material lets the gel cure",
    parameter="manufacturing.mould_process",
    why="uncured resin of a printed mould stops platinum silicone from curing",
    advice="coat the mould (acrylic lacquer), post-cure it well, or make it of acrylic",
)
def mould_cure(manufacturing_mould_process: str) -> Finding:
    """Value 1 where the material of the mould inhibits the cure of the silicone."""
    return Finding(1.0 if manufacturing_mould_process == "sla" else 0.0, 0.0, advisory=True)


@rule(
    "mould.gel_mm",
    title="Gel can be cast",
    parameter="design.gel.thickness_mm",
    why="thinner layers tear when they leave the mould",
    advice="use a thicker gel",
)
def mould_gel(gel_thickness_mm: Real) -> Finding:
    """Gel thickness."""
    return Finding(gel_thickness_mm, 0.5, least=True, caution=1.0)


@rule(
    "mould.shrinkage_percent",
    title="Shrinkage is that of a platinum silicone",
    parameter="manufacturing.gel_shrinkage_percent",
    why="platinum-cure silicone shrinks by about 0.1 %",
    advice="measure the shrinkage of your gel",
)
def shrinkage(manufacturing_gel_shrinkage_percent: Real) -> Finding:
    """Linear shrinkage."""
    return Finding(manufacturing_gel_shrinkage_percent, 2.0, advisory=True)


@rule(
    "gel.crown_mm",
    title="Crown is shallow",
    parameter="design.gel.crown_height_mm",
    why="optics and mesh take the marked surface as nearly flat",
    advice="use a lower crown",
)
def crown(gel_crown_height_mm: Real, gel_length_mm: Real, gel_width_mm: Real) -> Finding:
    """Height of the crown against a sixth of the shorter side."""
    side = np.minimum(gel_length_mm, gel_width_mm)
    return Finding(gel_crown_height_mm, side / 6, caution=side / 20)


@rule(
    "marker.pitch_ratio",
    title="Marker pitch in diameters",
    parameter="design.markers.pitch_mm",
    why="closer dots merge under blur and are mistaken for one another",
    advice="use a larger pitch or smaller dots",
    of_markers=True,
)
def marker_pitch(markers_pitch_mm: Real, markers_diameter_mm: Real) -> Finding:
    """Pitch over diameter."""
    return Finding(markers_pitch_mm / markers_diameter_mm, 2.0, least=True, tolerance=1e-9)


@rule(
    "marker.diameter_mm",
    title="Marker diameter can be made",
    parameter="design.markers.diameter_mm",
    why="the marking process resolves nothing smaller",
    advice="use larger dots or another marking process",
    of_markers=True,
)
def marker_diameter(markers_diameter_mm: Real, manufacturing_marking_process: str) -> Finding:
    """Diameter against the smallest that the marking process can make."""
    process = MARKING_PROCESSES[manufacturing_marking_process]
    return Finding(markers_diameter_mm, process.min_diameter_mm, least=True)


@rule(
    "marker.gap_mm",
    title="Gap between markers can be made",
    parameter="design.markers.pitch_mm",
    why="the web between two dots must survive the marking process",
    advice="use a larger pitch or another marking process",
    of_markers=True,
)
def marker_gap(
    markers_pitch_mm: Real, markers_diameter_mm: Real, manufacturing_marking_process: str
) -> Finding:
    """Gap between dots, also next to a larger anchor, against the smallest of the process."""
    process = MARKING_PROCESSES[manufacturing_marking_process]
    gap = markers_pitch_mm - 1.25 * markers_diameter_mm
    return Finding(gap, process.min_gap_mm, least=True)


@rule(
    "marker.inside_mm",
    title="Markers lie inside the gel",
    parameter="design.markers.edge_margin_mm",
    why="a dot over the edge is neither printed nor seen whole",
    advice="use fewer rows or columns, or a smaller pitch",
    of_markers=True,
)
def marker_inside(
    gel_length_mm: Real,
    gel_width_mm: Real,
    marker_grid_span_x_mm: Real,
    marker_grid_span_y_mm: Real,
    markers_diameter_mm: Real,
) -> Finding:
    """Gel beyond the outermost dots, without the dots that would cross a rounded corner."""
    beyond = np.minimum(gel_length_mm - marker_grid_span_x_mm, gel_width_mm - marker_grid_span_y_mm)
    return Finding(
        beyond / 2 - markers_diameter_mm / 2, 0.0, least=True, caution=0.1, tolerance=1e-9
    )


@rule(
    "marker.corner_mm",
    title="Corner markers lie inside the rounded corners",
    parameter="design.gel.corner_radius_mm",
    why="dots that cross the rounded corner are left out of the print",
    advice="use a smaller corner radius, or a wider edge margin",
    of_markers=True,
)
def marker_corner(
    gel_length_mm: Real,
    gel_width_mm: Real,
    gel_corner_radius_mm: Real,
    marker_grid_span_x_mm: Real,
    marker_grid_span_y_mm: Real,
    markers_diameter_mm: Real,
) -> Finding:
    """Gel beyond the dot in the corner of the lattice, measured along the corner's radius."""
    to_x = (gel_length_mm - marker_grid_span_x_mm) / 2
    to_y = (gel_width_mm - marker_grid_span_y_mm) / 2
    dx, dy = gel_corner_radius_mm - to_x, gel_corner_radius_mm - to_y
    rounded = gel_corner_radius_mm - np.hypot(np.maximum(dx, 0), np.maximum(dy, 0))
    beyond = np.where((dx > 0) & (dy > 0), rounded, np.minimum(to_x, to_y))
    room = beyond - markers_diameter_mm / 2
    return Finding(room, 0.0, least=True, advisory=True, tolerance=1e-9)


@rule(
    "marker.lattice",
    title="Lattice carries anchors",
    parameter="design.markers.rows",
    why="anchors need at least five rows and columns; without them tracking can slip by a pitch",
    advice="use a smaller pitch, more markers, or anchors: none",
    of_markers=True,
)
def marker_lattice(
    marker_grid_rows: Real, marker_grid_columns: Real, markers_anchors: str
) -> Finding:
    """Number of dots along the shorter side of the lattice."""
    least = 2 if markers_anchors == "none" else 5
    return Finding(np.minimum(marker_grid_rows, marker_grid_columns), least, least=True, caution=8)


@rule(
    "marker.anchors",
    title="Anchors are printed",
    parameter="design.markers.anchors",
    why="a plain grid looks the same after a slip of one pitch",
    advice="use odd_sized or omitted anchors",
    of_markers=True,
)
def marker_anchors(markers_anchors: str) -> Finding:
    """Value 1 where the lattice has anchors."""
    return Finding(0.0 if markers_anchors == "none" else 1.0, 1.0, least=True, advisory=True)
