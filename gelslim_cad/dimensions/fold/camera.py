"""The camera's body in the mid-plane: housing and lens barrel about the entrance pupil."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_cad.dimensions.fold.sight import Sight

Corners = tuple[Array, Array, Array, Array, Array, Array]
"""A coordinate of the barrel's front, the housing's front and its rear: upper, lower corner."""


class Camera(NamedTuple):
    """Entrance pupil, pitch of the axis, and corners (x, z) of housing and lens barrel; mm."""

    x_mm: Array
    z_mm: Array
    cos: Array
    """Cosine of the pitch."""
    sin: Array
    face_mm: Array
    """How far the entrance pupil is before the housing's front face."""
    corners_x_mm: Corners
    corners_z_mm: Corners


def pitch_rad(s: Sight, mirror_rad: Array) -> Array:
    """Pitch of the axis down towards the mirror."""
    return np.pi / 2 - 2 * mirror_rad - s.tilt_rad


def camera(
    p: FoldProblem, x_mm: Array, z_mm: Array, pitch_rad: Array, extension_mm: Array
) -> Camera:
    """The camera about its entrance pupil, its lens moved out by `extension_mm`."""
    c, s = np.cos(pitch_rad), np.sin(pitch_rad)
    half, radius = p.module_height_mm / 2, p.lens_diameter_mm / 2
    face, lens = p.entrance_pupil_mm + extension_mm, lens_front_mm(p)
    lens_x, lens_z = x_mm + lens * c, z_mm - lens * s
    front, rear = -face, -face - p.module_depth_mm
    front_x, front_z = x_mm + front * c, z_mm - front * s
    rear_x, rear_z = x_mm + rear * c, z_mm - rear * s
    return Camera(
        x_mm=x_mm,
        z_mm=z_mm,
        cos=c,
        sin=s,
        face_mm=face,
        corners_x_mm=(
            lens_x + radius * s,
            lens_x - radius * s,
            front_x + half * s,
            front_x - half * s,
            rear_x + half * s,
            rear_x - half * s,
        ),
        corners_z_mm=(
            lens_z + radius * c,
            lens_z - radius * c,
            front_z + half * c,
            front_z - half * c,
            rear_z + half * c,
            rear_z - half * c,
        ),
    )


def lens_front_mm(p: FoldProblem) -> Array:
    """How far the lens barrel's front is before the entrance pupil; both move together."""
    return p.lens_height_mm - p.entrance_pupil_mm


def largest(values: tuple[Array, ...]) -> Array:
    """The largest of the values."""
    found = values[0]
    for k in range(1, len(values)):
        found = larger(found, values[k])
    return found


def smallest(values: tuple[Array, ...]) -> Array:
    """The smallest of the values."""
    found = values[0]
    for k in range(1, len(values)):
        found = smaller(found, values[k])
    return found


def distance_outside_mm(p: FoldProblem, camera: Camera, x_mm: Array, z_mm: Array) -> Array:
    """How far a point before or above the camera is outside housing and lens barrel."""
    dx, dz = x_mm - camera.x_mm, z_mm - camera.z_mm
    c, s = camera.cos, camera.sin
    ahead, above = dx * c - dz * s, dx * s + dz * c
    housing = larger(ahead + camera.face_mm, above - p.module_height_mm / 2)
    barrel = larger(ahead - lens_front_mm(p), above - p.lens_diameter_mm / 2)
    return smaller(housing, barrel)


SHARED = (pitch_rad, camera, lens_front_mm, largest, smallest, distance_outside_mm)
