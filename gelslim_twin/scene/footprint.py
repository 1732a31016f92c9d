"""Footprint of a tool below the gel's undeformed surface, in closed form by depth.

A mesh counts with its extents.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

from gelslim_twin.effects.contact_estimate import Footprint
from gelslim_twin.scene.indenter import (
    Cone,
    Cylinder,
    FlatPunch,
    Indenter,
    MeshFile,
    Ring,
    Sphere,
    TexturedPlane,
    Wedge,
)
from gelslim_twin.scene.mesh_file import footprint_mm

Pair = Callable[[float], tuple[float, float]]
"""Area in mm² and volume in mm³ at a depth above 0."""


def tool_footprint(
    indenters: Sequence[Indenter], folder: Path, pad_mm2: float, node_pitch_mm: float = 0.0
) -> Footprint:
    """Sum over the indenters of a tool, at most the pad of `pad_mm2`; overlaps count twice.

    Parts narrower than the distance `node_pitch_mm` of the nodes count with that width, because
    they push down a node by their whole depth.

    Raises ValueError or OSError for a mesh (in `folder`) that cannot be read.
    """
    shapes = [(_on_nodes(one, folder, node_pitch_mm), one.raised_mm) for one in indenters]

    def parts(depth: float) -> list[tuple[float, float, float]]:
        return [shape(depth - raised) for shape, raised in shapes if depth > raised]

    def total(depth: float) -> tuple[float, float]:
        found = parts(depth)
        area = sum(a for a, _, _ in found)
        held = min(1.0, pad_mm2 / area) if area > 0 else 0.0
        return held * area, held * sum(v for _, v, _ in found)

    def largest(value: Callable[[Indenter, float], float], depth: float) -> float:
        below = [one for one in indenters if depth > one.raised_mm]
        return max((value(one, depth - one.raised_mm) for one in below), default=0.0)

    # A planner asks for them at the same few depths again and again.
    kept = lru_cache(maxsize=32)
    return Footprint(
        kept(lambda d: total(d)[0]),
        kept(lambda d: total(d)[1]),
        kept(
            lambda d: largest(
                lambda one, own: math.hypot(one.x_mm, one.y_mm) + _reach_mm(one, folder, own), d
            )
        ),
        kept(lambda d: largest(_steepest, d)),
        kept(lambda d: min((w for _, _, w in parts(d)), default=0.0)),
    )


def _on_nodes(
    indenter: Indenter, folder: Path, pitch: float
) -> Callable[[float], tuple[float, float, float]]:
    """Area, volume and width of the narrowest part of a shape, on nodes `pitch` apart."""
    pair = _pair(indenter, folder)

    def resolved(d: float) -> tuple[float, float, float]:
        area, volume = pair(d)
        length, most = 2 * _reach_mm(indenter, folder, d), math.inf
        width = area / length
        if isinstance(indenter, Ring):
            most = math.pi * indenter.outer_radius_mm**2
            width = min(width, indenter.outer_radius_mm - indenter.inner_radius_mm)
        if isinstance(indenter, TexturedPlane):
            most = indenter.length_mm * indenter.width_mm
            if d < indenter.relief_mm:
                width = min(width, indenter.pitch_mm * area / most)
        wider = max(1.0, pitch / width) * max(1.0, pitch / length)
        if wider > 1:
            area = min(max(most, area), area * wider)
            volume = area * d
        return area, volume, max(width, pitch)

    return resolved


def _pair(indenter: Indenter, folder: Path) -> Pair:
    match indenter:
        case Sphere():
            return lambda d: _round_cap(indenter.radius_mm, d)
        case Cylinder():
            return lambda d: _along(_round_section(indenter.radius_mm, d), indenter.length_mm)
        case Ring():
            return _prism(math.pi * (indenter.outer_radius_mm**2 - indenter.inner_radius_mm**2))
        case FlatPunch():
            r, a, b = indenter.radius_mm, indenter.length_mm, indenter.width_mm
            return _prism(math.pi * r * r if r is not None else (a or 0.0) * (b or 0.0))
        case Wedge():
            tip = _tip(indenter)
            return lambda d: _along(_wedge_section(*tip, d), indenter.length_mm)
        case Cone():
            tip = _tip(indenter)
            return lambda d: _cone(*tip, d)
        case TexturedPlane():
            plane = indenter.length_mm * indenter.width_mm
            return lambda d: _waves(plane, indenter.relief_mm, d)
        case MeshFile():
            a, b = footprint_mm(folder / indenter.file, indenter.down, indenter.scale)
            return _prism(a * b)


def _prism(area: float) -> Pair:
    return lambda d: (area, area * d)


def _along(section: tuple[float, float], length: float) -> tuple[float, float]:
    """Half width and area of a section, drawn out."""
    return 2 * section[0] * length, section[1] * length


def _round_cap(r: float, d: float) -> tuple[float, float]:
    if d >= r:
        return math.pi * r * r, math.pi * r * r * (2 * r / 3 + (d - r))
    return math.pi * (2 * r * d - d * d), math.pi * d * d * (r - d / 3)


def _round_section(r: float, d: float) -> tuple[float, float]:
    if d >= r:
        return r, math.pi * r * r / 2 + 2 * r * (d - r)
    w = _circle(r, d)
    return w, r * r * math.acos((r - d) / r) - (r - d) * w


def _tip(indenter: Wedge | Cone) -> tuple[float, float]:
    """Radius of the tip, and half of the angle between the flanks in rad."""
    return indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)


def _tangent(tip: float, half: float) -> tuple[float, float]:
    """Depth and half width where the rounded tip goes over into the flank."""
    return tip * (1 - math.sin(half)), tip * math.cos(half)


def _flank(tip: float, half: float, d: float) -> float:
    """Half width of a rounded tip and its flanks."""
    d0, w0 = _tangent(tip, half)
    return _circle(tip, d) if d <= d0 else w0 + (d - d0) * math.tan(half)


def _wedge_section(tip: float, half: float, d: float) -> tuple[float, float]:
    (d0, w0), w = _tangent(tip, half), _flank(tip, half, d)
    if d <= d0:
        return _round_section(tip, d)
    round_part = _round_section(tip, d0)[1] if d0 > 0 else 0.0
    return w, round_part + (w0 + w) * (d - d0)


def _cone(tip: float, half: float, d: float) -> tuple[float, float]:
    (d0, w0), w = _tangent(tip, half), _flank(tip, half, d)
    if d <= d0:
        return _round_cap(tip, d)
    frustum = math.pi / 3 * (d - d0) * (w0 * w0 + w0 * w + w * w)
    return math.pi * w * w, (_round_cap(tip, d0)[1] if d0 > 0 else 0.0) + frustum


def _waves(plane: float, relief: float, d: float) -> tuple[float, float]:
    """Sine waves with their crests down; bumps and rough planes touch with less."""
    if d >= relief:
        return plane, plane * (d - relief / 2)
    t = math.acos(1 - 2 * d / relief)
    return plane * t / math.pi, plane / math.pi * ((d - relief / 2) * t + relief / 2 * math.sin(t))


def _reach_mm(indenter: Indenter, folder: Path, d: float) -> float:
    """Largest distance from the axis of a shape, at a depth `d` above 0."""
    match indenter:
        case Sphere():
            return _circle(indenter.radius_mm, d)
        case Cylinder():
            return math.hypot(_circle(indenter.radius_mm, d), indenter.length_mm / 2)
        case Ring():
            return indenter.outer_radius_mm
        case FlatPunch():
            if indenter.radius_mm is not None:
                return indenter.radius_mm
            return math.hypot(indenter.length_mm or 0.0, indenter.width_mm or 0.0) / 2
        case Wedge():
            return math.hypot(_flank(*_tip(indenter), d), indenter.length_mm / 2)
        case Cone():
            return _flank(*_tip(indenter), d)
        case TexturedPlane():
            return math.hypot(indenter.length_mm, indenter.width_mm) / 2
        case MeshFile():
            # The lowest point need not lie in the middle.
            return math.hypot(*footprint_mm(folder / indenter.file, indenter.down, indenter.scale))


def _steepest(indenter: Indenter, d: float) -> float:
    """Largest slope, infinite for shapes with walls."""
    if isinstance(indenter, Sphere):
        r = indenter.radius_mm
        return _circle(r, d) / (r - d) if d < r else math.inf
    if isinstance(indenter, Cone):
        return 1 / math.tan(math.radians(indenter.included_angle_deg / 2))
    return math.inf


def _circle(r: float, d: float) -> float:
    return r if d >= r else math.sqrt(2 * r * d - d * d)
