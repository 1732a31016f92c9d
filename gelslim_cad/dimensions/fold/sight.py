"""The view before it is folded: the camera's mirror image straight below the gel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.distortion import (
    FAR,
    NEAR,
    Edge,
    border_slopes,
    edge_points,
    ideal_along,
    image_scale,
    largest_along,
    least_tilt_rad,
    most_tilt_rad,
    one_point,
    sides_reach,
)
from gelslim_cad.dimensions.fold.focus import (
    Distances,
    SeenBorder,
    across_scale,
    along_scale,
    edge_blur_mm,
    focused_image_mm,
    image_distance_mm,
    seen_point,
)
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_optics.camera.refraction_newton import apparent_height, choose

LEAST_AIR_MM = 1.0
"""Candidates with less air are laid out with this much, so that the closed forms hold."""
WANTED_AIR_MM = 2.0
TILT_STEPS = 5
"""Repetitions of tilt and image distance; each leaves less than a thirtieth of the error."""
VIEW_STEPS = 3
VIEW_KEPT = 1 - 1e-6
"""Share of the field of view for which the axis is tilted: more than these steps leave open."""


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
    view_rad: Array
    """Angle between the outermost rays."""
    near_corner_across: Array
    """Slope dy/dz of the ray to a near corner."""
    far_corner_across: Array
    border: SeenBorder
    near_edge: Edge
    """Points of the edge; where nothing distorts, its outermost one alone."""
    far_edge: Edge
    corner_horizontal_tan: Array
    """Largest coordinate of the gel's image across the finger, in image distances."""
    corner_vertical_tan: Array


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
    near, far = d.near.sagittal_mm, d.far.sagittal_mm
    return larger(near, far) / smaller(near, far)


def field_missed(p: FoldProblem, s: Sight, d: Distances) -> FieldMissed:
    """How far the gel reaches out of the picture, along by what lies beyond half the view."""
    # The axis is tilted so that the view just holds the gel; here its room shows all the same.
    held = VIEW_KEPT * p.half_along_mm / d.image_mm
    beyond = np.tan(s.view_rad - np.arctan(held))
    if np.any(p.distorted > 0):
        most_tilt = most_tilt_rad(p, s.near_edge, held)
        distorted = largest_along(p, s.far_edge, most_tilt, FAR)
        beyond = choose(p.distorted > 0, distorted, beyond)
    return FieldMissed(
        field_of_view_along=beyond * d.image_mm / p.half_along_mm - 1,
        field_of_view_across=s.corner_horizontal_tan * d.image_mm / p.half_across_mm - 1,
    )


def picture_missed(p: FoldProblem, s: Sight, d: Distances) -> PictureMissed:
    """How far sharpness, scale and shape of the picture miss their limits."""
    near_blur = edge_blur_mm(p.aperture_mm, d.near_span_mm, d.focus_mm)
    far_blur = edge_blur_mm(p.aperture_mm, d.far_span_mm, d.focus_mm)
    travel = choose(d.focus_mm >= p.focus_nearest_mm, 0.0, lens_extension_mm(p, d))
    return PictureMissed(
        blur=larger(near_blur, far_blur) / p.blur_limit_mm - 1,
        pixels_per_marker=p.min_px_per_marker / least_px(p, s, d) - 1,
        keystone=keystone(d) / p.max_keystone - 1,
        lens_travel=(travel - p.lens_travel_mm) / larger(p.lens_travel_mm, 0.1),
        air_gap=WANTED_AIR_MM - s.air_height_mm,
    )


def least_px(p: FoldProblem, s: Sight, d: Distances) -> Array:
    """Pixels across a marker where it is imaged smallest."""
    sides = marker_sides_px(p, s, d)
    return smaller(smaller(sides[0], sides[1]), smaller(sides[2], sides[3]))


