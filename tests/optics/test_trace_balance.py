"""Energy and exchange: ledger, slab, etalon, reciprocity, furnace, coats, index matching."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from light_cases import COATS, N_ACRYLIC, N_GEL, finger, loop, media, slab

from gelslim_optics.guide.profile import Edge, GuideProfile, Segment
from gelslim_optics.light.scene import LightScene, Medium, Surface
from gelslim_optics.light.source import Dome, EdgeLaunch, LedRow
from gelslim_optics.light.trace import TraceOptions, trace_light
from gelslim_optics.light.trace_face import fresnel

PERFECT = {"paint": Surface(), "mirror": Surface(1.0)}


def reflectance(cosine: float, n1: float = 1.0, n2: float = N_ACRYLIC) -> float:
    """Fresnel from the angles (sine and tangent laws)."""
    i = math.acos(cosine)
    t = math.asin(n1 * math.sin(i) / n2)
    if i < 1e-9:
        return ((n1 - n2) / (n1 + n2)) ** 2
    rs = math.sin(i - t) / math.sin(i + t)
    rp = math.tan(i - t) / math.tan(i + t)
    return (rs**2 + rp**2) / 2


def test_fresnel_at_normal_brewster_critical_and_grazing() -> None:
    n = N_ACRYLIC
    assert fresnel(1.0, n, 1.0)[0] == pytest.approx(((n - 1) / (n + 1)) ** 2, rel=1e-12)
    for cosine in (0.01, 0.3, 0.8, 0.999):
        assert fresnel(1.0, n, cosine)[0] == pytest.approx(reflectance(cosine), rel=1e-9)
    brewster = math.atan(n)
    s_only = ((1 - n * n) / (1 + n * n)) ** 2 / 2
    assert fresnel(1.0, n, math.cos(brewster))[0] == pytest.approx(s_only, rel=1e-12)
    critical = math.asin(1 / n)
    assert fresnel(n, 1.0, math.cos(critical + 1e-9))[0] == 1.0
    just_below = fresnel(n, 1.0, math.cos(critical - 1e-9))[0]
    assert 0.999 < just_below < 1.0
    assert fresnel(1.0, n, 0.0)[0] == pytest.approx(1.0)
    assert fresnel(1.41, 1.41, 0.123) == (0.0, 0.123)


def test_a_slab_passes_one_minus_r_over_one_plus_r() -> None:
    """Incoherent sum of all inner reflections, averaged over a Lambertian lamp."""
    scene = LightScene(
        slab(1e4, 1.0),
        (-1e4, 1e4),
        (-1, 1),
        (LedRow("foot_right", (0.0,), 2.0, 0.0),),
        media(),
        COATS,
    )
    result = trace_light(scene, 1 << 17, seed=5, options=TraceOptions(split=1e-4))
    squares = (np.arange(200_000) + 0.5) / 200_000
    each = np.array([reflectance(math.sqrt(1 - u)) for u in squares[::20]])
    expected = float(np.mean((1 - each) / (1 + each)))
    through = result.replicates("leaked.top")
    assert np.mean(through) == pytest.approx(expected, abs=2e-4)
    assert result.value("foot_reflection") == pytest.approx(float(np.mean(each)), abs=2e-4)


@pytest.mark.parametrize("half_deg", [1e-3, 30.0])
def test_an_etalon_of_two_media_in_line(half_deg: float) -> None:
    """Window and gel, both ends open: matrices of incoherent layers."""
    w, t = 1e4, 1.0
    profile = GuideProfile(
        (
            Edge("foot_right", Segment((-w, 0), (w, 0)), "acrylic", "air"),
            Edge("side_right", Segment((w, 0), (w, t)), "acrylic", "air"),
            Edge("gel_window", Segment((w, t), (-w, t)), "acrylic", "gel"),
            Edge("side_left", Segment((-w, t), (-w, 0)), "acrylic", "air"),
            Edge("gel_right", Segment((w, t), (w, 2 * t)), "gel", "air"),
            Edge("open", Segment((w, 2 * t), (-w, 2 * t)), "gel", "air"),
            Edge("gel_left", Segment((-w, 2 * t), (-w, t)), "gel", "air"),
        )
    )
    lamp = LedRow("foot_right", (0.0,), 1.0, 0.0, law=Dome(half_deg))
    scene = LightScene(profile, (-w, w), (-w, w), (lamp,), media(), COATS)
    result = trace_light(scene, 1 << 16, options=TraceOptions(split=1e-4))

    def passed(sine: float) -> float:
        indices = (1.0, N_ACRYLIC, N_GEL, 1.0)
        through, back = 1.0, 0.0
        for n1, n2 in pairwise(indices):
            r = reflectance(math.sqrt(1 - (sine / n1) ** 2), n1, n2)
            # Add a face behind what is there: geometric series between the two.
            echo = 1 / (1 - back * r)
            through, back = through * (1 - r) * echo, r + (1 - r) ** 2 * back * echo
        return through

    widest = math.sin(math.radians(half_deg))
    sines = widest * np.sqrt((np.arange(2000) + 0.5) / 2000)
    expected = float(np.mean([passed(float(s)) for s in sines]))
    assert result.value("leaked.open") == pytest.approx(expected, abs=1e-4)


def test_the_ledger_closes_for_curved_and_mirror_guides() -> None:
    for scene in (finger(1.0), finger(crown_mm=1.0), finger(mirror="glued"), finger(mirror="gap")):
        for split in (1.0, 1e-2, 1e-3):
            result = trace_light(scene, 1 << 13, seed=4, options=TraceOptions(split=split))
            assert result.ledger_gap() < 1e-12
            assert result.value("lost") == 0
            total = sum(entry.value for entry in result.ledger().values())
            assert total == pytest.approx(1, abs=1e-12)
            assert result.value("truncated") < 1e-4


def test_splitting_and_chance_agree() -> None:
    scene = finger(1.5)
    whole = trace_light(scene, 1 << 17, seed=7, options=TraceOptions(split=1e-3))
    chance = trace_light(scene, 1 << 17, seed=8, options=TraceOptions(split=1.0))
    for entry in ("delivered", "leaked.outer_bend_left", "returned.foot_left", "absorbed"):
        a, b = whole.ledger()[entry], chance.ledger()[entry]
        assert abs(a.value - b.value) < 4 * math.hypot(a.standard_error, b.standard_error)


@pytest.mark.parametrize("mirror", ["", "glued"])
def test_reciprocity_between_foot_and_pad(mirror: str) -> None:
    """Φ(foot to pad) A_foot n_air² = Φ(pad to foot) A_pad n_gel², both Lambertian."""
    scene = finger(2.0, mirror=mirror, absorption=0.002)
    area_foot, area_pad = 2.0 * 20.0, 20.0 * 20.0
    forward = replace(scene, sources=(_full_lamp("foot_right"),))
    backward = replace(scene, sources=(EdgeLaunch("gel_face", into="gel"),))
    there = trace_light(forward, 1 << 18, seed=1).ledger()["delivered"]
    back = trace_light(backward, 1 << 18, seed=2).ledger()["returned.foot_right"]
    left, right = there.value * area_foot, back.value * area_pad * N_GEL**2
    error = math.hypot(there.standard_error * area_foot, back.standard_error * area_pad * N_GEL**2)
    assert abs(left - right) < 4 * error
    assert error < 0.015 * left


def _full_lamp(edge: str) -> LedRow:
    """A lamp that covers the whole foot, touching it: 10 squares of 2 mm on 20 mm."""
    return LedRow(edge, tuple(-9.0 + 2 * i for i in range(10)), 2.0, 0.0)


def test_furnace_every_wall_receives_what_it_sends() -> None:
    """Closed box of two media, walls black and equally hot: arrival is area times n²."""
    profile = GuideProfile(
        (
            Edge("floor", Segment((-2, 0), (2, 0)), "acrylic", "paint"),
            Edge("right", Segment((2, 0), (2, 1)), "acrylic", "paint"),
            Edge("gel_window", Segment((2, 1), (-2, 1)), "acrylic", "gel"),
            Edge("left", Segment((-2, 1), (-2, 0)), "acrylic", "paint"),
            Edge("gel_side_right", Segment((2, 1), (1, 3)), "gel", "paint"),
            Edge("gel_face", Segment((1, 3), (-2, 3)), "gel", "paint"),
            Edge("gel_side_left", Segment((-2, 3), (-2, 1)), "gel", "paint"),
        )
    )
    indices = {"acrylic": N_ACRYLIC, "gel": 1.2}
    walls = [e for e in profile.edges if e.right == "paint"]
    power = {e.name: e.curve.length_mm * indices[e.left] ** 2 for e in walls}
    scene = LightScene(
        profile,
        (0, 3),
        (0, 3),
        tuple(EdgeLaunch(e.name, into=e.left, power=power[e.name]) for e in walls),
        {"air": Medium(1.0), "acrylic": Medium(N_ACRYLIC), "gel": Medium(1.2)},
        PERFECT,
        ends="mirror",
    )
    result = trace_light(scene, 1 << 20, seed=3, options=TraceOptions(bins=(4, 4)))
    whole = sum(power.values())
    for name, sent in power.items():
        entry = "delivered" if name == "gel_face" else f"stopped.{name}"
        got = result.ledger()[entry]
        assert abs(got.value - sent / whole) < 4 * got.standard_error + 1e-9
        assert got.standard_error < 2e-3
    flux = result.irradiance() * whole
    assert np.allclose(flux, flux.mean(), rtol=0.04)
    assert flux.mean() == pytest.approx(1.2**2 / 3, rel=5e-3)
    # Isotropic light: mean elevation of a Lambertian arrival is 45°.
    assert result.elevation_deg().value == pytest.approx(45, abs=0.2)


def test_light_reflected_by_the_coat_arrives_again() -> None:
    """A pad in a box of perfect mirrors: Σ r^k arrivals, all absorbed in the end."""
    box = loop(
        [(0, 0), (2, 0), (2, 3), (0, 3)],
        ("foot_right", "mirror"),
        ("right", "mirror"),
        ("gel_face", "paint"),
        ("left", "mirror"),
    )
    lamp = EdgeLaunch("foot_right", into="acrylic")
    for diffuse in (False, True):
        coats = {"paint": Surface(0.6, diffuse), "mirror": Surface(1.0)}
        scene = LightScene(box, (0, 1), (0, 1), (lamp,), media(), coats, ends="mirror")
        result = trace_light(scene, 1 << 12, options=TraceOptions(cut=1e-9))
        # Light that runs almost level between the mirrors meets too many faces.
        cut = result.value("truncated")
        assert cut < 1e-4
        assert result.value("delivered") == pytest.approx(1 - cut, abs=1e-12)
        assert result.arrived().value == pytest.approx(result.value("delivered") / 0.4, rel=1e-12)


def test_absorption_follows_beer_and_lambert() -> None:
    scene = LightScene(
        slab(50, 30.0, top="paint"),
        (-50, 50),
        (-1, 1),
        (EdgeLaunch("foot_right", na=0.0),),
        media(absorption=0.02),
        COATS,
        face="top",
    )
    result = trace_light(scene, 4096)
    assert result.value("delivered") == pytest.approx(math.exp(-0.6), rel=1e-12)
    assert result.value("absorbed") == pytest.approx(1 - math.exp(-0.6), rel=1e-12)


def test_equal_indices_make_the_bonded_face_vanish() -> None:
    """A block cut by a bonded face delivers what the whole block does, ray by ray."""
    whole = slab(3, 2.0, top="paint", side="paint")
    cut = GuideProfile(
        (
            Edge("foot_right", Segment((-3, 0), (3, 0)), "acrylic", "air"),
            Edge("right", Segment((3, 0), (3, 1.2)), "acrylic", "paint"),
            Edge("gel_window", Segment((3, 1.2), (-3, 1.2)), "acrylic", "gel"),
            Edge("left", Segment((-3, 1.2), (-3, 0)), "acrylic", "paint"),
            Edge("side_right", Segment((3, 1.2), (3, 2)), "gel", "paint"),
            Edge("top", Segment((3, 2), (-3, 2)), "gel", "paint"),
            Edge("side_left", Segment((-3, 2), (-3, 1.2)), "gel", "paint"),
        )
    )
    lamp = LedRow("foot_right", (0.0,), 2.0, 0.3)
    one, two = (
        trace_light(
            LightScene(p, (-4, 4), (-4, 4), (lamp,), media(gel=N_ACRYLIC), COATS, face="top"), 8192
        )
        for p in (whole, cut)
    )
    assert two.value("delivered") == pytest.approx(one.value("delivered"), rel=1e-12)
    assert two.value("leaked.ends") + two.value("leaked.gel_ends") == pytest.approx(
        one.value("leaked.ends"), rel=1e-9
    )
    assert np.allclose(two.maps, one.maps, atol=1e-12)
