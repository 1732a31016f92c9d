"""The certificate against marched rays, quadrature and the figures it is known for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from light_cases import transformed
from sampled import quick
from scipy.integrate import dblquad, quad
from scipy.stats import qmc

from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    curved_profile,
)
from gelslim_optics.guide.tir_bend import guided_2d, guided_3d, largest_na, least_ratio
from gelslim_optics.guide.tir_certificate import certify_tir

N, N_GEL = 1.4906, 1.41
APERTURES = (0.0, 0.3, 0.5, 0.7, 0.8, 1.0)


def curved(ratio: float, **changes: float) -> GuideProfile:
    guide = CurvedGuide(22.0, 2.0, 2.0 * ratio, 3.0, **changes)
    return curved_profile(guide, GelSection(20.0, 2.0))


def kept(ratio: float, p: np.ndarray, q: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Which rays stay in a long bend, marched wall to wall with vectors, the slow way.

    Rays start at (rho, 0) of a bend between radii `ratio` and `ratio` + 1, towards +y, with
    transverse slope p and axial slope q as n times direction cosines.
    """
    inner, outer = ratio, ratio + 1.0
    place = np.column_stack([rho, np.zeros_like(rho), np.zeros_like(rho)])
    way = np.column_stack([p, np.zeros_like(p), q]) / N
    way[:, 1] = np.sqrt(1 - way[:, 0] ** 2 - way[:, 2] ** 2)
    good = np.ones(len(rho), bool)
    for _ in range(6):
        hits = []
        for radius in (inner, outer):
            a = (way[:, :2] ** 2).sum(1)
            b = (place[:, :2] * way[:, :2]).sum(1)
            c = (place[:, :2] ** 2).sum(1) - radius**2
            root = np.sqrt(np.where(b * b - a * c > 0, b * b - a * c, np.nan))
            steps = np.stack([(-b - root) / a, (-b + root) / a])
            hits.append(np.nanmin(np.where(steps > 1e-9, steps, np.inf), axis=0))
        step = np.minimum(*hits)
        place = place + way * step[:, None]
        normal = place[:, :2] / np.linalg.norm(place[:, :2], axis=1, keepdims=True)
        across = (way[:, :2] * normal).sum(1)
        met_outer = hits[1] < hits[0]
        sine = np.sqrt(1 - across**2)
        good &= ~met_outer | (N * sine >= 1)
        way[:, :2] -= 2 * across[:, None] * normal
    return good


@pytest.mark.parametrize("ratio", quick([1.0, 2.05, 3.0, 6.0], (1.0, 3.0).__contains__))
@pytest.mark.parametrize("na", [0.5, 1.0])
def test_guided_shares_are_those_of_marched_rays(ratio: float, na: float) -> None:
    u = qmc.Sobol(3, seed=4).random(2**17)
    rho, angle, radius = ratio + u[:, 0], 2 * np.pi * u[:, 1], na * np.sqrt(u[:, 2])
    certified = certify_tir(curved(ratio), na, guide_index=N).bends[0]
    share = kept(ratio, radius * np.cos(angle), radius * np.sin(angle), rho).mean()
    assert certified.guided_3d == pytest.approx(share, abs=5e-4)
    flat = kept(ratio, na * (2 * u[:, 1] - 1), np.zeros(rho.size), rho).mean()
    assert certified.guided_2d == pytest.approx(flat, abs=5e-4)


@pytest.mark.parametrize(
    ("na", "ratio"), [(0, 2.04), (0.3, 2.17), (0.5, 2.47), (0.7, 3.16), (0.8, 3.88), (1, 9.49)]
)
def test_least_ratios_are_the_known_ones(na: float, ratio: float) -> None:
    assert least_ratio(na, N) == pytest.approx(ratio, abs=0.006)


