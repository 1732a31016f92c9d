"""What the printed finger asks of the fold: length, envelope, clamp, seat, baffles and cable.

The formulas of clamp, ends and cable stand here once: `housing`, `seat` and `cable` make dimensions
of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.camera import Camera, largest, lens_front_mm
from gelslim_cad.dimensions.fold.mirror import (
    Mirror,
    lower_end_x_mm,
    mirror_half_width_mm,
)
from gelslim_cad.dimensions.fold.problem import NO_LIMIT_MM, Array, FoldProblem, larger, smaller
from gelslim_cad.dimensions.fold.sight import Sight
from gelslim_cad.dimensions.registry import Real
from gelslim_optics.camera.refraction_newton import choose

CLAMP_BAR_MM = 1.5
CLAMP_LIP_MM = 1.2
CLAMP_GAP_MM = 0.15
"""Least between the clamp and an LED channel."""
CHANNEL_WALL_MM = 1.2
SEAT_STOP_MM = 1.0
LIP_GAP_MM = 0.2
"""From the clamp's lips to the front of the lens."""
LEAST_FLOOR_MM = 1.0
"""Of the clamp under a module whose cable leaves at the bottom and parts the clamp's rear."""
LEDGE_GAP_MM = 0.2
"""From the gel to the ledges that carry the window's ends."""


class HousingMissed(NamedTuple):
    """By how many mm the printed finger misses its limits; <= 0 holds."""

    thickness: Array
    length: Array
    mirror_between_baffles: Array
    clamp_before_seat: Array
    clamp_beside_channel: Array
    cable_over_cover: Array
    cable_under_roof: Array
    clamp_floor: Array


def finger_length_mm(
    p: FoldProblem, m: Mirror, c: Camera, ledge_x_mm: Array, depth: Array
) -> Array:
    """Length of the finger from its tip to the end of the mount block."""
    return largest(finger_lengths_mm(p, m, c, ledge_x_mm, depth))


