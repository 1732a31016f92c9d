"""Rules on walls, fits and fasteners."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.geometry.fasteners import LENGTHS_MM, SCREW_EDGE_MM, SCREWS

THINNEST_WALL_MM = {
    "sla": (0.6, "thinner cured resin warps on its supports and cracks when a screw is driven"),
    "fdm": (0.8, "two lines of a 0.4 mm nozzle; a single line has no bond across the layer"),
    "sls": (0.7, "thinner sintered walls do not survive depowdering"),
}
"""Smallest wall thickness of each process, with the reason. They are starting values."""
SHEET_MM = 0.05
"""Largest difference of a sheet's thickness from that of the part: that of its own tolerance."""
WINDOW_MPA = 20.0
"""Stress that annealed cast acrylic bears for years without crazing: 15 to 20 MPa is stated by
makers of cast sheet for unglued, clean edges (assumed)."""
SMALLEST_GAP_MM = {"sla": 0.1, "fdm": 0.15, "sls": 0.15}


@rule(
    "wall.thinnest_mm",
    title="Thinnest wall",
    parameter="design.housing.side_wall_mm",
    why="thinner walls break or do not print in this process",
    advice="thicken side wall, back wall, baffle or ledge, whichever is the thinnest",
)
def wall(
    housing_side_wall_mm: Real,
    housing_back_wall_mm: Real,
    housing_baffle_mm: Real,
    housing_ledge_mm: Real,
    manufacturing_print_process: str,
) -> Finding:
    """Smallest of the four wall thicknesses."""
    thinnest = np.minimum.reduce(
        np.broadcast_arrays(
            housing_side_wall_mm, housing_back_wall_mm, housing_baffle_mm, housing_ledge_mm
        )
    )
    limit, why = THINNEST_WALL_MM[manufacturing_print_process]

    def reason() -> str:
        return f"{float(thinnest):.2g} mm, {manufacturing_print_process} needs {limit:g} mm: {why}"

    return Finding(thinnest, limit, least=True, reason=reason)


@rule(
    "fit.clearance_mm",
    title="Fit clearance against printing accuracy",
    parameter="design.housing.fit_clearance_mm",
    why="parts printed this exactly jam with less",
    advice="widen the clearance or print more exactly",
)
def fit(
    housing_fit_clearance_mm: Real,
    manufacturing_print_tolerance_mm: Real,
    manufacturing_print_process: str,
) -> Finding:
    """Clearance against the print tolerance and the smallest gap of the process."""
    least = SMALLEST_GAP_MM[manufacturing_print_process]
    return Finding(
        housing_fit_clearance_mm,
        np.maximum(manufacturing_print_tolerance_mm, 0.05),
        least=True,
        caution=least,
    )


@rule(
    "bezel.thickness_mm",
    title="Bezel holds its countersunk screws",
    parameter="design.housing.gel_proud_mm",
    why="the head must sink into the plate between acrylic and outside",
    advice="let the gel stand less proud, use a thicker gel, or a smaller screw",
)
def bezel_thickness(bezel_thickness_mm: Real, housing_screw: str) -> Finding:
    """Thickness of the plate against the conical head, a cone of 90° down to the thread's core."""
    size = SCREWS[housing_screw]
    cone = (size.countersunk_head_mm - size.pilot_mm) / 2
    return Finding(bezel_thickness_mm, cone, least=True, caution=size.countersunk_height_mm)


@rule(
    "cover.thickness_mm",
    title="Back cover holds its countersunk screws",
    parameter="design.housing.back_wall_mm",
    why="the head must sink into the cover",
    advice="thicken the back wall or use a smaller screw",
)
def cover_thickness(housing_back_wall_mm: Real, housing_screw: str) -> Finding:
    """Thickness of the cover against the height of the screw's head."""
    size = SCREWS[housing_screw]
    return Finding(housing_back_wall_mm, size.countersunk_height_mm, least=True, tolerance=1e-9)


@rule(
    "gel.proud_mm",
    title="Gel stands above the bezel",
    parameter="design.housing.gel_proud_mm",
    why="the gel must touch the object before the bezel does",
    advice="let the gel stand at least 0.2 mm proud",
)
def gel_proud(housing_gel_proud_mm: Real) -> Finding:
    """Height of the gel above the bezel."""
    return Finding(housing_gel_proud_mm, 0.0, least=True, caution=0.2)


@rule(
    "screw.wall_mm",
    title="Screw to wall",
    parameter="design.housing.tip_wall_mm",
    why="a pilot hole too near an edge splits the wall",
    advice="lengthen the tip wall or use a smaller screw",
)
def screw_wall(housing_tip_wall_mm: Real, housing_screw: str) -> Finding:
    """Smallest wall around the pilot hole in the tip block and around the head."""
    size = SCREWS[housing_screw]
    beside = (housing_tip_wall_mm - size.countersunk_head_mm) / 2
    return Finding(beside, 0.3, least=True)


@rule(
    "screw.apart_mm",
    title="Bezel screws stand apart",
    parameter="design.gel.width_mm",
    why="two screws side by side need room for their heads and for the gel's window",
    advice="widen the gel or use a smaller screw",
)
def screw_apart(finger_width_mm: Real, housing_side_wall_mm: Real, housing_screw: str) -> Finding:
    """Distance between the two screws minus the diameter of a head."""
    apart = finger_width_mm - 2 * (housing_side_wall_mm + SCREW_EDGE_MM)
    return Finding(apart - SCREWS[housing_screw].countersunk_head_mm, 1.0, least=True)