def marker_sides_px(p: FoldProblem, s: Sight, d: Distances) -> tuple[Array, Array, Array, Array]:
    """Width and height of a marker's image at the near edge, and at the far one."""
    scales, per_scale = edge_scales(p, s, d), p.marker_diameter_mm / p.pixel_pitch_mm
    return (
        scales[0] * per_scale,
        scales[1] * per_scale,
        scales[2] * per_scale,
        scales[3] * per_scale,
    )


def edge_scales(p: FoldProblem, s: Sight, d: Distances) -> tuple[Array, Array, Array, Array]:
    """Length in the image of a unit length across and along the near edge, and the far one.

    The distortion counts where it makes the image smaller: in the middle or at a corner.
    """
    near_across, near_along = across_scale(d.near, d.image_mm), along_scale(d.near, d.image_mm)
    far_across, far_along = across_scale(d.far, d.image_mm), along_scale(d.far, d.image_mm)
    if np.any(p.distorted > 0):
        near, far = _least_scale(p, s, s.near_edge), _least_scale(p, s, s.far_edge)
        near_across, near_along = near_across * near[0], near_along * near[1]
        far_across, far_along = far_across * far[0], far_along * far[1]
    return near_across, near_along, far_across, far_along


def _least_scale(p: FoldProblem, s: Sight, edge: Edge) -> tuple[Array, Array]:
    """The smaller scales of the distortion across and along, of an edge's middle and corner."""
    middle = image_scale(p, np.tan(edge.angle_rad[0] - s.tilt_rad), edge.across[0])
    corner = image_scale(p, np.tan(edge.angle_rad[2] - s.tilt_rad), edge.across[2])
    return smaller(middle[0], corner[0]), smaller(middle[1], corner[1])


def lens_extension_mm(p: FoldProblem, d: Distances) -> Array:
    """How far the lens stands before its place for infinity."""
    return p.moving_lens * (d.image_mm - p.focal_length_mm)


def _half_view_rad(p: FoldProblem, mid_rad: Array, spread: Array) -> Array:
    """About half the field of view along the finger, the lens focused on the gel.

    Here the axis is the mean ray and refraction is paraxial. This is the unit in which the search
    measures the spread of the rays, so that 1 uses the whole view; no limit depends on it.
    """
    half = p.widest_along_rad
    for _ in range(VIEW_STEPS):
        slopes = np.tan(mid_rad + spread * half) - np.tan(mid_rad - spread * half)
        focus = larger(p.gel_length_mm / (slopes * np.cos(mid_rad)), 2 * p.focal_length_mm)
        image = p.half_along_mm / image_distance_mm(p, focus)
        half = np.arctan(image)
        if np.any(p.distorted > 0):
            half = choose(p.distorted > 0, np.arctan(ideal_along(p, image, 0 * image, FAR)), half)
    return half


def _tilt_rad(
    p: FoldProblem, start_rad: Array, border: SeenBorder, lowest: Array, highest: Array
) -> Array:
    """Smallest tilt at which the view, as wide as its focus lets it be, holds the outermost rays.

    The focus is at the gel, whose distance along the axis depends a little on the tilt.
    """
    tilt = larger(0.0, start_rad)
    for _ in range(TILT_STEPS):
        half = np.arctan(_held_image(p, border, tilt))
        tilt = smaller(larger(0.0, highest - half), lowest + half)
    return tilt


def _distorted_tilt_rad(
    p: FoldProblem, start_rad: Array, border: SeenBorder, near: Edge, far: Edge
) -> Array:
    """The same of a lens that distorts."""
    tilt = start_rad
    for _ in range(TILT_STEPS):
        held = _held_image(p, border, tilt)
        tilt = smaller(larger(0.0, least_tilt_rad(p, far, held)), most_tilt_rad(p, near, held))
    return tilt


def _held_image(p: FoldProblem, border: SeenBorder, tilt_rad: Array) -> Array:
    """Half the picture's height in image distances, the lens in focus on an axis of this tilt."""
    image_mm = focused_image_mm(p, border, np.cos(tilt_rad), np.sin(tilt_rad))
    return VIEW_KEPT * p.half_along_mm / image_mm


