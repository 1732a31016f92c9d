"""The mirror that folds the view: as high below the window and as long as the view needs it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_cad.dimensions.fold.sight import Sight, far_edge_x_mm

FLATTEST_RAD = float(np.radians(12.0))
STEEPEST_RAD = float(np.radians(50.0))
"""Angles between which the search looks for the mirror."""


class Mirror(NamedTuple):
    """The part of the mirror that the view meets; lengths mm."""

    cos: Array
    """Cosine of the mirror's angle."""
    sin: Array
    upper_x_mm: Array
    upper_z_mm: Array
    lower_x_mm: Array
    lower_z_mm: Array
    length_mm: Array


def mirror(p: FoldProblem, s: Sight, cos: Array, sin: Array) -> Mirror:
    """The mirror at an angle whose upper end, border included, just clears the window."""
    upper_z = p.window_z_mm - p.clearance_mm - p.mirror_border_mm * sin
    upper_x = far_edge_x_mm(s, upper_z)
    length = (upper_x - s.virtual_x_mm - s.shallowest * (upper_z - s.virtual_z_mm)) / (
        cos - s.shallowest * sin
    )
    return Mirror(
        cos=cos,
        sin=sin,
        upper_x_mm=upper_x,
        upper_z_mm=upper_z,
        lower_x_mm=upper_x - length * cos,
        lower_z_mm=upper_z - length * sin,
        length_mm=length,
    )


def mirror_angle_rad(turn_rad: Array, mid_rad: Array) -> Array:
    """Angle of the mirror whose normal is `turn_rad` from halfway between mean ray and gel.

    The same turn gives about the same pitch of the camera, whatever the mean ray.
    """
    return smaller(larger(turn_rad - mid_rad / 2, FLATTEST_RAD), STEEPEST_RAD)


def mirror_half_width_mm(s: Sight, m: Mirror) -> Array:
    """Half the width that the view takes on the mirror, at whichever end it takes more."""
    return larger(
        s.near_corner_across * (m.lower_z_mm - s.virtual_z_mm),
        s.far_corner_across * (m.upper_z_mm - s.virtual_z_mm),
    )


def height_over_mm(m: Mirror, x_mm: Array, z_mm: Array) -> Array:
    """Distance of a point from the mirror's plane, positive on the gel's side."""
    return (x_mm - m.upper_x_mm) * -m.sin + (z_mm - m.upper_z_mm) * m.cos


def reflected(m: Mirror, x_mm: Array, z_mm: Array) -> tuple[Array, Array]:
    """The mirror image of a point."""
    away = height_over_mm(m, x_mm, z_mm)
    return x_mm + 2 * away * m.sin, z_mm - 2 * away * m.cos


def lower_end_x_mm(p: FoldProblem, m: Mirror) -> Array:
    """Where the glass ends, its border included."""
    return m.lower_x_mm - p.mirror_border_mm * m.cos


def mirror_depth_mm(p: FoldProblem, m: Mirror) -> Array:
    """How far the glass reaches below the window."""
    back_z = m.lower_z_mm - p.mirror_border_mm * m.sin - p.mirror_thickness_mm * m.cos
    return p.window_z_mm - back_z


SHARED = (
    mirror,
    mirror_angle_rad,
    mirror_half_width_mm,
    height_over_mm,
    reflected,
    lower_end_x_mm,
    mirror_depth_mm,
)
