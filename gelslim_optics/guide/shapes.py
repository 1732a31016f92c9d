"""Profiles of light guides under a gel: curved (GelSlim 2), or with 45° mirrors (GelSlim 1).

    curved          ____gel____          mirror45        ____gel____
                 __|___________|__                     _|___________|_
               /  ______________  \\                  /  ___________  \\
              |  /              \\  |                |  |           |  |
              |_|                |_|                |__|           |__|

Media by name: acrylic, gel, air, paint (the coat on the outer face of the gel), mirror.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Point, Segment

LARGEST_BEND_RAD = math.radians(150.0)
Fit = Literal["glued", "air_gap"]


@dataclass(frozen=True)
class GelSection:
    """Cross-section of the pad, centred on the window.

    Attributes:
        width_mm: Width across the finger.
        thickness_mm: Thickness at the edge.
        crown_mm: How much thicker the pad is in the middle.
    """

    width_mm: float
    thickness_mm: float
    crown_mm: float = 0.0


@dataclass(frozen=True)
class CurvedGuide:
    """A flat window with a bend at each side and straight legs to the LEDs.

    Attributes:
        flat_width_mm: Width of the flat window.
        thickness_mm: Thickness t of window and bends.
        inner_radius_mm: Inner radius R of the bends.
        leg_mm: Length of the legs.
        bend_rad: Angle of the bends, at most 150 degrees.
        foot_thickness_mm: Thickness at the foot of a leg that tapers symmetrically; None for
            parallel walls.
        window_top_z_mm: Height of the face to which the gel is bonded.
    """

    flat_width_mm: float
    thickness_mm: float
    inner_radius_mm: float
    leg_mm: float
    bend_rad: float = math.pi / 2
    foot_thickness_mm: float | None = None
    window_top_z_mm: float = 0.0


def curved_profile(guide: CurvedGuide, gel: GelSection | None = None) -> GuideProfile:
    """The cross-section of a curved guide.

    Args:
        guide: The guide.
        gel: The pad on the window; None without.

    Returns:
        The edges of the guide, with the acrylic on their left, and of the gel.

    Raises:
        ValueError: A length is not positive, the inner radius is 0 (a sharp inner edge cannot be
            bent and guides no light), a bend is above 150 degrees, or the gel is wider than the
            flat window.
    """
    _check_curved(guide)
    right = _curved_side(guide)
    left = [_mirrored(edge) for edge in reversed(right)]
    half, top = guide.flat_width_mm / 2, guide.window_top_z_mm
    bottom = top - guide.thickness_mm
    edges = [
        *_window_top(half, top, gel),
        *left,
        Edge("window_bottom", Segment((-half, bottom), (half, bottom)), "acrylic", "air"),
        *right,
    ]
    return GuideProfile((*edges, *_gel_edges(top, gel)))


@dataclass(frozen=True)
class MirrorGuide:
    """A flat window with straight legs and 45 degree mirrors in the corners.

    Attributes:
        flat_width_mm: Width of the flat window.
        thickness_mm: Thickness of window and legs.
        leg_mm: Length of the legs, from the lower face of the window.
        fit: `glued`: window and legs are one piece whose cut corner is silvered. `air_gap`: the
            window ends in a vertical face, the leg below in a horizontal face, and a separate
            mirror turns the light in the air between them.
        window_top_z_mm: Height of the face to which the gel is bonded.
    """

    flat_width_mm: float
    thickness_mm: float
    leg_mm: float
    fit: Fit = "glued"
    window_top_z_mm: float = 0.0


def mirror_profile(guide: MirrorGuide, gel: GelSection | None = None) -> GuideProfile:
    """The cross-section of a guide with 45 degree mirrors.

    Args:
        guide: The guide.
        gel: The pad on the window; None without.

    Returns:
        The edges of the guide and of the gel; with `air_gap` the legs are bodies of their own.

    Raises:
        ValueError: A length is not positive, the fit is unknown, or the gel is wider than the flat
            window.
    """
    _require_positive(
        flat_width_mm=guide.flat_width_mm, thickness_mm=guide.thickness_mm, leg_mm=guide.leg_mm
    )
    if guide.fit not in get_args(Fit):
        raise ValueError(f"fit = {guide.fit!r}: must be one of {', '.join(get_args(Fit))}")
    half, top = guide.flat_width_mm / 2, guide.window_top_z_mm
    bottom = top - guide.thickness_mm
    right = _glued_side(guide) if guide.fit == "glued" else _air_gap_side(guide)
    left = [_mirrored(edge) for edge in reversed(right)]
    edges = [
        *_window_top(half, top, gel),
        *left,
        Edge("window_bottom", Segment((-half, bottom), (half, bottom)), "acrylic", "air"),
        *right,
    ]
    return GuideProfile((*edges, *_gel_edges(top, gel)))


def _curved_side(guide: CurvedGuide) -> list[Edge]:
    """The right side, from the lower face of the window over the foot to its upper face."""
    y, z = guide.flat_width_mm / 2, guide.window_top_z_mm - guide.thickness_mm
    inner, t = guide.inner_radius_mm, guide.thickness_mm
    centre, end = (y, z - inner), math.pi / 2 - guide.bend_rad
    foot = t if guide.foot_thickness_mm is None else guide.foot_thickness_mm
    out, down = (math.cos(end), math.sin(end)), (math.sin(end), -math.cos(end))

    def at(radius: float, along: float) -> Point:
        return (
            centre[0] + radius * out[0] + along * down[0],
            centre[1] + radius * out[1] + along * down[1],
        )

    middle = inner + t / 2
    corners = (
        at(inner, 0),
        at(middle - foot / 2, guide.leg_mm),
        at(middle + foot / 2, guide.leg_mm),
        at(inner + t, 0),
    )
    inner_arc = Arc(centre, inner, math.pi / 2, -guide.bend_rad)
    outer_arc = Arc(centre, inner + t, end, guide.bend_rad)
    curves: list[tuple[str, Segment | Arc]] = [
        ("inner_bend", inner_arc),
        ("inner_leg", Segment(corners[0], corners[1])),
        ("foot", Segment(corners[1], corners[2])),
        ("outer_leg", Segment(corners[2], corners[3])),
        ("outer_bend", outer_arc),
    ]
    return [Edge(f"{name}_right", curve, "acrylic", "air") for name, curve in curves]


def _glued_side(guide: MirrorGuide) -> list[Edge]:
    y, top, t = guide.flat_width_mm / 2, guide.window_top_z_mm, guide.thickness_mm
    bottom, foot = top - t, top - t - guide.leg_mm
    return [
        Edge("inner_leg_right", Segment((y, bottom), (y, foot)), "acrylic", "air"),
        Edge("foot_right", Segment((y, foot), (y + t, foot)), "acrylic", "air"),
        Edge("outer_leg_right", Segment((y + t, foot), (y + t, bottom)), "acrylic", "air"),
        Edge("mirror_right", Segment((y + t, bottom), (y, top)), "acrylic", "mirror"),
    ]


def _air_gap_side(guide: MirrorGuide) -> list[Edge]:
    y, top, t = guide.flat_width_mm / 2, guide.window_top_z_mm, guide.thickness_mm
    bottom, foot = top - t, top - t - guide.leg_mm
    leg = [
        Edge("inner_leg_right", Segment((y, bottom), (y, foot)), "leg", "air"),
        Edge("foot_right", Segment((y, foot), (y + t, foot)), "leg", "air"),
        Edge("outer_leg_right", Segment((y + t, foot), (y + t, bottom)), "leg", "air"),
        Edge("leg_top_right", Segment((y + t, bottom), (y, bottom)), "leg", "air"),
    ]
    return [
        Edge("window_end_right", Segment((y, bottom), (y, top)), "acrylic", "air"),
        *leg,
        Edge("mirror_right", Segment((y + t, bottom), (y, top)), "air", "mirror"),
    ]


def _window_top(half: float, top: float, gel: GelSection | None) -> list[Edge]:
    """The upper face from right to left: under the gel it meets gel, elsewhere air."""
    if gel is None:
        return [Edge("window_top", Segment((half, top), (-half, top)), "acrylic", "air")]
    _require_positive(gel_width_mm=gel.width_mm, gel_thickness_mm=gel.thickness_mm)
    side = gel.width_mm / 2
    if not 0 <= gel.crown_mm <= side:
        raise ValueError(
            f"gel crown_mm = {gel.crown_mm:g}: must be from 0 to half the width, {side:g}"
        )
    if side > half:
        raise ValueError(
            f"gel width_mm = {gel.width_mm:g} exceeds the flat window's {2 * half:g} mm; "
            "widen the window or narrow the gel"
        )
    bonded = Edge("gel_window", Segment((side, top), (-side, top)), "acrylic", "gel")
    if half - side <= 1e-9:
        return [bonded]
    return [
        Edge("window_top_right", Segment((half, top), (side, top)), "acrylic", "air"),
        bonded,
        Edge("window_top_left", Segment((-side, top), (-half, top)), "acrylic", "air"),
    ]


def _gel_edges(top: float, gel: GelSection | None) -> list[Edge]:
    if gel is None:
        return []
    side, edge = gel.width_mm / 2, top + gel.thickness_mm
    face: Segment | Arc = Segment((side, edge), (-side, edge))
    if gel.crown_mm > 0:
        radius = (side**2 + gel.crown_mm**2) / (2 * gel.crown_mm)
        start = math.atan2(radius - gel.crown_mm, side)
        face = Arc((0.0, edge + gel.crown_mm - radius), radius, start, math.pi - 2 * start)
    return [
        Edge("gel_side_right", Segment((side, top), (side, edge)), "gel", "air"),
        Edge("gel_face", face, "gel", "paint"),
        Edge("gel_side_left", Segment((-side, edge), (-side, top)), "gel", "air"),
    ]


def _mirrored(edge: Edge) -> Edge:
    """The mirror image of an edge, directed so that its left medium stays on its left."""
    c = edge.curve
    name = edge.name.replace("_right", "_left")
    if isinstance(c, Segment):
        (a, b), (p, q) = c.start, c.end
        return Edge(name, Segment((-p, q), (-a, b)), edge.left, edge.right)
    last = c.start_rad + c.sweep_rad
    turned = Arc((-c.centre[0], c.centre[1]), c.radius_mm, math.pi - last, c.sweep_rad)
    return Edge(name, turned, edge.left, edge.right)


def _check_curved(guide: CurvedGuide) -> None:
    _require_positive(
        flat_width_mm=guide.flat_width_mm,
        thickness_mm=guide.thickness_mm,
        inner_radius_mm=guide.inner_radius_mm,
        leg_mm=guide.leg_mm,
        bend_rad=guide.bend_rad,
    )
    if guide.bend_rad > LARGEST_BEND_RAD:
        raise ValueError(f"bend = {math.degrees(guide.bend_rad):g}°: must be at most 150°")
    foot = guide.foot_thickness_mm
    if foot is None:
        return
    _require_positive(foot_thickness_mm=foot)
    if foot / 2 >= guide.inner_radius_mm + guide.thickness_mm / 2:
        raise ValueError(f"foot_thickness_mm = {foot:g}: the foot reaches the centre of the bend")


def _require_positive(**lengths: float) -> None:
    for name, length in lengths.items():
        if not (math.isfinite(length) and length > 0):
            raise ValueError(f"{name} = {length!r}: must be a finite number > 0")
