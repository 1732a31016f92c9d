"""Camera, mirror and gel in the finger's mid-plane: one candidate of the folded view.

Coordinates x (towards the tip) and z (out of the gel) of the sensor frame. A candidate is given
by the air angles of the two marginal rays that end on the gel's edges and by the mirror angle;
everything else follows in closed form, exact refraction included (docs/physics.md).

Every field is an array; candidates broadcast against designs. The functions of `fold_focus`,
`fold_sight`, `fold_mirror`, `fold_camera` and `fold_room` are written once for arrays and for
single numbers: `fold_search` compiles them (each module's `SHARED`) to score one candidate after
the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.dimensions import fold_room as room
from gelslim_cad.dimensions.fold_camera import Camera, camera, largest, pitch_rad, smallest
from gelslim_cad.dimensions.fold_focus import Distances, along_scale
from gelslim_cad.dimensions.fold_mirror import (
    Mirror,
    mirror,
    mirror_depth_mm,
    mirror_half_width_mm,
    reflected,
)
from gelslim_cad.dimensions.fold_problem import Array, FoldProblem, larger
from gelslim_cad.dimensions.fold_sight import (
    Sight,
    distances,
    field_missed,
    keystone,
    lens_extension_mm,
    picture_missed,
    sight,
)
from gelslim_optics.camera.refraction_newton import choose

FEASIBLE = 1e-9
"""Limits missed by no more than this in all count as kept."""
INFEASIBLE_MM = 1000.0
KEYSTONE_WEIGHT_MM = 0.02
LENGTH_WEIGHT = 0.002


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
    violations: dict[str, Array]
    """Per constraint, how far it is missed as a part of its scale; <= 0 holds."""

    def worst(self) -> Array:
        """Sum of the missed parts over all constraints; 0 where the candidate is feasible."""
        total = np.zeros_like(self.depth_mm)
        for value in self.violations.values():
            total = total + np.maximum(value, 0.0)
        return total

    def objective(self) -> Array:
        """What the search makes least."""
        return score(self.worst(), self.depth_mm, self.keystone, self.camera_rear_x_mm)


def fold(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> Fold:
    """Lay out candidates: mean ray angle, spread as a part of the field of view, mirror angle."""
    s = sight(p, mid_rad, spread)
    d = distances(p, s)
    m = mirror(p, s, np.cos(mirror_rad), np.sin(mirror_rad))
    pitch = pitch_rad(s, mirror_rad)
    extension = lens_extension_mm(p, d)
    c = camera(p, *reflected(m, s.virtual_x_mm, s.virtual_z_mm), pitch, extension)
    bottom = smallest(c.corners_z_mm)
    mirror_depth, camera_depth = mirror_depth_mm(p, m), camera_depth_mm(p, bottom)
    return Fold(
        near_ray_rad=s.near_ray_rad,
        far_ray_rad=s.far_ray_rad,
        tilt_rad=s.tilt_rad,
        air_height_mm=s.air_height_mm,
        virtual_x_mm=s.virtual_x_mm,
        virtual_z_mm=s.virtual_z_mm,
        mirror_rad=mirror_rad,
        pitch_rad=pitch,
        mirror_upper_x_mm=m.upper_x_mm,
        mirror_upper_z_mm=m.upper_z_mm,
        mirror_lower_x_mm=m.lower_x_mm,
        mirror_lower_z_mm=m.lower_z_mm,
        mirror_half_width_mm=mirror_half_width_mm(s, m),
        camera_x_mm=c.x_mm,
        camera_z_mm=c.z_mm,
        camera_top_z_mm=largest(c.corners_z_mm),
        camera_bottom_z_mm=bottom,
        camera_front_x_mm=largest(c.corners_x_mm),
        camera_rear_x_mm=smallest(c.corners_x_mm),
        ledge_edge_x_mm=room.ledge_edge_x_mm(p, s),
        near_distance_mm=d.near.sagittal_mm,
        far_distance_mm=d.far.sagittal_mm,
        near_tangential_mm=d.near_span_mm[0],
        near_sagittal_mm=d.near_span_mm[1],
        far_tangential_mm=d.far_span_mm[0],
        far_sagittal_mm=d.far_span_mm[1],
        along_scale=np.minimum(along_scale(d.near, d.image_mm), along_scale(d.far, d.image_mm)),
        focus_mm=d.focus_mm,
        image_distance_mm=d.image_mm,
        lens_extension_mm=extension,
        corner_horizontal_tan=s.corner_horizontal_tan,
        corner_vertical_tan=s.corner_vertical_tan,
        mirror_depth_mm=mirror_depth,
        camera_depth_mm=camera_depth,
        depth_mm=depth_mm(p, mirror_depth, camera_depth),
        keystone=keystone(d),
        violations=_violations(p, s, d, m, c),
    )


def _violations(p: FoldProblem, s: Sight, d: Distances, m: Mirror, c: Camera) -> dict[str, Array]:
    """How far each limit is missed, by the limit's name in words."""
    ledge_x = room.ledge_edge_x_mm(p, s)
    picture = field_missed(p, s, d)._asdict() | picture_missed(p, s, d)._asdict()
    in_the_way = {
        "mirror below window": room.mirror_below_window(s, m),
        "camera below window": room.camera_below_window(p, c),
        "camera beside view": room.camera_beside_view(p, s, c),
        "camera clear of mirror": room.camera_clear_of_mirror(p, m, c),
        "view below ledge": room.view_below_ledge(p, m, c, ledge_x),
        "mirror before camera": room.mirror_before_camera(p, m, c.x_mm),
        "camera clear of ledge": room.camera_clear_of_ledge(p, c, ledge_x),
    }
    return {
        **{name.replace("_", " "): missed for name, missed in picture.items()},
        **{name: missed / room.SCALE_MM for name, missed in in_the_way.items()},
    }


def camera_depth_mm(p: FoldProblem, bottom_z_mm: Array) -> Array:
    """How far the camera, its clearance included, reaches below the window."""
    return p.window_z_mm - bottom_z_mm + p.clearance_mm


def depth_mm(p: FoldProblem, mirror_depth: Array, camera_depth: Array) -> Array:
    """Depth below the window that mirror, camera and guide need."""
    return larger(larger(mirror_depth, camera_depth), p.guide_stack_mm)


def score(missed: Array, depth: Array, keystone: Array, rear_x_mm: Array) -> Array:
    """Depth in mm; among equals the smaller keystone, then the shorter finger.

    Candidates that miss limits rank behind all others, by how far they miss.
    """
    tie = KEYSTONE_WEIGHT_MM * (keystone - 1) - LENGTH_WEIGHT * rear_x_mm
    return choose(missed > FEASIBLE, INFEASIBLE_MM * (1 + missed), depth + tie)


SHARED = (camera_depth_mm, depth_mm, score)
