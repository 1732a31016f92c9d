"""How far a tool reaches from its axis and how steep it is, by the depth of its lowest point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

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
from gelslim_twin.scene.stl_extent import footprint_mm


def tool_reach_mm(indenters: Sequence[Indenter], folder: Path, depth_mm: float) -> float:
    """Largest distance from the tool's axis of what lies below the gel's undeformed surface.

    0 where nothing does. Raises ValueError or OSError for an STL file (in `folder`) that cannot be
    read.
    """
    return max(
        (
            math.hypot(one.x_mm, one.y_mm) + shape_reach_mm(one, folder, depth_mm - one.raised_mm)
            for one in indenters
            if depth_mm > one.raised_mm
        ),
        default=0.0,
    )


def tool_steepness(indenters: Sequence[Indenter], depth_mm: float) -> float:
    """Largest slope below the surface, infinite for shapes with walls; 0 where nothing is below."""
    return max(
        (_steepest(one, depth_mm - one.raised_mm) for one in indenters if depth_mm > one.raised_mm),
        default=0.0,
    )


def shape_reach_mm(indenter: Indenter, folder: Path, d: float) -> float:
    """Largest distance from the axis of a shape, at a depth `d` above 0.

    Raises as `tool_reach_mm`.
    """
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
            return math.hypot(_flank(indenter, d), indenter.length_mm / 2)
        case Cone():
            return _flank(indenter, d)
        case TexturedPlane():
            return math.hypot(indenter.length_mm, indenter.width_mm) / 2
        case Stl():
            # The lowest point need not lie in the middle.
            return math.hypot(*footprint_mm(folder / indenter.file, indenter.down, indenter.scale))


def _steepest(indenter: Indenter, d: float) -> float:
    if isinstance(indenter, Sphere):
        r = indenter.radius_mm
        return _circle(r, d) / (r - d) if d < r else math.inf
    if isinstance(indenter, Cone):
        return 1 / math.tan(math.radians(indenter.included_angle_deg / 2))
    return math.inf


def _circle(r: float, d: float) -> float:
    return r if d >= r else math.sqrt(2 * r * d - d * d)


def _flank(indenter: Wedge | Cone, d: float) -> float:
    """Half width of the section, rounded at its tip."""
    tip, half = indenter.tip_radius_mm, math.radians(indenter.included_angle_deg / 2)
    d0, w0 = tip * (1 - math.sin(half)), tip * math.cos(half)
    return _circle(tip, d) if d <= d0 else w0 + (d - d0) * math.tan(half)
