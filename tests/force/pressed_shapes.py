"""Pictures of rigid shapes pressed on the gel, whose forces are known.

Forces that push and make the surface follow the shape are found on a pad of half the bundle's pitch
and eight layers, with the operator of the infinite layer. The picture shows the motion under
exactly these forces. What the mesh has wrong near a force is taken off both, and the renderer is
that of `pressed_samples`.

A ball has the motion of axisymmetric elements instead. Where only nodes touch it the dent is not
round enough: the force of a named ball was 8 to 13 % off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from ball_motion import ball_motion, round_share
from numpy.typing import NDArray
from pressed_disc import pressed_disc
from pressed_samples import Pressed, drawn, fine_pad
from sensor_samples import sensor_bundle

from ifem_export.operators.surface_operator import surface_operator

Array = NDArray[np.float64]
Profile = Callable[[Array, Array], Array]
_STEPS = 150


@dataclass(frozen=True)
class Shape:
    """A rigid shape.

    Attributes:
        named: Its name for `--indenter`; empty where there is none.
        profile: Height above its lowest point at offsets along x' and y'.
        ball_mm: Its radius where it is a ball; 0 for others.
    """

    named: str
    profile: Profile
    ball_mm: float = 0.0


def ball(radius_mm: float) -> Shape:
    return Shape(f"sphere:{radius_mm:g}", lambda x, y: _arc(radius_mm, np.hypot(x, y)), radius_mm)


def rod(radius_mm: float, length_mm: float = 80.0) -> Shape:
    """A cylinder along x'; a short one has its ends on the gel."""
    named = f"cylinder:{radius_mm:g}" if length_mm > 40 else ""
    return Shape(named, lambda x, y: _arc(radius_mm, y) + _beyond(np.abs(x) - length_mm / 2))


def punch(radius_mm: float) -> Shape:
    return Shape("", lambda x, y: _beyond(np.hypot(x, y) - radius_mm))


def edge(length_mm: float) -> Shape:
    """A wedge of 100 degrees with a tip of 0.4 mm radius, along x'."""

    def profile(x: Array, y: Array) -> Array:
        tip, slope = 0.4, 1 / np.tan(np.deg2rad(50))
        away, touching = np.abs(y), 0.4 * np.sin(np.arctan(slope))
        flank = _arc(tip, np.array([touching]))[0] + slope * (away - touching)
        round_part = _arc(tip, np.minimum(away, touching))
        return np.where(away < touching, round_part, flank) + _beyond(np.abs(x) - length_mm / 2)

    return Shape("", profile)


def two_balls(radius_mm: float, apart_mm: float) -> Shape:
    half = apart_mm / 2
    return Shape(
        "",
        lambda x, y: np.minimum(
            _arc(radius_mm, np.hypot(x - half, y)), _arc(radius_mm, np.hypot(x + half, y))
        ),
    )


def pressed_shape(
    shape: Shape, depth_mm: float, place_mm: tuple[float, float], angle_deg: float, seed: int
) -> Pressed:
    """The picture of a shape whose lowest point is `depth_mm` below the untouched surface."""
    if shape.ball_mm:
        return pressed_ball(shape.ball_mm, depth_mm, place_mm, seed)
    pad, points = fine_pad(), fine_pad().points_mm
    layer = surface_operator(pad.mesh, sensor_bundle().material, "bbar", "fft")
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    dx, dy = points[:, 0] - place_mm[0], points[:, 1] - place_mm[1]
    gap = depth_mm - shape.profile(c * dx + s * dy, c * dy - s * dx)

    def sinking(push: Array) -> Array:
        force = _downwards(push)
        return -(layer.displacement(force) + pad.near.missing(force))[:, 2]

    force = _downwards(_contact(sinking, gap))
    return drawn(force, pad.displacement(force), seed)


def pressed_ball(
    radius_mm: float, depth_mm: float, place_mm: tuple[float, float], seed: int
) -> Pressed:
    """The picture of a ball to which the gel sticks."""
    pad, place, gel = fine_pad(), np.array(place_mm), sensor_bundle().material
    thickness = pad.mesh.layers * pad.mesh.cell_size_mm[2]
    disc = pressed_disc(radius_mm, thickness, gel.poissons_ratio, True)
    push = float(np.interp(depth_mm, -disc.height_mm[:, 0], disc.force_n))
    push *= gel.youngs_modulus_mpa
    contact_mm = disc.at_force(push / gel.youngs_modulus_mpa)[0]
    force = _downwards(push * round_share(pad.points_mm, place, contact_mm))
    motion = ball_motion(disc, pad, place, push)
    return drawn(force, motion(pad.points_mm[:, :2]), seed)


def _downwards(push: Array) -> Array:
    return np.outer(push, [0.0, 0.0, -1.0])


def _contact(sinking: Callable[[Array], Array], gap: Array) -> Array:
    """Pushes (n,) p >= 0 with sinking >= gap where p > 0: accelerated projected gradients."""
    candidates = gap > 0
    probe = np.where(candidates, 1.0, 0.0)
    for _ in range(8):
        grown = np.where(candidates, sinking(probe), 0.0)
        largest = float(np.linalg.norm(grown) / np.linalg.norm(probe))
        probe = grown / np.linalg.norm(grown)
    push = ahead = np.zeros(len(gap))
    momentum = 1.0
    for _ in range(_STEPS):
        step = ahead + (gap - sinking(ahead)) / (1.05 * largest)
        found = np.where(candidates, np.maximum(step, 0.0), 0.0)
        following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = found + (momentum - 1) / following * (found - push)
        push, momentum = found, following
    return push


def _arc(radius_mm: float, away: Array) -> Array:
    inside = np.minimum(away, radius_mm)
    height = radius_mm - np.sqrt(np.maximum(radius_mm**2 - inside**2, 0.0))
    return height + _beyond(away - radius_mm)


def _beyond(outside: Array) -> Array:
    """High where beyond the shape."""
    return np.where(outside > 0, 1e3, 0.0)
