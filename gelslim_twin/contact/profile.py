"""Heights of a tool's shapes over their own lowest point, pointing down, upright."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.indenter import (
    Cone,
    Cylinder,
    FlatPunch,
    Indenter,
    Ring,
    Sphere,
    Stl,
    TexturedPlane,
    Wedge,
)

Array = NDArray[np.float64]
Profile = Callable[[Array, Array], Array]
"""Height in mm of the lower surface over points x and y (n,); infinite beside the shape."""
RIM_MM = 0.01
"""Points this far beside a rim count as on it: rounding must not decide about whole rows of nodes
that stick exactly there."""


def profile(indenter: Indenter, folder: Path, seed: int = 0) -> Profile:
    """Lower surface of a shape about its own origin. Raises ValueError or OSError for a bad STL."""
    match indenter:
        case Sphere():
            return lambda x, y: _arc(indenter.radius_mm, np.hypot(x, y))
        case Cylinder():
            half = indenter.length_mm / 2 + RIM_MM
            return _turned(
                indenter.axis_deg,
                lambda x, y: _within(np.abs(x) <= half, _arc(indenter.radius_mm, np.abs(y))),
            )
        case Ring():
            inner = indenter.inner_radius_mm - RIM_MM
            outer = indenter.outer_radius_mm + RIM_MM
            return lambda x, y: _flat((np.hypot(x, y) >= inner) & (np.hypot(x, y) <= outer))
        case FlatPunch():
            return _punch(indenter)
        case Wedge():
            half = indenter.length_mm / 2 + RIM_MM
            tip, lean = indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)
            return _turned(
                indenter.axis_deg,
                lambda x, y: _within(np.abs(x) <= half, _tipped(tip, lean, np.abs(y))),
            )
        case Cone():
            tip, lean = indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)
            return lambda x, y: _tipped(tip, lean, np.hypot(x, y))
        case TexturedPlane():
            return _texture(indenter, seed)
        case Stl():
            from gelslim_twin.contact.relief import stl_profile

            return stl_profile(indenter, folder)


def _punch(punch: FlatPunch) -> Profile:
    if punch.radius_mm is not None:
        radius = punch.radius_mm + RIM_MM
        return lambda x, y: _flat(np.hypot(x, y) <= radius)
    a, b = (punch.length_mm or 0.0) / 2 + RIM_MM, (punch.width_mm or 0.0) / 2 + RIM_MM
    return lambda x, y: _flat((np.abs(x) <= a) & (np.abs(y) <= b))


def _texture(plane: TexturedPlane, seed: int) -> Profile:
    """Waves with their crests at height 0 pointing down; rough ones from a sum of random waves."""
    wave, relief = 2 * math.pi / plane.pitch_mm, plane.relief_mm

    def ridges(x: Array, y: Array) -> Array:
        return np.asarray(relief / 2 * (1 - np.cos(wave * y)))

    def bumps(x: Array, y: Array) -> Array:
        return np.asarray(relief / 4 * (2 - np.cos(wave * x) - np.cos(wave * y)))

    if plane.texture == "rough":
        from gelslim_twin.contact.relief import rough_profile

        relief_of: Profile = rough_profile(plane, seed)
    else:
        relief_of = ridges if plane.texture == "ridges" else bumps
    a, b = plane.length_mm / 2 + RIM_MM, plane.width_mm / 2 + RIM_MM

    def cut(x: Array, y: Array) -> Array:
        return _within((np.abs(x) <= a) & (np.abs(y) <= b), relief_of(x, y))

    return _turned(plane.axis_deg, cut)


def _turned(angle_deg: float, shape: Profile) -> Profile:
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return lambda x, y: shape(c * x + s * y, c * y - s * x)


def _arc(radius: float, reach: Array) -> Array:
    inside = reach <= radius
    # r² / (R + √(R² - r²)) keeps its digits near the pole, R - √(R² - r²) does not.
    square = np.minimum(reach, radius) ** 2
    height = square / (radius + np.sqrt(np.maximum(radius * radius - square, 0.0)))
    return _within(inside, height)


def _tipped(tip: float, half: float, reach: Array) -> Array:
    """Flanks at `half` from the axis behind a round tip that they touch."""
    edge, start = tip * math.cos(half), tip * (1 - math.sin(half))
    flank = start + (reach - edge) / math.tan(half)
    if tip == 0:
        return np.asarray(flank)
    return np.where(reach <= edge, _arc(tip, np.minimum(reach, edge)), flank)


def _flat(inside: NDArray[np.bool_]) -> Array:
    return np.where(inside, 0.0, np.inf)


def _within(inside: NDArray[np.bool_], height: Array) -> Array:
    return np.where(inside, height, np.inf)