def sight(p: FoldProblem, mid_rad: Array, spread: Array) -> Sight:
    """Virtual camera for a mean ray angle and a spread as a part of the field of view."""
    half_view = _half_view_rad(p, mid_rad, spread)
    near, far = mid_rad - spread * half_view, mid_rad + spread * half_view
    near_slope, far_slope = np.tan(near), np.tan(far)
    near_reach, far_reach = _reach_in_layers_mm(p, near_slope), _reach_in_layers_mm(p, far_slope)
    air = (p.gel_length_mm - (far_reach - near_reach)) / (far_slope - near_slope)
    air = larger(air, LEAST_AIR_MM)
    virtual_x = -p.gel_length_mm / 2 - (air * near_slope + near_reach)
    near_mm, far_mm = -p.gel_length_mm / 2 - virtual_x, p.gel_length_mm / 2 - virtual_x
    near_along, near_across = border_slopes(p, near_mm, p.gel_width_mm / 2, air)
    far_along, far_across = border_slopes(p, far_mm, p.gel_width_mm / 2, air)
    shallowest = smaller(near_slope, near_along)
    steepest = larger(far_slope, far_along)
    lowest, highest = np.arctan(shallowest), np.arctan(steepest)
    border = SeenBorder(
        near=seen_point(p, near_slope, 0.0, air),
        near_corner=seen_point(p, near_along, near_across, air),
        far=seen_point(p, far_slope, 0.0, air),
        far_corner=seen_point(p, far_along, far_across, air),
    )
    tilt = _tilt_rad(p, (near + far) / 2, border, lowest, highest)
    near_edge, far_edge = one_point(lowest), one_point(highest)
    if np.any(p.distorted > 0):
        near_edge = edge_points(
            p, border.near, border.near_corner, near_across, near_mm, air, tilt, NEAR
        )
        far_edge = edge_points(p, border.far, border.far_corner, far_across, far_mm, air, tilt, FAR)
        distorted = _distorted_tilt_rad(p, tilt, border, near_edge, far_edge)
        tilt = choose(p.distorted > 0, distorted, tilt)
    cos, sin = np.cos(tilt), np.sin(tilt)
    horizontal = larger(
        near_across / (near_along * sin + cos), far_across / (far_along * sin + cos)
    )
    vertical = np.tan(larger(highest - tilt, tilt - lowest))
    if np.any(p.distorted > 0):
        horizontal = choose(p.distorted > 0, sides_reach(p, near_mm, air, tilt), horizontal)
        outermost = larger(
            largest_along(p, near_edge, tilt, NEAR), largest_along(p, far_edge, tilt, FAR)
        )
        vertical = choose(p.distorted > 0, outermost, vertical)
    return Sight(
        near_ray_rad=near,
        far_ray_rad=far,
        tilt_rad=tilt,
        air_height_mm=air,
        virtual_x_mm=virtual_x,
        virtual_z_mm=p.window_z_mm - air,
        shallowest=shallowest,
        steepest=steepest,
        view_rad=highest - lowest,
        near_corner_across=near_across,
        far_corner_across=far_across,
        border=border,
        near_edge=near_edge,
        far_edge=far_edge,
        corner_horizontal_tan=horizontal,
        corner_vertical_tan=vertical,
    )


def _reach_in_layers_mm(p: FoldProblem, slope: Array) -> Array:
    """How far a ray goes along the finger within guide and gel."""
    heights, indices = (p.guide_thickness_mm, p.gel_total_mm), (p.guide_index, p.gel_index)
    return slope * apparent_height(slope, heights, indices)


SHARED = (
    near_edge_x_mm,
    far_edge_x_mm,
    keystone,
    field_missed,
    picture_missed,
    _half_view_rad,
    _tilt_rad,
    _distorted_tilt_rad,
    _held_image,
    least_px,
    marker_sides_px,
    edge_scales,
    _least_scale,
    lens_extension_mm,
    sight,
    _reach_in_layers_mm,
)
