"""Profiles and scenes that several light tests share."""

from __future__ import annotations

import math
from dataclasses import replace

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    Fit,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)
from gelslim_optics.light.scene import LightScene, Medium, Surface
from gelslim_optics.light.source import EdgeLaunch, LedRow, Source

N_ACRYLIC, N_GEL = 1.4906, 1.41
COATS = {"paint": Surface(), "mirror": Surface(0.9)}


def media(absorption: float = 0.0, gel: float = N_GEL) -> dict[str, Medium]:
    acrylic = Medium(N_ACRYLIC, absorption)
    return {"air": Medium(1.0), "acrylic": acrylic, "leg": acrylic, "gel": Medium(gel, absorption)}


def loop(corners: list[tuple[float, float]], *sides: tuple[str, str]) -> GuideProfile:
    """A polygon of acrylic, counter-clockwise; each side has a name and a medium outside it."""
    ends = [*corners[1:], corners[0]]
    return GuideProfile(
        tuple(
            Edge(name, Segment(a, b), "acrylic", outside)
            for a, b, (name, outside) in zip(corners, ends, sides, strict=True)
        )
    )


def slab(half_mm: float, thick_mm: float, top: str = "air", side: str = "air") -> GuideProfile:
    """A flat plate whose lower face is the foot."""
    h, t = half_mm, thick_mm
    return loop(
        [(-h, 0), (h, 0), (h, t), (-h, t)],
        ("foot_right", "air"),
        ("right", side),
        ("top", top),
        ("left", side),
    )


def transformed(
    profile: GuideProfile,
    dy_mm: float = 0.0,
    dz_mm: float = 0.0,
    factor: float = 1.0,
    *,
    mirrored: bool = False,
) -> GuideProfile:
    """The profile mirrored in y, scaled about the origin, then moved; media keep their sides."""
    sign = -1.0 if mirrored else 1.0

    def move(point: tuple[float, float]) -> tuple[float, float]:
        return sign * factor * point[0] + dy_mm, factor * point[1] + dz_mm

    edges = []
    for edge in profile.edges:
        c, curve = edge.curve, edge.curve
        if isinstance(c, Segment):
            curve = Segment(move(c.start), move(c.end))
        else:
            start = math.pi - c.start_rad if mirrored else c.start_rad
            curve = Arc(move(c.centre), factor * c.radius_mm, start, sign * c.sweep_rad)
        left, right = (edge.right, edge.left) if mirrored else (edge.left, edge.right)
        edges.append(replace(edge, curve=curve, left=left, right=right))
    return GuideProfile(tuple(edges))


INNER_PART = 0.02


def lone_bend(
    ratio: float, thick_mm: float = 1.0, leg_mm: float = 0.5, bend_rad: float = math.pi / 2
) -> GuideProfile:
    """Leg, one bend, and a black exit where the window would begin.

    The foot is in two: `foot_inner`, next to the inner wall, and `foot_right`.
    """
    t, r, low = thick_mm, thick_mm * ratio, -leg_mm
    tip = (r + INNER_PART * t, low)
    inner = Arc((0, 0), r, bend_rad, -bend_rad)
    outer = Arc((0, 0), r + t, 0, bend_rad)
    return GuideProfile(
        (
            Edge("exit", Segment(outer.end, inner.start), "acrylic", "paint"),
            Edge("inner_bend", inner, "acrylic", "air"),
            Edge("inner_leg", Segment((r, 0), (r, low)), "acrylic", "air"),
            Edge("foot_inner", Segment((r, low), tip), "acrylic", "air"),
            Edge("foot_right", Segment(tip, (r + t, low)), "acrylic", "air"),
            Edge("outer_leg", Segment((r + t, low), (r + t, 0)), "acrylic", "air"),
            Edge("outer_bend", outer, "acrylic", "air"),
        )
    )


def bend_scene(
    ratio: float,
    na: float | None,
    *,
    planar: bool,
    profile: GuideProfile | None = None,
    foot: tuple[str, ...] = ("foot_inner", "foot_right"),
) -> LightScene:
    whole = lone_bend(ratio) if profile is None else profile
    return LightScene(
        whole,
        (-5.0, 5.0),
        (-5.0, 5.0),
        tuple(
            EdgeLaunch(name, na=na, planar=planar, power=whole.edge(name).curve.length_mm)
            for name in foot
        ),
        media(),
        COATS,
        feet=("foot_inner", "foot_right"),
        face="exit",
    )


def led_rows(pad_mm: float, gap_mm: float) -> tuple[Source, ...]:
    places = tuple(pad_mm * (i + 0.5) / 4 - pad_mm / 2 for i in range(4))
    return (
        LedRow("foot_left", places, gap_mm=gap_mm, colour="red"),
        LedRow("foot_right", places, gap_mm=gap_mm, colour="green"),
    )


def finger(
    ratio: float = 3.0,
    *,
    pad_mm: float = 20.0,
    leg_mm: float = 5.0,
    crown_mm: float = 0.0,
    mirror: str = "",
    absorption: float = 0.001,
    gel_index: float = N_GEL,
    gel_part: float = 1.0,
) -> LightScene:
    """A guide 2 mm thick with LEDs of that size at both feet; curved, or with a mirror."""
    gel = GelSection(pad_mm * gel_part, 2.0, crown_mm)
    if mirror:
        fit: Fit = "glued" if mirror == "glued" else "air_gap"
        profile = mirror_profile(MirrorGuide(pad_mm, 2.0, leg_mm, fit), gel)
    else:
        profile = curved_profile(CurvedGuide(pad_mm, 2.0, 2.0 * ratio, leg_mm), gel)
    half = pad_mm / 2
    return LightScene(
        profile,
        (-half, half),
        (-half * gel_part, half * gel_part),
        led_rows(pad_mm, gap_mm=0.1),
        media(absorption, gel_index),
        COATS,
    )
