"""The view before it is folded: the camera's mirror image straight below the gel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold_problem import Array, FoldProblem, larger, smaller
from gelslim_optics.camera.refraction_newton import apparent_height, choose, newton_slope

LEAST_AIR_MM = 1.0
"""Candidates with less air are laid out with this much, so that the closed forms hold."""
WANTED_AIR_MM = 2.0


class Sight(NamedTuple):
    """What the two ray angles fix; slopes are dx/dz in air."""

    near_ray_rad: Array
    far_ray_rad: Array
    tilt_rad: Array
    air_height_mm: Array
    virtual_x_mm: Array
    virtual_z_mm: Array
    shallowest: Array
    """Slope of the outermost ray on the near side, corners of the gel included."""
    steepest: Array
    """Slope of the outermost ray on the far side."""
    near_corner_across: Array
    """Slope dy/dz of the ray to a near corner."""
    far_corner_across: Array
    corner_horizontal_tan: Array
    corner_vertical_tan: Array


class Distances(NamedTuple):
    """How far the gel seems to be from the camera."""

    near_mm: Array
    """Along the axis, to the near edge."""
    far_mm: Array
    height_mm: Array
    """Along the gel's normal."""


class FieldMissed(NamedTuple):
    """How far the field of view is missed, as parts of it; <= 0 holds."""

    field_of_view_along: Array
    field_of_view_across: Array


class PictureMissed(NamedTuple):
    """How far the other limits of the picture are missed, as parts of their scales."""

    blur: Array
    pixels_per_marker: Array
    keystone: Array
    lens_travel: Array
    air_gap: Array


def near_edge_x_mm(s: Sight, z_mm: Array) -> Array:
    """Where the view's near edge passes the height z."""
    return s.virtual_x_mm + s.shallowest * (z_mm - s.virtual_z_mm)


def far_edge_x_mm(s: Sight, z_mm: Array) -> Array:
    """Where the view's far edge passes the height z."""
    return s.virtual_x_mm + s.steepest * (z_mm - s.virtual_z_mm)


def keystone(d: Distances) -> Array:
    """Ratio of the distances to the two edges, the larger to the smaller."""
    # An axis tilted back makes the far edge the nearer one: limits hold whichever way it leans.
    return larger(d.near_mm, d.far_mm) / smaller(d.near_mm, d.far_mm)


def field_missed(p: FoldProblem, s: Sight) -> FieldMissed:
    """How far the gel reaches out of the picture."""
    return FieldMissed(
        field_of_view_along=s.corner_vertical_tan / p.half_vertical_tan - 1,
        field_of_view_across=s.corner_horizontal_tan / p.half_horizontal_tan - 1,
    )


def picture_missed(p: FoldProblem, s: Sight, d: Distances) -> PictureMissed:
    """How far sharpness, scale and shape of the picture miss their limits."""
    least, most = smaller(d.near_mm, d.far_mm), larger(d.near_mm, d.far_mm)
    blur = p.aperture_mm * (most - least) / (2 * least)
    px = p.focal_px * p.marker_diameter_mm / most * smaller(1.0, d.height_mm / most)
    travel = _lens_travel_mm(p, d)
    return PictureMissed(
        blur=blur / p.blur_limit_mm - 1,
        pixels_per_marker=p.min_px_per_marker / px - 1,
        keystone=keystone(d) / p.max_keystone - 1,
        lens_travel=(travel - p.lens_travel_mm) / larger(p.lens_travel_mm, 0.1),
        air_gap=WANTED_AIR_MM - s.air_height_mm,
    )


def _lens_travel_mm(p: FoldProblem, d: Distances) -> Array:
    """How far the lens moves out to focus between the near and the far edge."""
    focus = 2 * d.near_mm * d.far_mm / (d.near_mm + d.far_mm)
    moved = p.focal_length_mm**2 / larger(focus - p.focal_length_mm, 1e-3)
    return choose(focus >= p.focus_nearest_mm, 0.0, moved)


def distances(p: FoldProblem, s: Sight) -> Distances:
    """Apparent distances of the gel's edges."""
    near, far, tilt = s.near_ray_rad, s.far_ray_rad, s.tilt_rad
    height = s.air_height_mm + p.guide_thickness_mm / p.guide_index + p.gel_total_mm / p.gel_index
    return Distances(
        near_mm=height / np.cos(near) * np.cos(near - tilt),
        far_mm=height / np.cos(far) * np.cos(far - tilt),
        height_mm=height,
    )


def sight(p: FoldProblem, mid_rad: Array, spread: Array) -> Sight:
    """Virtual camera for a mean ray angle and a spread as a part of the field of view."""
    half_view = p.half_vertical_rad
    near, far = mid_rad - spread * half_view, mid_rad + spread * half_view
    near_slope, far_slope = np.tan(near), np.tan(far)
    near_reach, far_reach = _reach_in_layers_mm(p, near_slope), _reach_in_layers_mm(p, far_slope)
    air = (p.gel_length_mm - (far_reach - near_reach)) / (far_slope - near_slope)
    air = larger(air, LEAST_AIR_MM)
    virtual_x = -p.gel_length_mm / 2 - (air * near_slope + near_reach)
    near_along, near_across = _corner_slopes(p, -p.gel_length_mm / 2 - virtual_x, air)
    far_along, far_across = _corner_slopes(p, p.gel_length_mm / 2 - virtual_x, air)
    shallowest = smaller(near_slope, near_along)
    steepest = larger(far_slope, far_along)
    lowest, highest = np.arctan(shallowest), np.arctan(steepest)
    tilt = smaller(larger(0.0, highest - half_view), lowest + half_view)
    cos, sin = np.cos(tilt), np.sin(tilt)
    return Sight(
        near_ray_rad=near,
        far_ray_rad=far,
        tilt_rad=tilt,
        air_height_mm=air,
        virtual_x_mm=virtual_x,
        virtual_z_mm=p.window_z_mm - air,
        shallowest=shallowest,
        steepest=steepest,
        near_corner_across=near_across,
        far_corner_across=far_across,
        corner_horizontal_tan=larger(
            near_across / (near_along * sin + cos), far_across / (far_along * sin + cos)
        ),
        corner_vertical_tan=np.tan(larger(highest - tilt, tilt - lowest)),
    )


def _reach_in_layers_mm(p: FoldProblem, slope: Array) -> Array:
    """How far a ray goes along the finger within guide and gel."""
    heights, indices = (p.guide_thickness_mm, p.gel_total_mm), (p.guide_index, p.gel_index)
    return slope * apparent_height(slope, heights, indices)


def _corner_slopes(p: FoldProblem, along_mm: Array, air_mm: Array) -> tuple[Array, Array]:
    """Slopes dx/dz and dy/dz, in air, of the ray to a corner of the gel."""
    across_mm = p.gel_width_mm / 2
    reach = np.sqrt(along_mm * along_mm + across_mm * across_mm)
    heights = (air_mm, p.guide_thickness_mm, p.gel_total_mm)
    slope = newton_slope(reach, heights, (1.0, p.guide_index, p.gel_index))
    return slope * along_mm / reach, slope * across_mm / reach


SHARED = (
    near_edge_x_mm,
    far_edge_x_mm,
    keystone,
    field_missed,
    picture_missed,
    distances,
    _lens_travel_mm,
    sight,
    _reach_in_layers_mm,
    _corner_slopes,
)
