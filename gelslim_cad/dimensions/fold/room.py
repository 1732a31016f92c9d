"""How far mirror, camera, view and ledge are in each other's way.

Each function is one limit: by how many mm it is missed, <= 0 where it holds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_cad.dimensions.fold.camera import Camera, distance_outside_mm, largest
from gelslim_cad.dimensions.fold.mirror import Mirror, height_over_mm, lower_end_x_mm
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_cad.dimensions.fold.sight import Sight, near_edge_x_mm
from gelslim_optics.camera.refraction_newton import choose

SCALE_MM = 10
"""A length missed by this much counts as a ratio missed by all of its limit."""


def ledge_edge_x_mm(p: FoldProblem, s: Sight) -> Array:
    """The edge of the ledge that carries the guide's near end: short of the gel and of the view."""
    before_view = near_edge_x_mm(s, _ledge_z_mm(p)) - p.clearance_mm
    return smaller(-p.gel_length_mm / 2 - 0.2, before_view)


def _ledge_z_mm(p: FoldProblem) -> Array:
    """Lower face of the ledge."""
    return p.window_z_mm - p.ledge_depth_mm


def mirror_below_window(s: Sight, m: Mirror) -> Array:
    """The mirror has a length, and the virtual camera looks at its lower end from below."""
    return larger(-m.length_mm, s.virtual_z_mm - m.lower_z_mm)


def mirror_before_camera(p: FoldProblem, m: Mirror, camera_x_mm: Array) -> Array:
    """The glass ends before the pinhole."""
    return lower_end_x_mm(p, m) * -1 + camera_x_mm + p.clearance_mm


def camera_below_window(p: FoldProblem, c: Camera) -> Array:
    """The camera's highest corner clears the window."""
    return largest(camera_parts_below_window(p, c))


def camera_parts_below_window(p: FoldProblem, c: Camera) -> tuple[Array, Array, Array]:
    """The upper corners of the barrel and of the housing's front and rear clear the window."""
    z, least = c.corners_z_mm, p.clearance_mm - p.window_z_mm
    return z[0] + least, z[2] + least, z[4] + least


def camera_beside_view(p: FoldProblem, s: Sight, c: Camera) -> Array:
    """No corner of the camera is in the view on its way to the mirror."""
    missed: Any = -np.inf
    for k in range(len(c.corners_x_mm)):
        x, z = c.corners_x_mm[k], c.corners_z_mm[k]
        missed = larger(missed, x - near_edge_x_mm(s, z) + p.clearance_mm)
    return missed


def camera_clear_of_mirror(p: FoldProblem, m: Mirror, c: Camera) -> Array:
    """Every corner of the camera is above the mirror's plane, or every one before its end."""
    gap, lower_end = p.clearance_mm, lower_end_x_mm(p, m)
    below, behind = -np.inf, -np.inf
    for k in range(len(c.corners_x_mm)):
        x, z = c.corners_x_mm[k], c.corners_z_mm[k]
        below = larger(below, gap - height_over_mm(m, x, z))
        behind = larger(behind, x - lower_end + gap)
    return smaller(below, behind)


def view_below_ledge(p: FoldProblem, m: Mirror, c: Camera, ledge_x_mm: Array) -> Array:
    """The view from the camera to the mirror's upper end passes below ledge and beam."""
    climb = (m.upper_z_mm - c.z_mm) / (m.upper_x_mm - c.x_mm)
    at_edge = _view_above_ledge_mm(p, c, climb, ledge_x_mm)
    at_beam = _view_above_ledge_mm(p, c, climb, ledge_x_mm - p.ledge_reach_mm)
    return larger(at_edge, at_beam)


def _view_above_ledge_mm(p: FoldProblem, c: Camera, climb: Array, x_mm: Array) -> Array:
    """How far the view, where it is before the camera, is above the ledge's lower face."""
    seen_z = choose(x_mm > c.x_mm, c.z_mm + climb * (x_mm - c.x_mm), -np.inf)
    return seen_z + p.clearance_mm - _ledge_z_mm(p)


def camera_clear_of_ledge(p: FoldProblem, c: Camera, ledge_x_mm: Array) -> Array:
    """No corner of the camera is below the beam, nor the edge of the beam in the camera."""
    beam_x, ledge_z, gap = ledge_x_mm - p.ledge_reach_mm, _ledge_z_mm(p), p.clearance_mm
    missed = gap - distance_outside_mm(p, c, beam_x, ledge_z)
    for k in range(len(c.corners_x_mm)):
        x, z = c.corners_x_mm[k], c.corners_z_mm[k]
        missed = larger(missed, smaller(x - beam_x, z - ledge_z + gap))
    return missed


SHARED = (
    ledge_edge_x_mm,
    _ledge_z_mm,
    mirror_below_window,
    mirror_before_camera,
    camera_below_window,
    camera_parts_below_window,
    camera_beside_view,
    camera_clear_of_mirror,
    view_below_ledge,
    _view_above_ledge_mm,
    camera_clear_of_ledge,
)
