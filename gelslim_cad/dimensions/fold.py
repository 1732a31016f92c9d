"""Camera, mirror and gel in the finger's mid-plane: one candidate of the folded view.

Coordinates x (towards the tip) and z (out of the gel) of the sensor frame. A candidate is given
by the air angles of the two marginal rays that end on the gel's edges and by the mirror angle;
everything else follows in closed form, exact refraction included (docs/physics.md).
Every field is an array; candidates broadcast against designs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.dimensions.fold_camera import Camera, camera
from gelslim_cad.dimensions.fold_mirror import Mirror, mirror
from gelslim_cad.dimensions.fold_problem import Array, FoldProblem
from gelslim_cad.dimensions.fold_sight import Sight, sight

SCALE_MM = 10
"""A length missed by this much counts as a ratio missed by all of its limit."""


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
    corner_horizontal_tan: Array
    corner_vertical_tan: Array
    mirror_depth_mm: Array
    camera_depth_mm: Array
    depth_mm: Array
    violations: dict[str, Array]
    """Per constraint, how far it is missed as a part of its scale; <= 0 holds."""

    def worst(self) -> Array:
        """Sum of the missed parts over all constraints; 0 where the candidate is feasible."""
        total = np.zeros_like(self.depth_mm)
        for value in self.violations.values():
            total = total + np.maximum(value, 0.0)
        return total


def fold(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> Fold:
    """Lay out candidates: mean ray angle, spread as a part of the field of view, mirror angle."""
    s = sight(p, mid_rad, spread)
    m = mirror(p, s, mirror_rad)
    c = camera(p, s, m)
    ledge_edge = _ledge_edge_x_mm(p, s)
    bottom = c.bottom_z_mm
    mirror_depth = m.depth_mm(p)
    camera_depth = p.window_z_mm - bottom + p.clearance_mm
    return Fold(
        near_ray_rad=s.near_ray_rad,
        far_ray_rad=s.far_ray_rad,
        tilt_rad=s.tilt_rad,
        air_height_mm=s.air_height_mm,
        virtual_x_mm=s.virtual_x_mm,
        virtual_z_mm=s.virtual_z_mm,
        mirror_rad=mirror_rad + 0 * s.air_height_mm,
        pitch_rad=c.pitch_rad,
        mirror_upper_x_mm=m.upper_x_mm,
        mirror_upper_z_mm=m.upper_z_mm,
        mirror_lower_x_mm=m.lower_x_mm,
        mirror_lower_z_mm=m.lower_z_mm,
        mirror_half_width_mm=m.half_width_mm,
        camera_x_mm=c.x_mm,
        camera_z_mm=c.z_mm,
        camera_top_z_mm=c.top_z_mm,
        camera_bottom_z_mm=bottom,
        camera_front_x_mm=c.front_x_mm,
        camera_rear_x_mm=c.rear_x_mm,
        ledge_edge_x_mm=ledge_edge,
        near_distance_mm=s.near_distance_mm,
        far_distance_mm=s.far_distance_mm,
        corner_horizontal_tan=s.corner_horizontal_tan,
        corner_vertical_tan=s.corner_vertical_tan,
        mirror_depth_mm=mirror_depth,
        camera_depth_mm=camera_depth,
        depth_mm=np.maximum(np.maximum(mirror_depth, camera_depth), p.guide_stack_mm),
        violations={**s.missed(p), **_missed_room(p, s, m, c, ledge_edge)},
    )


def _ledge_z_mm(p: FoldProblem) -> Array:
    """Lower face of the ledge that carries the guide's near end."""
    return p.window_z_mm - p.ledge_depth_mm


def _ledge_edge_x_mm(p: FoldProblem, s: Sight) -> Array:
    """The ledge's edge: short of the gel and of the view."""
    return np.minimum(-p.gel_length_mm / 2 - 0.2, s.near_edge_x_mm(_ledge_z_mm(p)) - p.clearance_mm)


def _missed_room(
    p: FoldProblem, s: Sight, m: Mirror, c: Camera, ledge_edge: Array
) -> dict[str, Array]:
    """How far mirror, camera, view and ledge are in each other's way, as parts of SCALE_MM."""
    gap = p.clearance_mm
    lower_end = m.lower_end_x_mm(p)
    before_view = [x - s.near_edge_x_mm(z) + gap for x, z in c.corners_mm]
    below_mirror = [gap - m.height_over_mm(x, z) for x, z in c.corners_mm]
    before_mirror = [x - lower_end + gap for x, _ in c.corners_mm]
    missed = {
        "mirror below window": np.maximum(-m.length_mm, s.virtual_z_mm - m.lower_z_mm),
        "camera below window": c.top_z_mm - p.window_z_mm + gap,
        "camera beside view": np.max(before_view, axis=0),
        "camera clear of mirror": np.minimum(
            np.max(below_mirror, axis=0), np.max(before_mirror, axis=0)
        ),
        "view below ledge": _view_above_ledge_mm(p, m, c, ledge_edge),
        "mirror before camera": lower_end * -1 + c.x_mm + gap,
        "camera clear of ledge": _camera_in_ledge_mm(p, c, ledge_edge),
    }
    return {name: value / SCALE_MM for name, value in missed.items()}


def _view_above_ledge_mm(p: FoldProblem, m: Mirror, c: Camera, ledge_edge: Array) -> Array:
    """How far the view from the camera to the mirror's upper end is above ledge and beam."""
    climb = (m.upper_z_mm - c.z_mm) / (m.upper_x_mm - c.x_mm)
    at_edge, at_beam = (
        np.where(x > c.x_mm, c.z_mm + climb * (x - c.x_mm), -np.inf)
        + p.clearance_mm
        - _ledge_z_mm(p)
        for x in (ledge_edge, ledge_edge - p.ledge_reach_mm)
    )
    return np.maximum(at_edge, at_beam)


def _camera_in_ledge_mm(p: FoldProblem, c: Camera, ledge_edge: Array) -> Array:
    """How far the camera is in the corner below the beam, or the beam's edge in the camera."""
    beam_x, ledge_z, gap = ledge_edge - p.ledge_reach_mm, _ledge_z_mm(p), p.clearance_mm
    corners = [np.minimum(x - beam_x, z - ledge_z + gap) for x, z in c.corners_mm]
    edge = gap - c.distance_outside_mm(p, beam_x, ledge_z)
    return np.maximum(np.max(corners, axis=0), edge)
