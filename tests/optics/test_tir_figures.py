"""Figures of certificates by their formulas, and the numbers that the sentences repeat."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from light_cases import transformed
from scipy.integrate import quad

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)
from gelslim_optics.guide.tir_bend import margin_deg
from gelslim_optics.guide.tir_certificate import TirCertificate, certify_tir
from gelslim_optics.guide.tir_walls import (
    ENDS,
    Leg,
    Walls,
    kept_by_walls,
    steepest_rad,
    survey_walls,
    wall_margin_deg,
)

N, N_GEL = 1.4906, 1.41


def curved(ratio: float, *, gel: bool = True, **changes: float) -> GuideProfile:
    guide = CurvedGuide(22.0, 2.0, 2.0 * ratio, 3.0, **changes)
    return curved_profile(guide, GelSection(20.0, 2.0) if gel else None)


def certified(profile: GuideProfile, na: float, **changes: float) -> TirCertificate:
    return certify_tir(profile, na, **({"guide_index": N, "gel_index": N_GEL} | changes))


def legs_of(profile: GuideProfile) -> Walls:
    return survey_walls(profile, profile.bends(), ENDS)


@pytest.mark.parametrize("foot_mm", [1.6, 2.0, 2.7])
@pytest.mark.parametrize("bend_deg", [60.0, 90.0, 110.0])
def test_legs_have_the_ratio_and_the_taper_of_their_drawing(
    foot_mm: float, bend_deg: float
) -> None:
    profile = curved(3.0, foot_thickness_mm=foot_mm, bend_rad=math.radians(bend_deg))
    walls = legs_of(transformed(profile, 3.0, -2.0))
    assert (walls.mirrors, walls.reasons) == (False, ())
    assert {leg.foot for leg in walls.legs} == {"foot_left", "foot_right"}
    for leg in walls.legs:
        assert leg.ratio == pytest.approx(foot_mm / 2.0)
        # The foot is wider by (foot - 2) / 2 on either side of a leg of 3 mm.
        assert leg.taper_rad == pytest.approx(math.atan((foot_mm - 2.0) / 2 / 3.0), abs=1e-12)
        assert leg.tapers == (foot_mm != 2.0)
        assert leg.narrows == (foot_mm > 2.0)


def cut(profile: GuideProfile, name: str, part: float) -> GuideProfile:
    """The profile with a straight edge in two collinear pieces."""
    edges: list[Edge] = []
    for edge in profile.edges:
        if edge.name != name:
            edges.append(edge)
            continue
        middle = edge.curve.at(part)
        edges.append(replace(edge, curve=Segment(edge.curve.start, middle)))
        edges.append(replace(edge, curve=Segment(middle, edge.curve.end), name=f"{name}_rest"))
    return GuideProfile(tuple(edges))


def test_walls_in_pieces_are_the_same_leg() -> None:
    profile = curved(3.0, foot_thickness_mm=2.7)
    whole = certified(profile, 0.4)
    for name in ("inner_leg_right", "outer_leg_right"):
        in_pieces = cut(cut(profile, name, 0.3), f"{name}_rest", 0.5)
        assert certified(in_pieces, 0.4).bend_na == pytest.approx(whole.bend_na, rel=1e-12)
        pieces = {leg.foot: leg for leg in legs_of(in_pieces).legs}
        for leg in legs_of(profile).legs:
            assert pieces[leg.foot].ratio == pytest.approx(leg.ratio)
            assert pieces[leg.foot].taper_rad == pytest.approx(leg.taper_rad)


def test_a_foot_between_arcs_is_a_leg_of_no_length() -> None:
    """A half ring with its feet at the ends of the arcs."""
    inner = Arc((0, 0), 4.0, math.pi, -math.pi)
    outer = Arc((0, 0), 6.0, 0.0, math.pi)
    ring = GuideProfile(
        (
            Edge("outer", outer, "acrylic", "air"),
            Edge("foot_left", Segment((-6, 0), (-4, 0)), "acrylic", "air"),
            Edge("inner", inner, "acrylic", "air"),
            Edge("foot_right", Segment((4, 0), (6, 0)), "acrylic", "air"),
        )
    )
    walls = legs_of(ring)
    assert walls.reasons == ()
    assert [(leg.ratio, leg.taper_rad) for leg in walls.legs] == [(1.0, 0.0), (1.0, 0.0)]
    found = certify_tir(ring, 0.4, guide_index=N)
    (bend,) = found.bends
    assert bend.ratio == pytest.approx(2.0)
    assert bend.sweep_deg == pytest.approx(180.0)
    # The same light as in a guide with parallel legs and the same radii.
    assert found.guided == pytest.approx(certified(curved(2.0), 0.4).guided)


@pytest.mark.parametrize("na", [0.0, 0.3, 0.9])
def test_light_in_a_wedge_gains_its_taper_and_its_narrowing(na: float) -> None:
    entry = math.asin(na / N)
    for leg in (Leg("foot", 1.0, 0.0), Leg("foot", 0.8, -0.05)):
        assert steepest_rad(leg, na, N) == (entry, entry)
    wall, axis = steepest_rad(Leg("foot", 1.3, 0.05), na, N)
    assert math.sin(wall) == pytest.approx(1.3 * math.sin(entry + 0.05))
    assert axis == pytest.approx(wall + 0.05)
    # A leg that narrows to a tenth turns all steep light back.
    turned_back = steepest_rad(Leg("foot", 10.0, 0.2), 0.9, N)
    assert turned_back == (math.pi / 2, math.pi / 2)


def test_only_walls_that_come_together_steepen_light() -> None:
    for leg in (Leg("foot", 1.2, 0.0), Leg("foot", 0.9, 0.1), Leg("foot", 1.2, -0.1)):
        assert not leg.narrows
        assert steepest_rad(leg, 0.5, N) == (math.asin(0.5 / N),) * 2
    assert Leg("foot", 1.2, 0.1).narrows
    # Light that starts across the wedge stays across it.
    assert steepest_rad(Leg("foot", 1.0001, 0.2), 1.0, 1.01)[0] == math.pi / 2


def test_margins_of_flat_walls() -> None:
    critical = math.degrees(math.asin(1.2 / 1.5))
    assert wall_margin_deg(0.3, 1.5, 1.2) == pytest.approx(90 - math.degrees(0.3) - critical)
    # Within a ten-billionth of a degree of the critical angle light counts as guided.
    assert margin_deg(math.sin(0.7), 0.7 + math.radians(0.9e-10)) == 0.0
    assert margin_deg(math.sin(0.7), 0.7 + math.radians(2e-10)) < 0
    assert margin_deg(1.2, 0.7) == pytest.approx(90 - math.degrees(0.7))


@pytest.mark.parametrize("na", [0.3, 0.6, 1.0])
def test_parallel_walls_keep_a_strip_of_the_disc(na: float) -> None:
    limit = math.sqrt(1.2**2 - 1.1**2)
    flat, cone = kept_by_walls(Leg("foot", 1.0, 0.0), na, 1.2, 1.1)
    assert flat == pytest.approx(min(limit / na, 1.0))
    half = min(limit, na)
    strip = quad(lambda p: 2 * math.sqrt(max(na * na - p * p, 0.0)), -half, half)[0]
    assert cone == pytest.approx(strip / (math.pi * na * na), rel=1e-7)


@pytest.mark.parametrize("na", [0.0, 0.4, 1.0])
def test_a_narrowing_wall_keeps_the_rays_that_are_flat_enough_at_its_end(na: float) -> None:
    """The same sum by chance: places on the foot and directions of the disc, ray by ray."""
    leg, limit = Leg("foot", 1.4, 0.06), math.sqrt(N**2 - 1)
    rng = np.random.default_rng(3)
    count = 200_000
    foot, end = 1 / math.tan(0.06), 1 / (1.4 * math.sin(0.06))
    y = rng.uniform(-1, 1, count)
    for flat in (True, False):
        if flat:
            p, q = rng.uniform(-na, na, count), np.zeros(count)
        else:
            radius, angle = na * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
            p, q = radius * np.cos(angle), radius * np.sin(angle)
        in_plane = np.sqrt(N**2 - q * q)
        # Distance of the ray's line from the apex, which the walls do not change.
        off = np.hypot(foot, y) * np.abs(np.sin(np.arcsin(p / in_plane) - np.arctan2(y, foot)))
        share = np.mean(off <= end * np.minimum(limit / in_plane, 1.0))
        bound = kept_by_walls(leg, na, N, 1.0)[0 if flat else 1]
        assert bound == pytest.approx(share, abs=8e-3)


@pytest.mark.parametrize("na", [0.5, 1.0])
@pytest.mark.parametrize("foot_mm", [1.7, 2.0, 2.1])
def test_shares_of_a_profile_are_those_of_its_walls_and_bends(na: float, foot_mm: float) -> None:
    found = certified(curved(2.0, foot_thickness_mm=foot_mm), na)
    (leg, _), (bend, other) = legs_of(curved(2.0, foot_thickness_mm=foot_mm)).legs, found.bends
    assert bend.guided_3d == pytest.approx(other.guided_3d)
    walls = kept_by_walls(leg, na, N, 1.0)
    pairs = ((found.guided_2d, bend.guided_2d), (found.guided, bend.guided_3d))
    for power, (share, at_bend) in enumerate(pairs, 1):
        assert at_bend < 1
        if foot_mm == 2.0:
            assert share == pytest.approx(min(walls[power - 1], at_bend))
            continue
        crowd = (found.bend_na / na) ** power * 2.0 / foot_mm
        expected = max(walls[power - 1] - (1 - at_bend) * crowd, 0.0)
        assert share == pytest.approx(expected, rel=1e-9)
    steep = math.sin(steepest_rad(leg, na, N)[1])
    assert found.bend_na == pytest.approx(N * steep if foot_mm > 2.0 else na)


@pytest.mark.parametrize("na", [0.0, 0.6, 1.0])
def test_light_that_reaches_the_gel_rises_as_the_tightest_bend_lets_it(na: float) -> None:
    for ratio in (1.0, 4.0, 30.0):
        found = certified(curved(ratio), na)
        cosine = math.sqrt(N**2 - na**2) / N
        level = max(ratio / (ratio + 1) * cosine, 1 / N)
        assert found.top_elevation_deg == pytest.approx(math.degrees(math.acos(level)))
        assert found.gel_critical_deg == pytest.approx(math.degrees(math.acos(N_GEL / N)))
        assert found.straight_margin_deg == pytest.approx(
            math.degrees(math.acos(na / N) - math.asin(1 / N))
            if na == 0
            else 90 - math.degrees(math.asin(na / N)) - math.degrees(math.asin(1 / N))
        )
        limit = N_GEL / (N * cosine - N_GEL)
        expected = pytest.approx(limit) if N * cosine > N_GEL else None
        assert found.largest_entry_ratio == expected
        assert found.margin_deg == min(
            found.straight_margin_deg, *(b.margin_deg for b in found.bends)
        )
    assert certified(curved(1.0, gel=False), na, gel_index=None).largest_entry_ratio is None  # type: ignore[arg-type]


def numbers(sentence: str) -> list[float]:
    return [float(v) for v in re.findall(r"(?<![A-Za-z])-?\d+(?:\.\d+)?(?:e-?\d+)?", sentence)]


def about(value: float, digits: int) -> object:
    """The value as it is written with so many significant digits."""
    return pytest.approx(float(f"{value:.{digits}g}"))


def test_a_guide_that_keeps_all_light_states_margin_and_ratios() -> None:
    found = certified(curved(3.0), 0.5)
    (sentence, gel) = found.sentences()
    least = found.bends[0].least_ratio
    assert numbers(sentence) == [
        0.5, about(found.margin_deg, 2), 3.0, pytest.approx(math.ceil(least * 100) / 100)
    ]  # fmt: skip
    assert numbers(gel) == [
        pytest.approx(found.gel_critical_deg, abs=0.05),
        pytest.approx(found.top_elevation_deg, abs=0.05),
    ]


def test_a_guide_that_leaks_states_share_margin_and_largest_aperture() -> None:
    found = certified(curved(3.0), 0.9)
    (sentence, most, _) = found.sentences()
    least = found.bends[0].least_ratio
    assert numbers(sentence) == [
        pytest.approx(100 * found.guided, abs=0.05), 0.9, 3.0,
        pytest.approx(math.ceil(least * 100) / 100), about(-found.margin_deg, 2),
    ]  # fmt: skip
    assert numbers(most) == [math.floor(found.largest_na * 1000) / 1000]
    # Walls that leak too are said to.
    assert found.margin_deg < -0.1 < 0 < found.straight_margin_deg
    leaky = replace(found, straight_margin_deg=-0.1).sentences()[0]
    assert leaky.startswith(sentence)
    assert len(leaky) > len(sentence)
    assert certified(curved(1.9), 0.9).largest_na is None
    assert numbers(certified(curved(1.9), 0.9).sentences()[1]) == []


def test_a_short_bend_states_its_angle_and_the_one_that_it_needs() -> None:
    found = certified(curved(1.0, bend_rad=math.radians(45)), 0.8)
    bend = found.bends[0]
    assert not bend.exact
    (first, short, *_) = found.sentences()
    assert numbers(first)[0] == math.floor(found.guided * 1000) / 10
    assert numbers(short) == [45.0, about(bend.full_sweep_deg, 3)]
    assert bend.full_sweep_deg > 46
    long = certified(curved(1.0, bend_rad=math.radians(bend.full_sweep_deg + 0.1)), 0.8)
    assert all(b.exact for b in long.bends)
    assert len(long.sentences()) == len(found.sentences()) - 1
    assert numbers(long.sentences()[0])[0] == pytest.approx(100 * long.guided, abs=0.05)


def test_legs_that_taper_state_the_aperture_at_the_bends() -> None:
    found = certified(curved(3.0, foot_thickness_mm=2.3), 0.8)
    (first, taper, *_) = found.sentences()
    assert numbers(first)[0] == math.floor(found.guided * 1000) / 10
    assert numbers(taper) == [about(found.bend_na, 3)]
    assert found.bend_na > 0.8


def test_a_straight_guide_states_its_walls() -> None:
    bar = GuideProfile(
        tuple(
            Edge(name, Segment(a, b), "acrylic", "air")
            for name, a, b in (
                ("floor", (0.0, 0.0), (20.0, 0.0)),
                ("foot_right", (20.0, 0.0), (20.0, 2.0)),
                ("roof", (20.0, 2.0), (0.0, 2.0)),
                ("foot_left", (0.0, 2.0), (0.0, 0.0)),
            )
        )
    )
    kept = certify_tir(bar, 0.7, guide_index=N)
    assert numbers(kept.sentences()[0]) == [0.7, pytest.approx(kept.margin_deg, abs=0.005)]
    lost = certify_tir(bar, 0.95, guide_index=1.3)
    assert numbers(lost.sentences()[0]) == [
        pytest.approx(100 * lost.guided, abs=0.05), 0.95, about(-lost.margin_deg, 2)
    ]  # fmt: skip


def test_mirrors_state_the_margin_of_the_walls() -> None:
    profile = mirror_profile(MirrorGuide(20, 2, 3))
    found = certify_tir(profile, 0.8, guide_index=N)
    assert numbers(found.sentences()[0]) == [0.8, pytest.approx(found.margin_deg, abs=0.005)]
    weak = certify_tir(profile, 0.95, guide_index=1.3)
    assert len(weak.sentences()) == 3


def test_shares_next_to_all_are_never_called_all() -> None:
    least = certified(curved(3.0), 0.9).bends[0].least_ratio
    found = certified(curved(least * 0.97), 0.9)
    assert 0.999 < found.guided < 1
    assert numbers(found.sentences()[0])[0] == about(100 * (1 - found.guided), 1)
    # A tapered leg whose bound is nothing has a share that is not known.
    nothing = certified(curved(1.0, foot_thickness_mm=0.5), 0.9)
    assert nothing.guided == 0
    assert numbers(nothing.sentences()[0])[0] == 0.9
    # Rounded down where it is a lower bound.
    bound = certified(curved(2.0, foot_thickness_mm=1.7), 1.0)
    assert numbers(bound.sentences()[0])[0] == math.floor(1000 * bound.guided) / 10


def test_a_gel_that_no_light_enters_states_both_angles_and_the_remedy() -> None:
    found = certified(curved(30.0), 0.0)
    assert not found.enters_gel
    assert numbers(found.sentences()[-1]) == [
        pytest.approx(found.gel_critical_deg, abs=0.05),
        pytest.approx(found.top_elevation_deg, abs=0.05),
        about(found.largest_entry_ratio, 3),
    ]