def finger_lengths_mm(
    p: FoldProblem, m: Mirror, c: Camera, ledge_x_mm: Array, depth: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Lengths that the camera's rear corners, its clamp's foot and top, and the bezel need."""
    fit, outside = p.fit_clearance_mm, tip_x_mm(p, m) + p.mount_length_mm
    behind = outside + p.cable_behind_mm + fit
    back, cover_z = c.face_mm + p.module_depth_mm + p.clamp_play_mm, p.window_z_mm - depth
    foot, top = clamp_ends_x_mm(c.x_mm, c.z_mm, c.cos, c.sin, back, p.module_height_mm / 2, cover_z)
    bezel_x = ledge_x_mm - p.end_support_mm - fit - p.tip_wall_mm
    upper, lower = c.corners_x_mm[4], c.corners_x_mm[5]
    return behind - upper, behind - lower, behind - foot, behind - top, outside + 1.0 - bezel_x


def tip_x_mm(p: FoldProblem, m: Mirror) -> Array:
    """Tip of the finger: behind the window's end, or behind a mirror that reaches farther."""
    rear = m.upper_x_mm + p.mirror_border_mm * m.cos + p.mirror_thickness_mm * m.sin
    beside = p.clearance_mm < p.ledge_depth_mm + p.fit_clearance_mm
    clear = choose(beside, rear + p.fit_clearance_mm, -np.inf)
    ledge = larger(p.gel_length_mm / 2 + LEDGE_GAP_MM, clear)
    return larger(ledge + p.end_support_mm, rear) + p.fit_clearance_mm + p.tip_wall_mm


def clamp_ends_x_mm(
    x: Real, z: Real, cos: Real, sin: Real, back: Real, half_height: Real, cover_z: Real
) -> tuple[Real, Real]:
    """Rearmost points of the clamp's bar, at its foot on the cover and at its top.

    The camera stands at (x, z) with the cosine and sine of its pitch; `back` is from its pinhole
    to the bar. All lengths in mm.
    """
    behind = back + CLAMP_BAR_MM
    foot = (cover_z - z - behind * sin) / cos
    return x - behind * cos + foot * sin, x - behind * cos + half_height * sin


def clamp_front_x_mm(
    x: Real,
    z: Real,
    cos: Real,
    sin: Real,
    front: Real,
    low_z: Real,
    high_z: Real,
) -> Real:
    """Foremost point of the clamp's lips, `front` before the pinhole, between two heights."""
    low = (low_z - z + front * sin) / cos
    high = (high_z - z + front * sin) / cos
    return x + front * cos + larger(low * sin, high * sin)


def lip_front_mm(face: Real, proud: Real, play: Real) -> Real:
    """How far the clamp's lips reach before the pinhole, the lens `proud` of the housing."""
    return play + larger(smaller(CLAMP_LIP_MM, proud - play - LIP_GAP_MM), 0.0) - face


def cable_level_mm(
    z: Real,
    cos: Real,
    sin: Real,
    back: Real,
    bar: Real,
    half_height: Real,
    half_cable: Real,
    radius: Real,
    side: Real,
) -> Real:
    """Height of the cable's middle in the mount.

    The camera's pinhole is at height z, its pitch has this cosine and sine; `back` is from the
    pinhole to the module's rear face and `bar` to the clamp's. The cable leaves at the top or
    bottom of the rear face (`side` 1 or -1), or behind its middle (0). All lengths in mm.
    """
    behind = z + bar * sin + choose(sin < 0, -1.0, 1.0) * radius * (1 - cos)
    edge = z + (back - half_cable) * sin + side * half_height * cos
    return choose(side == 0, behind, edge + side * radius * (1 + side * sin))


def clamp_floor_mm(
    z: Real, cos: Real, sin: Real, face: Real, bar: Real, below: Real, cover_z: Real
) -> Real:
    """Thickness of the clamp's floor over the cover, at its front or rear, the lower of both.

    The module reaches `below` under the pinhole's axis, from `face` before the pinhole to `bar`
    behind it. All lengths in mm.
    """
    return z - below * cos - cover_z + smaller(face * sin, bar * sin)


def housing_missed(
    p: FoldProblem, s: Sight, m: Mirror, c: Camera, ledge_x_mm: Array, depth: Array
) -> HousingMissed:
    """How far envelope, mirror and clamp miss their limits."""
    fit, lower_x = p.fit_clearance_mm, lower_end_x_mm(p, m)
    front = lip_front_mm(c.face_mm, c.face_mm + lens_front_mm(p), p.clamp_play_mm)
    lower_z, cover_z = m.lower_z_mm - p.mirror_border_mm * m.sin, p.window_z_mm - depth
    lips_x = clamp_front_x_mm(c.x_mm, c.z_mm, c.cos, c.sin, front, cover_z, lower_z)
    channel_x = ledge_x_mm - p.end_support_mm - fit - CHANNEL_WALL_MM
    beside = larger(p.baffle_inner_y_mm - p.clamp_width_mm / 2, channel_x - largest(c.corners_x_mm))
    half_width = mirror_half_width_mm(s, m) + p.mirror_border_mm
    back, half_height = c.face_mm + p.module_depth_mm, p.module_height_mm / 2
    bar = back + p.clamp_play_mm + CLAMP_BAR_MM
    level = cable_level_mm(
        c.z_mm, c.cos, c.sin, back, bar, half_height, p.cable_half_mm, p.cable_radius_mm,
        p.cable_side,
    )  # fmt: skip
    floor = clamp_floor_mm(
        c.z_mm, c.cos, c.sin, c.face_mm, bar, half_height + p.clamp_play_mm, cover_z
    )
    return HousingMissed(
        thickness=depth - p.max_depth_mm,
        length=finger_length_mm(p, m, c, ledge_x_mm, depth) - p.max_length_mm,
        mirror_between_baffles=half_width + 2 * fit - p.baffle_inner_y_mm,
        clamp_before_seat=lips_x - (lower_x - SEAT_STOP_MM) + fit,
        clamp_beside_channel=CLAMP_GAP_MM - beside,
        cable_over_cover=cover_z + p.cable_over_cover_mm - level,
        cable_under_roof=level + p.cable_under_skin_mm,
        clamp_floor=choose(p.cable_side < 0, LEAST_FLOOR_MM - floor, -NO_LIMIT_MM),
    )


SHARED = (
    finger_length_mm,
    finger_lengths_mm,
    tip_x_mm,
    clamp_ends_x_mm,
    clamp_front_x_mm,
    lip_front_mm,
    cable_level_mm,
    clamp_floor_mm,
    housing_missed,
)