@pytest.mark.parametrize("na", APERTURES)
def test_the_threshold_is_bracketed(na: float) -> None:
    limit = least_ratio(na, N)
    rng = np.random.default_rng(1)
    p = na * rng.uniform(-1, 1, 40_000)
    p[:200] = na
    for factor, guided in ((0.99, False), (1.01, True)):
        ratio = limit * factor
        assert certify_tir(curved(ratio), na, guide_index=N).fully_guided == guided
        rho = ratio + rng.random(p.size)
        rho[:200] = ratio + 1e-9
        assert bool(kept(ratio, p, np.zeros(p.size), rho).all()) == guided


@pytest.mark.parametrize("na", APERTURES)
@pytest.mark.parametrize("travel", [0.0, 1000.0])
def test_at_the_threshold_a_ray_is_guided_and_a_billionth_below_it_is_not(
    na: float, travel: float
) -> None:
    limit = least_ratio(na, N)
    at = certify_tir(transformed(curved(limit), travel, travel), na, guide_index=N)
    assert at.fully_guided
    assert at.margin_deg == pytest.approx(0.0, abs=1e-9)
    assert at.guided == at.guided_2d == 1.0
    below = certify_tir(transformed(curved(limit * (1 - 1e-7)), travel, travel), na, guide_index=N)
    assert not below.fully_guided
    assert "100" not in below.sentences()[0]
    if travel == 0:
        assert not certify_tir(curved(limit * (1 - 1e-9)), na, guide_index=N).fully_guided


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.5, 5.0, 9.0])
@pytest.mark.parametrize("na", [0.2, 0.7, 1.0])
def test_shares_agree_with_quadrature(ratio: float, na: float) -> None:
    inner = ratio / (ratio + 1)

    def flat(rho: float) -> float:
        return min(1.0, math.sqrt(max(N**2 - rho**-2, 0.0)) / na)

    kinks = [k for k in (1 / N, 1 / math.sqrt(N**2 - na**2)) if inner < k < 1]
    expected = quad(flat, inner, 1, points=kinks or None, epsabs=1e-13)[0] / (1 - inner)
    assert guided_2d(inner, na, N) == pytest.approx(expected, abs=1e-10)
    bend = certify_tir(curved(ratio), na, guide_index=N).bends[0]
    assert bend.error_3d < 1e-8
    assert bend.guided_3d >= bend.guided_2d - 1e-12


@pytest.mark.parametrize(("inner", "na"), [(0.5, 1.0), (0.75, 0.7), (0.75, 1.0), (0.2, 0.3)])
def test_the_cone_s_share_agrees_with_quadrature_and_its_error_is_stated(
    inner: float, na: float
) -> None:
    def slope(q: float, rho: float) -> float:
        room = N**2 - rho**-2 + q * q * (rho**-2 - 1)
        return math.sqrt(max(min(room, na * na - q * q), 0.0))

    area = dblquad(slope, inner, 1, 0, na, epsabs=1e-6)[0]
    expected = area * 4 / (math.pi * na * na * (1 - inner))
    fine, coarse = (guided_3d(inner, na, N, 1.0, k) for k in (48, 24))
    assert fine == pytest.approx(expected, abs=1e-5)
    assert abs(fine - coarse) < 1e-8


@pytest.mark.parametrize("na", APERTURES)
def test_largest_na_and_least_ratio_are_one_law(na: float) -> None:
    limit = least_ratio(na, N)
    inner = limit / (limit + 1)
    assert largest_na(inner, N) == pytest.approx(na, abs=1e-6)
    assert largest_na(0.99 / N, N) is None


def test_the_largest_na_of_a_profile_is_guided_and_more_is_not() -> None:
    for profile in (
        curved(3.0),
        curved(3.0, foot_thickness_mm=2.2),
        curved(3.0, foot_thickness_mm=1.7),
    ):
        most = certify_tir(profile, 1.0, guide_index=N).largest_na
        assert most is not None
        assert certify_tir(profile, most * (1 - 1e-9), guide_index=N).fully_guided
        assert not certify_tir(profile, most * (1 + 1e-6), guide_index=N).fully_guided
    assert certify_tir(curved(9.6), 0.5, guide_index=N).largest_na == 1.0
    assert certify_tir(curved(2.0), 0.5, guide_index=N).largest_na is None