@rule(
    "corner.screw_mm",
    title="Tip corners leave room for the screws",
    parameter="design.housing.corner_radius_mm",
    why="a rounded corner cuts into the screw head's seat",
    advice="use a smaller corner radius, a longer tip wall or a smaller screw",
)
def corner_screw(
    housing_corner_radius_mm: Real,
    housing_tip_wall_mm: Real,
    housing_side_wall_mm: Real,
    housing_screw: str,
) -> Finding:
    """Material between the head and the rounded corner."""
    dx = housing_corner_radius_mm - housing_tip_wall_mm / 2
    dy = housing_corner_radius_mm - housing_side_wall_mm - SCREW_EDGE_MM
    inside = np.where(
        (dx > 0) & (dy > 0),
        housing_corner_radius_mm - np.hypot(dx, dy),
        np.minimum(housing_tip_wall_mm / 2, housing_side_wall_mm + SCREW_EDGE_MM),
    )
    return Finding(inside - SCREWS[housing_screw].countersunk_head_mm / 2, 0.2, least=True)


@rule(
    "bezel.stock_mm",
    title="Bezel is made of a sheet on sale",
    parameter="design.housing.gel_proud_mm",
    why="another thickness must be milled",
    advice="change how far the gel stands proud, or print the bezel",
)
def bezel_stock(
    bezel_thickness_mm: Real,
    housing_bezel_material: str,
    manufacturing_metal_stock_mm: tuple[float, ...],
) -> Finding:
    """Distance of the bezel's thickness from the nearest sheet; none for a printed one."""
    sheets = np.asarray(manufacturing_metal_stock_mm)
    away = np.abs(np.asarray(bezel_thickness_mm)[..., None] - sheets).min(axis=-1)
    printed = housing_bezel_material == "printed"
    return Finding(np.where(printed, 0.0, away), SHEET_MM, advisory=True, tolerance=1e-9)


@rule(
    "precompression.tolerance_mm",
    title="Pre-compression that is reached exceeds the tolerance stack",
    parameter="design.housing.bezel_material",
    why="acrylic, print and shims differ by their tolerances, and the bezel bows between its "
    "screws; a loose window tears",
    advice="use a metal bezel, softer or thicker shims, compress more, or measure the acrylic "
    "sheet (tolerance.acrylic: measured)",
)
def precompression_tolerance(
    shim_least_reached_mm: Real,
    precompression_stack_mm: Real,
) -> Finding:
    """Least compression of the shims against the worst case of the tolerances."""
    return Finding(shim_least_reached_mm, precompression_stack_mm, least=True)


@rule(
    "window.stress_mpa",
    title="Bending of the window under its shims",
    parameter="design.housing.shim_hardness_shore_a",
    why="acrylic that is bent for long crazes at its cut edges",
    advice="use softer or narrower shims, or compress less",
)
def window_stress(window_stress_mpa: Real) -> Finding:
    """Upper bound of the bending stress."""
    return Finding(window_stress_mpa, WINDOW_MPA)


@rule(
    "precompression.shim_mm",
    title="Shims keep some thickness",
    parameter="design.housing.shim_thickness_mm",
    why="an elastic sheet cannot be pressed to less than about 40 %",
    advice="use thicker shims or compress less",
)
def precompression_shim(shim_compressed_mm: Real, housing_shim_thickness_mm: Real) -> Finding:
    """Compressed thickness of the shim."""
    return Finding(shim_compressed_mm, 0.4 * housing_shim_thickness_mm, least=True)


@rule(
    "clamp.beside_channel_mm",
    title="Camera clamp clears the LED channels",
    parameter="design.light_guide.bend_radius_ratio",
    why="the clamp stands between the walls that close the channels, or behind them",
    advice="use a larger bend radius, a smaller camera, or a longer gel",
)
def clamp_beside(
    clamp_width_mm: Real,
    baffle_inner_y_mm: Real,
    camera_pose_front_x_mm: Real,
    guide_proximal_end_x_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Finding:
    """Gap between the clamp and the LED channel, at its side or in front of it."""
    beside = baffle_inner_y_mm - clamp_width_mm / 2
    before = guide_proximal_end_x_mm - housing_fit_clearance_mm - 1.2 - camera_pose_front_x_mm
    return Finding(np.maximum(beside, before), 0.15, least=True)


@rule(
    "screw.shortest_mm",
    title="Shortest screws do not come through",
    parameter="design.mount.tongue_thickness_mm",
    why="countersunk screws are sold from 3 mm on; a longer one than its hole hits what is behind",
    advice="use a thicker bezel (thicker gel) or back wall, or a thinner tongue",
)
def screw_shortest(
    bezel_thickness_mm: Real,
    thread_roof_depth_mm: Real,
    thread_tip_depth_mm: Real,
    housing_back_wall_mm: Real,
    thread_land_depth_mm: Real,
) -> Finding:
    """Depth of plate and hole for the screws of bezel and cover."""
    bezel = bezel_thickness_mm + np.minimum(thread_roof_depth_mm, thread_tip_depth_mm)
    cover = housing_back_wall_mm + np.minimum(thread_land_depth_mm, thread_tip_depth_mm)
    return Finding(np.minimum(bezel, cover), LENGTHS_MM[0], least=True)


@rule(
    "clamp.before_seat_mm",
    title="Camera clamp stands clear of the mirror's seat",
    parameter="design.optics.clearance_mm",
    why="clamp and seat are screwed to the same cover",
    advice="give the view more clearance, lengthen the gel, or use a camera with a shorter lens",
)
def clamp_before_seat(
    mirror_seat_x_mm: Real, clamp_front_x_mm: Real, housing_fit_clearance_mm: Real
) -> Finding:
    """Gap between the lips of the clamp and the stop of the mirror's seat."""
    return Finding(mirror_seat_x_mm - clamp_front_x_mm, housing_fit_clearance_mm, least=True)
