"""Camera, mirror and gel in the finger's mid-plane: one candidate of the folded view.

Coordinates x (towards the tip) and z (out of the gel) of the sensor frame. A candidate is given
by the air angles of the two marginal rays that end on the gel's edges and by the mirror angle;
everything else follows in closed form, exact refraction included (docs/physics.md).

Every field is an array; candidates broadcast against designs. The functions of `focus`,
`distortion`, `sight`, `mirror`, `camera` and `room` are written once for
arrays and for single numbers: `search` compiles them (each module's `SHARED`) to score one
candidate after the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold import room
from gelslim_cad.dimensions.fold.camera import Camera, camera, largest, pitch_rad, smallest
from gelslim_cad.dimensions.fold.focus import Distances, distances
from gelslim_cad.dimensions.fold.goal import besides_depth, beyond_mm, score, tie_mm
from gelslim_cad.dimensions.fold.housing import (
    HousingMissed,
    finger_length_mm,
    finger_lengths_mm,
    housing_missed,
)
from gelslim_cad.dimensions.fold.mirror import (
    Mirror,
    mirror,
    mirror_depth_mm,
    mirror_half_width_mm,
    reflected,
)
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger
from gelslim_cad.dimensions.fold.sight import (
    Sight,
    edge_scales,
    field_missed,
    keystone,
    least_px,
    lens_extension_mm,
    marker_sides_px,
    picture_missed,
    sight,
)

VIEW_LIMITS = (
    "field of view along",
    "field of view across",
    "blur",
    "pixels per marker",
    "keystone",
    "lens travel",
    "air gap",
    "mirror below window",
    "camera below window",
    "camera beside view",
    "camera clear of mirror",
    "view below ledge",
    "mirror before camera",
    "camera clear of ledge",
)
"""The limits of the view, in the order of `view_missed`."""
HOUSING_LIMITS = tuple(name.replace("_", " ") for name in HousingMissed._fields)


@dataclass(frozen=True)
class Fold:
    """One candidate (or, solved, one layout) per design; lengths mm, angles rad."""

    near_ray_rad: Array
    far_ray_rad: Array
    tilt_rad: Array
    air_height_mm: Array
    virtual_x_mm: Array
    virtual_z_mm: Array
    mirror_rad: Array
    pitch_rad: Array
    mirror_upper_x_mm: Array
    mirror_upper_z_mm: Array
    mirror_lower_x_mm: Array
    mirror_lower_z_mm: Array
    mirror_half_width_mm: Array
    camera_x_mm: Array
    camera_z_mm: Array
    camera_top_z_mm: Array
    camera_bottom_z_mm: Array
    camera_front_x_mm: Array
    camera_rear_x_mm: Array
    ledge_edge_x_mm: Array
    near_distance_mm: Array
    far_distance_mm: Array
    near_tangential_mm: Array
    near_sagittal_mm: Array
    far_tangential_mm: Array
    far_sagittal_mm: Array
    across_scale: Array
    along_scale: Array
    focus_mm: Array
    image_distance_mm: Array
    lens_extension_mm: Array
    corner_horizontal_tan: Array
    corner_vertical_tan: Array
    mirror_depth_mm: Array
    camera_depth_mm: Array
    depth_mm: Array
    keystone: Array
    length_mm: Array
    least_px: Array
    violations: dict[str, Array]
    """Per limit of the view, how far it is missed as a part of its scale; <= 0 holds."""
    housing: dict[str, Array]
    """Per limit of the housing, by how many mm it is missed; <= 0 holds."""

    def worst(self) -> Array:
        """Sum of the missed parts over the limits of the view; 0 where all are kept."""
        total = np.zeros_like(self.depth_mm)
        for value in self.violations.values():
            total = total + np.maximum(value, 0.0)
        return total

    def beyond_mm(self) -> Array:
        """How far the finger is outside what the housing allows; 0 where all limits hold."""
        return beyond_mm(tuple(self.housing.values()))

    def objective(self, p: FoldProblem) -> Array:
        """What the search makes least."""
        use = 1 + np.maximum(*(self.violations[name] for name in VIEW_LIMITS[:2]))
        tie = tie_mm(use, self.keystone)
        besides = besides_depth(p, self.length_mm, self.least_px, tie)
        return score(p, self.worst(), self.beyond_mm(), self.depth_mm, besides)


class Layout(NamedTuple):
    """Camera, mirror and gel of one candidate."""

    sight: Sight
    distances: Distances
    mirror: Mirror
    camera: Camera
    pitch_rad: Array
    extension_mm: Array
    ledge_x_mm: Array
    mirror_depth_mm: Array
    camera_depth_mm: Array
    depth_mm: Array


def layout(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> Layout:
    """Lay out candidates: mean ray angle, spread as a part of the field of view, mirror angle."""
    s = sight(p, mid_rad, spread)
    d = distances(p, s.border, np.cos(s.tilt_rad), np.sin(s.tilt_rad))
    m = mirror(p, s, np.cos(mirror_rad), np.sin(mirror_rad))
    pitch = pitch_rad(s, mirror_rad)
    extension = lens_extension_mm(p, d)
    x, z = reflected(m, s.virtual_x_mm, s.virtual_z_mm)
    c = camera(p, x, z, pitch, extension)
    mirror_depth = mirror_depth_mm(p, m)
    camera_depth = camera_depth_mm(p, smallest(c.corners_z_mm))
    return Layout(
        sight=s,
        distances=d,
        mirror=m,
        camera=c,
        pitch_rad=pitch,
        extension_mm=extension,
        ledge_x_mm=room.ledge_edge_x_mm(p, s),
        mirror_depth_mm=mirror_depth,
        camera_depth_mm=camera_depth,
        depth_mm=depth_mm(p, mirror_depth, camera_depth),
    )


def view_missed(p: FoldProblem, at: Layout) -> tuple[Array, ...]:
    """How far each of `VIEW_LIMITS` is missed, as a part of its scale; <= 0 holds."""
    s, m, c = at.sight, at.mirror, at.camera
    field, picture = field_missed(p, s, at.distances), picture_missed(p, s, at.distances)
    return (
        field.field_of_view_along,
        field.field_of_view_across,
        picture.blur,
        picture.pixels_per_marker,
        picture.keystone,
        picture.lens_travel,
        picture.air_gap,
        room.mirror_below_window(s, m) / room.SCALE_MM,
        room.camera_below_window(p, c) / room.SCALE_MM,
        room.camera_beside_view(p, s, c) / room.SCALE_MM,
        room.camera_clear_of_mirror(p, m, c) / room.SCALE_MM,
        room.view_below_ledge(p, m, c, at.ledge_x_mm) / room.SCALE_MM,
        room.mirror_before_camera(p, m, c.x_mm) / room.SCALE_MM,
        room.camera_clear_of_ledge(p, c, at.ledge_x_mm) / room.SCALE_MM,
    )


def length_mm(p: FoldProblem, at: Layout) -> Array:
    """Length of the finger."""
    return finger_length_mm(p, at.mirror, at.camera, at.ledge_x_mm, at.depth_mm)


def housing_limits(p: FoldProblem, at: Layout) -> HousingMissed:
    """By how many mm each of `HOUSING_LIMITS` is missed; <= 0 holds."""
    return housing_missed(p, at.sight, at.mirror, at.camera, at.ledge_x_mm, at.depth_mm)


def fold(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> Fold:
    """Candidates with all that is known of them; see `layout`."""
    at = layout(p, mid_rad, spread, mirror_rad)
    s, d, m, c = at.sight, at.distances, at.mirror, at.camera
    scales = edge_scales(p, s, d)
    return Fold(
        near_ray_rad=s.near_ray_rad,
        far_ray_rad=s.far_ray_rad,
        tilt_rad=s.tilt_rad,
        air_height_mm=s.air_height_mm,
        virtual_x_mm=s.virtual_x_mm,
        virtual_z_mm=s.virtual_z_mm,
        mirror_rad=mirror_rad,
        pitch_rad=at.pitch_rad,
        mirror_upper_x_mm=m.upper_x_mm,
        mirror_upper_z_mm=m.upper_z_mm,
        mirror_lower_x_mm=m.lower_x_mm,
        mirror_lower_z_mm=m.lower_z_mm,
        mirror_half_width_mm=mirror_half_width_mm(s, m),
        camera_x_mm=c.x_mm,
        camera_z_mm=c.z_mm,
        camera_top_z_mm=largest(c.corners_z_mm),
        camera_bottom_z_mm=smallest(c.corners_z_mm),
        camera_front_x_mm=largest(c.corners_x_mm),
        camera_rear_x_mm=smallest(c.corners_x_mm),
        ledge_edge_x_mm=at.ledge_x_mm,
        near_distance_mm=d.near.sagittal_mm,
        far_distance_mm=d.far.sagittal_mm,
        near_tangential_mm=d.near_span_mm[0],
        near_sagittal_mm=d.near_span_mm[1],
        far_tangential_mm=d.far_span_mm[0],
        far_sagittal_mm=d.far_span_mm[1],
        across_scale=np.minimum(scales[0], scales[2]),
        along_scale=np.minimum(scales[1], scales[3]),
        focus_mm=d.focus_mm,
        image_distance_mm=d.image_mm,
        lens_extension_mm=at.extension_mm,
        corner_horizontal_tan=s.corner_horizontal_tan,
        corner_vertical_tan=s.corner_vertical_tan,
        mirror_depth_mm=at.mirror_depth_mm,
        camera_depth_mm=at.camera_depth_mm,
        depth_mm=at.depth_mm,
        keystone=keystone(d),
        length_mm=length_mm(p, at),
        least_px=least_px(p, s, d),
        violations=dict(zip(VIEW_LIMITS, view_missed(p, at), strict=True)),
        housing=dict(zip(HOUSING_LIMITS, housing_limits(p, at), strict=True)),
    )


def camera_depth_mm(p: FoldProblem, bottom_z_mm: Array) -> Array:
    """How far the camera, its clearance included, reaches below the window."""
    return p.window_z_mm - bottom_z_mm + p.clearance_mm


def depth_mm(p: FoldProblem, mirror_depth: Array, camera_depth: Array) -> Array:
    """Depth below the window that mirror, camera and guide need."""
    return larger(larger(mirror_depth, camera_depth), p.guide_stack_mm)


def measures(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> tuple[Array, ...]:
    """What the polish follows, in pieces that are smooth.

    Depths of the mirror and of three corners of the camera, of which the largest counts; four
    sizes of a marker, of which the least does; five lengths, of which the largest does; the tie;
    and how far the limits of view and housing are missed, three parts of the camera for one limit.
    """
    at = layout(p, mid_rad, spread, mirror_rad)
    view, housing = view_missed(p, at), housing_limits(p, at)
    lengths = finger_lengths_mm(p, at.mirror, at.camera, at.ledge_x_mm, at.depth_mm)
    tie = tie_mm(1 + larger(view[0], view[1]), keystone(at.distances))
    low = at.camera.corners_z_mm
    depths = (
        at.mirror_depth_mm,
        camera_depth_mm(p, low[1]),
        camera_depth_mm(p, low[3]),
        camera_depth_mm(p, low[5]),
    )
    pixels = marker_sides_px(p, at.sight, at.distances)
    rest = (
        housing.mirror_between_baffles,
        housing.clamp_before_seat,
        housing.clamp_beside_channel,
        housing.cable_over_cover,
        housing.cable_under_roof,
        housing.clamp_floor,
    )
    tops = room.camera_parts_below_window(p, at.camera)
    below = (tops[0] / room.SCALE_MM, tops[1] / room.SCALE_MM, tops[2] / room.SCALE_MM)
    return depths + pixels + lengths + (tie,) + below + view[:3] + view[4:8] + view[9:] + rest


SHARED = (
    layout,
    view_missed,
    length_mm,
    housing_limits,
    camera_depth_mm,
    depth_mm,
    measures,
)