def test_a_bare_led_below_the_limit_is_not_a_pass() -> None:
    found = certify_tir(curved(3.0), 1.0, guide_index=N, gel_index=N_GEL)
    assert not found.fully_guided
    assert found.guided == pytest.approx(0.9658, abs=2e-4)
    assert "96.6%" in found.sentences()[0]
    assert "R/t >= 9.49" in found.sentences()[0]


def test_a_perfect_guide_can_starve_the_gel() -> None:
    limit = N_GEL / (N - N_GEL)
    assert limit == pytest.approx(17.5, abs=0.05)
    for ratio, enters in ((limit * 0.99, True), (limit * 1.01, False)):
        found = certify_tir(curved(ratio), 0.0, guide_index=N, gel_index=N_GEL)
        assert found.fully_guided
        assert found.enters_gel == enters
        assert found.largest_entry_ratio == pytest.approx(limit)
    assert "R/t = 17.5" in found.sentences()[-1]
    assert certify_tir(curved(99.0), 1.0, guide_index=N, gel_index=N_GEL).enters_gel
    assert found.gel_critical_deg == pytest.approx(18.9, abs=0.05)


def test_a_gel_as_dense_as_the_guide_lets_everything_in() -> None:
    found = certify_tir(curved(3.0), 1.0, guide_index=N, gel_index=N)
    assert found.gel_critical_deg == 0.0
    assert found.enters_gel
    assert certify_tir(curved(99.0), 0.0, guide_index=N, gel_index=1.6).enters_gel


@pytest.mark.parametrize("na", [0.0, 0.5, 1.0])
def test_the_inner_wall_is_never_the_worse_one(na: float) -> None:
    for ratio in (0.5, 2.0, 10.0):
        bend = certify_tir(curved(ratio), na, guide_index=N).bends[0]
        assert bend.inner_margin_deg > bend.margin_deg


def test_moving_scaling_and_mirroring_change_nothing() -> None:
    profile = curved(2.5)
    turned = GuideProfile(tuple(e.reversed() for e in reversed(profile.edges)))
    reference = certify_tir(profile, 0.8, guide_index=N, gel_index=N_GEL)
    for other in (
        transformed(profile, 1000.0, -500.0),
        transformed(profile, factor=37.0),
        transformed(profile, mirrored=True),
        turned,
    ):
        found = certify_tir(other, 0.8, guide_index=N, gel_index=N_GEL)
        assert found.guided == pytest.approx(reference.guided, abs=1e-10)
        assert found.verdict == reference.verdict
        assert found.guided_2d == pytest.approx(reference.guided_2d, abs=1e-10)
        assert found.margin_deg == pytest.approx(reference.margin_deg, abs=1e-9)
        assert found.largest_na == pytest.approx(reference.largest_na, abs=1e-9)
        assert found.sentences() == reference.sentences()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"na": -0.1}, "na = -0.1"),
        ({"na": 1.2}, "na = 1.2"),
        ({"na": math.nan}, "na = nan"),
        ({"guide_index": 1.0}, "above outside_index"),
        ({"gel_index": 0.9}, "gel_index"),
        ({"outside_index": 0.5}, "outside_index"),
    ],
)
def test_nonsense_is_refused(changes: dict[str, float], words: str) -> None:
    wanted: dict[str, Any] = {"na": 1.0, "guide_index": N, "gel_index": N_GEL} | changes
    with pytest.raises(ValueError, match=words):
        certify_tir(curved(3.0), wanted.pop("na"), **wanted)


def test_no_radius_is_refused_with_the_reason() -> None:
    with pytest.raises(ValueError, match="inner_radius_mm = 0"):
        curved(0.0)
    hardly = certify_tir(curved(1e-6), 1.0, guide_index=N)
    assert hardly.largest_na is None
    assert 0 < hardly.guided_2d < hardly.guided < 0.4
