"""Certificates of other profiles against rays marched through the profile itself."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import tir_march
from sampled import quick
from tir_march import ARRIVED, LEAKED, LOST

from bench.models.facets import facetted_profile
from gelslim_optics.guide.profile import Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)
from gelslim_optics.guide.tir_certificate import certify_tir
from gelslim_optics.guide.tir_walls import ENDS, kept_by_walls, survey_walls

N = 1.4906
COUNT = 2**15


def curved(ratio: float, **changes: float) -> GuideProfile:
    return curved_profile(CurvedGuide(22.0, 2.0, 2.0 * ratio, 3.0, **changes), GelSection(20, 2))


def kept(
    profile: GuideProfile, na: float, *, plane: bool, index: float = N, outside: float = 1.0
) -> float:
    foot = profile.edge("foot_right").curve
    assert isinstance(foot, Segment)
    place, way = tir_march.launch(foot, na, COUNT, index, plane=plane)
    fate, _ = tir_march.march(tir_march.side(profile), place, way, index, outside)
    assert np.sum(fate == LOST) <= 2
    return float(np.mean(fate != LEAKED))


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(
    ("ratio", "na", "bend_deg"),
    [(2.05, 1.0, 90), (3.0, 1.0, 90), (1.0, 1.0, 120), (3.0, 0.7, 30), (6.0, 1.0, 45)],
)
def test_shares_called_exact_are(ratio: float, na: float, bend_deg: float, plane: bool) -> None:
    profile = curved(ratio, bend_rad=math.radians(bend_deg))
    found = certify_tir(profile, na, guide_index=N)
    assert all(b.exact for b in found.bends)
    share = found.guided_2d if plane else found.guided
    assert share == pytest.approx(kept(profile, na, plane=plane), abs=1e-3)
    assert "at least" not in found.sentences()[0]


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(("ratio", "bend_deg"), [(0.5, 90), (1.0, 90), (1.0, 45), (2.05, 60)])
def test_short_bends_leak_less_than_stated_and_say_so(
    ratio: float, bend_deg: float, plane: bool
) -> None:
    profile = curved(ratio, bend_rad=math.radians(bend_deg))
    found = certify_tir(profile, 1.0, guide_index=N)
    assert not found.bends[0].exact
    share = found.guided_2d if plane else found.guided
    assert kept(profile, 1.0, plane=plane) > share + 1e-3
    assert "at least" in found.sentences()[0]


@pytest.mark.parametrize("ratio", [0.8, 1.0, 2.05, 3.0])
def test_from_the_full_sweep_on_every_ray_that_can_leak_does(ratio: float) -> None:
    """Ray by ray: all that have h < R_o leak in a bend of that sweep; in one 4 % less some pass."""
    full = certify_tir(curved(ratio), 1.0, guide_index=N).bends[0].full_sweep_deg
    passed = []
    for sweep in (full * 1.0001, full * 0.96):
        profile = curved(ratio, bend_rad=math.radians(sweep))
        bend = profile.bends()[0 if profile.bends()[0].centre[0] > 0 else 1]
        foot = profile.edge("foot_right").curve
        place, way = tir_march.launch(foot, 1.0, 2**17, N, plane=True)
        inward = np.subtract(foot.start, foot.end) / 2.0
        rho = bend.outer_radius_mm - np.linalg.norm(place - np.array(foot.end), axis=1)
        forward = np.abs(way[:, :2] @ np.array([-inward[1], inward[0]]))
        # The leg mixes ρ but keeps the angle, so the bend is marched from its own entry.
        shift = np.array(profile.edge("outer_leg_right").curve.end) - np.array(foot.end)
        edges = [e for e in tir_march.side(profile) if "leg" not in e.name]
        fate, _ = tir_march.march(edges, place + shift, way, N)
        can_leak = N * rho * forward < bend.outer_radius_mm
        assert not np.any((fate == LEAKED) & ~can_leak)
        passed.append(int(np.sum((fate == ARRIVED) & can_leak)))
    assert passed[0] == 0
    assert passed[1] > 0


def test_a_guide_without_an_entry_is_no_proof() -> None:
    """Nothing speaks against the walls with mirrors, but there is no leg for light to go along."""
    profile = mirror_profile(MirrorGuide(20, 2, 3))
    surveyed = survey_walls(profile, profile.bends(), ("no_such_face",))
    assert surveyed.legs == ()
    assert len(surveyed.reasons) == 1
    assert survey_walls(profile, profile.bends(), ENDS).reasons == ()


@pytest.mark.parametrize("foot_mm", [2.1, 2.5, 3.0])
@pytest.mark.parametrize("na", [0.0, 0.2, 0.5])
def test_narrowing_legs_steepen_light_within_the_bound(foot_mm: float, na: float) -> None:
    profile = curved(3.0, foot_thickness_mm=foot_mm)
    place, way = tir_march.launch(profile.edge("foot_right").curve, na, COUNT, N, plane=True)
    fate, way = tir_march.march(tir_march.leg(profile), place, way, N, outside=0.0)
    steepest = N * float(np.abs(way[fate == ARRIVED, 0]).max())
    bound = certify_tir(profile, na, guide_index=N).bend_na
    assert na * foot_mm / 2 < steepest <= bound
    assert steepest > 0.7 * bound


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(
    "foot_mm", quick([1.2, 1.8, 2.1, 2.5, 3.0, 4.0], (1.2, 2.1, 4.0).__contains__)
)
def test_shares_of_tapered_guides_are_lower_bounds(foot_mm: float, plane: bool) -> None:
    profile = curved(3.0, foot_thickness_mm=foot_mm)
    for na in (0.0, 0.5, 1.0):
        found = certify_tir(profile, na, guide_index=N)
        marched = kept(profile, na, plane=plane)
        assert found.tapers
        assert (found.guided_2d if plane else found.guided) <= marched + 1e-3
        if found.fully_guided:
            assert marched == 1.0
        assert any(f"NA {found.bend_na:.3g}" in s for s in found.sentences())


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(("foot_mm", "na"), [(2.5, 1.0), (3.0, 0.8), (4.0, 0.8), (4.0, 1.0)])
def test_the_bound_of_a_narrowing_leg_s_walls_holds_and_is_near(
    foot_mm: float, na: float, plane: bool
) -> None:
    for leg_mm, slack in ((3.0, 0.15), (12.0, 0.06)):
        guide = CurvedGuide(22.0, 2.0, 6.0, leg_mm, foot_thickness_mm=foot_mm)
        profile = curved_profile(guide)
        leg = next(
            found
            for found in survey_walls(profile, profile.bends(), ENDS).legs
            if found.foot == "foot_right"
        )
        place, way = tir_march.launch(profile.edge(leg.foot).curve, na, COUNT, N, plane=plane)
        fate, _ = tir_march.march(tir_march.leg(profile), place, way, N)
        marched = float(np.mean(fate != LEAKED))
        bound = kept_by_walls(leg, na, N, 1.0)[0 if plane else 1]
        assert marched - slack < bound <= marched + 5e-4


def test_a_narrowing_leg_is_not_a_pass_for_collimated_light() -> None:
    assert certify_tir(curved(2.1), 0.0, guide_index=N).fully_guided
    profile = curved(2.1, foot_thickness_mm=3.2)
    assert certify_tir(profile, 0.0, guide_index=N).verdict == "not_fully_guided"
    assert kept(profile, 0.0, plane=True) < 1.0


@pytest.mark.parametrize(("index", "outside"), [(N, 1.2), (N, 1.33), (1.2, 1.0)])
def test_walls_that_leak_by_themselves(index: float, outside: float) -> None:
    found = certify_tir(curved(3.0), 1.0, guide_index=index, outside_index=outside)
    assert found.straight_margin_deg < 0
    for share, plane in ((found.guided_2d, True), (found.guided, False)):
        marched = kept(curved(3.0), 1.0, plane=plane, index=index, outside=outside)
        assert share == pytest.approx(marched, abs=1e-3)
    assert found.bends[0].least_ratio is None


def bar(width: float, height: float) -> GuideProfile:
    a, b, c, d = (0.0, 0.0), (width, 0.0), (width, height), (0.0, height)
    names = ("floor", "foot_right", "roof", "foot_left")
    ends = ((a, b), (b, c), (c, d), (d, a))
    return GuideProfile(
        tuple(Edge(n, Segment(*e), "acrylic", "air") for n, e in zip(names, ends, strict=True))
    )


@pytest.mark.parametrize("index", [1.2, 1.3, math.sqrt(2), N])
def test_a_straight_window_is_guided_iff_its_walls_are(index: float) -> None:
    found = certify_tir(bar(20, 2), 1.0, guide_index=index)
    assert found.bends == ()
    limit = math.sqrt(index**2 - 1)
    assert found.fully_guided == (limit >= 1 - 1e-12)
    assert found.largest_na == pytest.approx(min(limit, 1.0))
    rng = np.random.default_rng(2)
    angle, radius = 2 * np.pi * rng.random(400_000), np.sqrt(rng.random(400_000))
    assert found.guided_2d == pytest.approx(min(limit, 1.0))
    share = np.mean(np.abs(radius * np.cos(angle)) <= limit + 1e-12)
    assert found.guided == pytest.approx(share, abs=2e-3)


@pytest.mark.parametrize("fit", ["glued", "air_gap"])
def test_mirrors_are_named_and_never_a_pass(fit: str) -> None:
    profile = mirror_profile(MirrorGuide(20, 2, 3, fit))  # type: ignore[arg-type]
    found = certify_tir(profile, 1.0, guide_index=N)
    assert found.verdict == "mirror_corners"
    assert not found.fully_guided
    assert found.mirrors
    weak = certify_tir(profile, 1.0, guide_index=1.3)
    assert weak.verdict == "not_fully_guided"
    assert weak.guided < 1
    assert weak.mirrors


def refused(profile: GuideProfile) -> str:
    found = certify_tir(profile, 0.3, guide_index=N, gel_index=1.41)
    assert found.verdict == "refused"
    assert not found.fully_guided
    assert found.guided == found.guided_2d == 0.0
    assert found.largest_na is None
    (sentence,) = found.sentences()
    return sentence


def swapped(profile: GuideProfile, which: str, /, **changes: Any) -> GuideProfile:
    return GuideProfile(
        tuple(replace(e, **changes) if e.name == which else e for e in profile.edges)
    )


def test_profiles_beyond_the_closed_forms_are_refused_with_the_reason() -> None:
    facets = facetted_profile(curved(9.6), 5.0)
    assert "2.5° (76 " in refused(facets)
    corner = mirror_profile(MirrorGuide(20, 2, 3))
    sharp = GuideProfile(
        tuple(Edge(e.name, e.curve, e.left, e.right.replace("mirror", "air")) for e in corner.edges)
    )
    assert "R = 0" in refused(sharp)
    assert "outer_bend_left" in refused(swapped(curved(3.0), "outer_bend_left", right="paint"))
    renamed = swapped(
        swapped(curved(3.0), "foot_left", name="in_left"), "foot_right", name="in_right"
    )
    assert "90°" in refused(renamed)
    known = certify_tir(renamed, 0.3, guide_index=N, ends=("in_left", "in_right"))
    assert known == certify_tir(curved(3.0), 0.3, guide_index=N)


def test_bends_in_series_are_refused() -> None:
    """A U of two quarter bends on one leg: the second meets light that the first has steepened."""
    profile = curved(3.0)
    gelless = GuideProfile(
        tuple(
            Edge(e.name, e.curve, e.left, "air") if e.right == "gel" else e
            for e in profile.edges
            if not e.name.startswith("gel_") or e.name == "gel_window"
        )
    )
    assert certify_tir(gelless, 0.3, guide_index=N).fully_guided
    leg = swapped(profile, "outer_leg_right", right="gel")
    bare = GuideProfile(
        tuple(
            e if e.name != "gel_window" else Edge(e.name, e.curve, e.left, "air")
            for e in leg.edges
            if e.name not in ("gel_side_left", "gel_side_right", "gel_face")
        )
    )
    assert "more than one bend" in refused(bare)


def test_unequally_tapered_legs_are_refused() -> None:
    profile = curved(3.0)
    foot, outer = profile.edge("foot_right").curve, profile.edge("outer_leg_right").curve
    corner = (foot.end[0] + 0.2, foot.end[1])
    slanted = swapped(profile, "foot_right", curve=Segment(foot.start, corner))
    slanted = swapped(slanted, "outer_leg_right", curve=Segment(corner, outer.end))
    assert "not symmetric" in refused(slanted)


def test_an_arc_without_its_partner_is_refused() -> None:
    profile = curved(3.0)
    arc = profile.edge("inner_bend_right").curve
    chord = Segment(arc.start, arc.end)
    assert "no concentric wall" in refused(swapped(profile, "inner_bend_right", curve=chord))
