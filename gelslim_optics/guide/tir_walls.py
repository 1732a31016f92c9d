"""The walls of a profile for its certificate: joints, mirrors, and legs that narrow."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from gelslim_optics.guide.profile import Arc, Bend, Edge, GuideProfile, Point, Segment
from gelslim_optics.guide.tir_bend import margin_deg

GUIDE = "acrylic"
GEL = "gel"
MIRROR = "mirror"
ABSORBERS = ("paint",)
ENDS = ("foot_left", "foot_right", "window_end_left", "window_end_right")
STRAIGHT_RAD = 1e-6
POSITIONS, SLOPES = 400, 200


@dataclass(frozen=True)
class Leg:
    """A symmetric leg from the face `foot` where light enters.

    `ratio` is the width of the foot over that of the far end; `taper_rad` is the angle of each wall
    to the middle plane of the leg, above 0 where the leg narrows.
    """

    foot: str
    ratio: float
    taper_rad: float

    @property
    def tapers(self) -> bool:
        """Whether its walls are not parallel."""
        return self.taper_rad != 0

    @property
    def narrows(self) -> bool:
        """Whether its walls increase the angles of the light; walls that widen reduce them."""
        return self.taper_rad > STRAIGHT_RAD and self.ratio > 1


@dataclass(frozen=True)
class Walls:
    """Legs, whether mirrors turn the light, and reasons why closed forms do not apply."""

    legs: tuple[Leg, ...]
    mirrors: bool
    reasons: tuple[str, ...]


def survey_walls(profile: GuideProfile, bends: tuple[Bend, ...], ends: tuple[str, ...]) -> Walls:
    """Inspect all walls; `ends` names the faces that let light in or out, which are no walls."""
    loop = profile.outline(GUIDE)
    legs, reasons = [], []
    for place, face in enumerate(loop):
        if face.name in ends:
            leg = _leg(loop, place)
            legs += [leg] if isinstance(leg, Leg) else []
            reasons += [leg] if isinstance(leg, str) else []
    mirrors = any(MIRROR in (e.left, e.right) for e in profile.edges)
    reasons += [r for edge in loop if (r := _unknown_wall(edge, bends))]
    taper = max((abs(leg.taper_rad) for leg in legs), default=0.0)
    corners = [] if mirrors else [r for pair in _pairs(loop) if (r := _sharp(*pair, ends, taper))]
    if corners:
        others = f" ({len(corners)} such corners)" if len(corners) > 1 else ""
        reasons.append(
            f"{corners[0]}{others}; the closed form does not hold at a corner (R = 0, or facets "
            "instead of an arc), which can leak any light: round it with concentric arcs"
        )
    if not legs and not reasons:
        reasons.append(f"no light enters: the guide has no face called {', '.join(ends)}")
    if _bends_in_series(loop, ends) > 1:
        reasons.append(
            "light meets more than one bend before the gel, and each increases its angles"
        )
    return Walls(tuple(legs), mirrors, tuple(dict.fromkeys(reasons)))


def steepest_rad(leg: Leg, na: float, guide_index: float) -> tuple[float, float]:
    """Largest angles to the walls of a leg and to its axis at the far end.

    In a wedge r sin φ is constant (r: distance from the apex, φ: angle to the wall that is met).
    From ψ at the foot follows sin φ <= (foot / end) sin(ψ + τ), and after a wall the angle to the
    axis is at most φ + τ. The étendue alone (NA · foot / end) does not bound single rays. An angle
    of π/2 means that light turns back.
    """
    entry = math.asin(min(na / guide_index, 1.0))
    if not leg.narrows:
        return entry, entry
    start = min(entry + leg.taper_rad, math.pi / 2)
    wall = math.asin(min(leg.ratio * math.sin(start), 1.0))
    return wall, min(wall + leg.taper_rad, math.pi / 2)


def wall_margin_deg(wall_rad: float, guide_index: float, outside_index: float) -> float:
    """Margin of total reflection for light at an angle to a flat wall."""
    return margin_deg(math.cos(wall_rad), math.asin(outside_index / guide_index))


def kept_by_walls(
    leg: Leg, na: float, guide_index: float, outside_index: float
) -> tuple[float, float]:
    """Shares kept by the flat walls of a leg, in the plane and in the cone.

    Parallel walls keep |p| <= P = √(n² - n_out²), a share of min(1, P/NA), and of the cone the
    part of the disc within ±P. For walls that narrow the shares are lower bounds: the rays whose
    r sin φ is small enough at the far end, summed over the foot, less the difference to the sum
    with half the steps.
    """
    limit = math.sqrt(guide_index**2 - outside_index**2)
    if leg.narrows:
        kept = [_kept_by_wedge(leg, na, guide_index, limit, k) for k in (1, SLOPES)]
        return kept[0], kept[1]
    if na <= limit * (1 + 1e-12):
        return 1.0, 1.0
    u = limit / na
    return u, 2 / math.pi * (math.asin(u) + u * math.sqrt(1 - u * u))


def _kept_by_wedge(leg: Leg, na: float, index: float, limit: float, slopes: int) -> float:
    fine, coarse = (
        _wedge_sum(leg, na, index, limit, max(slopes // k, 1), POSITIONS // k) for k in (1, 2)
    )
    return max(fine - abs(fine - coarse), 0.0) if fine < 1 else 1.0


def _wedge_sum(
    leg: Leg, na: float, index: float, limit: float, slopes: int, positions: int
) -> float:
    """Midpoint sum over the position y on the foot (half width 1) and the axial slope q."""
    y = ((np.arange(positions) + 0.5) / positions * 2 - 1)[:, None]
    beta = ((np.arange(slopes) + 0.5) / slopes - 0.5) * math.pi
    q, span = na * np.sin(beta)[None, :], na * np.cos(beta)[None, :]
    in_plane = np.sqrt(index**2 - q * q)
    foot = 1 / math.tan(leg.taper_rad)
    end = 1 / (leg.ratio * math.sin(leg.taper_rad))
    distance, azimuth = np.hypot(foot, y), np.arctan2(y, foot)
    reach = np.arcsin(np.minimum(end * np.minimum(limit / in_plane, 1.0) / distance, 1.0))
    if na == 0:
        return float(np.mean((-reach <= azimuth) & (azimuth <= reach)))
    high = np.minimum(in_plane * np.sin(np.minimum(azimuth + reach, math.pi / 2)), span)
    low = np.maximum(in_plane * np.sin(np.maximum(azimuth - reach, -math.pi / 2)), -span)
    kept = np.maximum(high - low, 0.0) * span
    return float(kept.sum() / (positions * (2 * span * span).sum()))


def _leg(loop: tuple[Edge, ...], place: int) -> Leg | str:
    foot, before, after = loop[place], loop[place - 1], loop[(place + 1) % len(loop)]
    if not (isinstance(before.curve, Segment) and isinstance(after.curve, Segment)):
        return Leg(foot.name, 1.0, 0.0)
    down, up, across = _tangent(before, True), _tangent(after, False), _tangent(foot, False)
    first, second = _turn(down, across) - math.pi / 2, _turn(across, up) - math.pi / 2
    if abs(first - second) > STRAIGHT_RAD:
        return f"the walls at {foot.name} have unequal angles to it: its leg is not symmetric"
    far = (_wall(loop, place, -1).curve.start, _wall(loop, place, 1).curve.end)
    ratio = foot.curve.length_mm / math.dist(*far)
    if abs(first) <= STRAIGHT_RAD:
        return Leg(foot.name, 1.0, 0.0)
    return Leg(foot.name, ratio, first)


def _wall(loop: tuple[Edge, ...], place: int, way: int) -> Edge:
    """Last of the collinear edges that begin next to a foot."""
    edge = loop[(place + way) % len(loop)]
    for step in range(2, len(loop)):
        following = loop[(place + way * step) % len(loop)]
        turned = _turn(_tangent(edge, way > 0), _tangent(following, way < 0))
        if not isinstance(following.curve, Segment) or abs(turned) > STRAIGHT_RAD:
            break
        edge = following
    return edge


def _unknown_wall(edge: Edge, bends: tuple[Bend, ...]) -> str:
    if any(name in (edge.left, edge.right) for name in ABSORBERS):
        return f"{edge.name} is painted: a coat absorbs light instead of reflecting it totally"
    curve = edge.curve
    if isinstance(curve, Arc) and not any(
        math.dist(curve.centre, b.centre) <= 1e-6 * b.outer_radius_mm
        and min(abs(curve.radius_mm - b.inner_radius_mm), abs(curve.radius_mm - b.outer_radius_mm))
        <= 1e-6 * b.outer_radius_mm
        for b in bends
    ):
        return f"the arc {edge.name} has no concentric wall opposite"
    return ""


def _sharp(first: Edge, second: Edge, ends: tuple[str, ...], taper: float) -> str:
    """Why a joint of two walls is not smooth, or nothing; a tapered leg may meet a bend."""
    if any(e.name in ends or MIRROR in (e.left, e.right) for e in (first, second)):
        return ""
    bent = abs(_turn(_tangent(first, True), _tangent(second, False)))
    mixed = isinstance(first.curve, Arc) != isinstance(second.curve, Arc)
    if bent <= STRAIGHT_RAD + (taper if mixed else 0.0):
        return ""
    return f"{first.name} and {second.name} meet in a corner of {math.degrees(bent):.3g}°"


def _bends_in_series(loop: tuple[Edge, ...], ends: tuple[str, ...]) -> int:
    """Largest number of bends between a foot and the gel, or without a gel half way."""
    most, gelled = 0, any(GEL in (e.left, e.right) for e in loop)
    for start, foot in enumerate(loop):
        if foot.name not in ends:
            continue
        for way in (1, -1):
            arcs = 0
            for step in range(1, len(loop)):
                edge = loop[(start + way * step) % len(loop)]
                if GEL in (edge.left, edge.right):
                    most = max(most, arcs)
                    break
                if edge.name in ends:
                    most = max(most, 0 if gelled else math.ceil(arcs / 2))
                    break
                arcs += isinstance(edge.curve, Arc)
    return most


def _tangent(edge: Edge, at_end: bool) -> Point:
    """Unit tangent at the start or the end of an edge."""
    c = edge.curve
    if isinstance(c, Segment):
        return ((c.end[0] - c.start[0]) / c.length_mm, (c.end[1] - c.start[1]) / c.length_mm)
    angle = c.start_rad + (c.sweep_rad if at_end else 0.0)
    sign = math.copysign(1.0, c.sweep_rad)
    return (-sign * math.sin(angle), sign * math.cos(angle))


def _turn(a: Point, b: Point) -> float:
    """Angle from direction a to direction b, above 0 counter-clockwise."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def _pairs(loop: tuple[Edge, ...]) -> list[tuple[Edge, Edge]]:
    return list(itertools.pairwise((*loop, loop[0])))
