"""Evenness of the light: right on average however few the rays, for maps that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_optics.light import trace_geometry as column
from gelslim_optics.light.result import LightResult

BINS = 40
X = (np.arange(BINS) + 0.5) / BINS


def result(maps: NDArray[np.float64]) -> LightResult:
    """One lamp whose replicates are `maps` (replicate, x, y)."""
    tallies = np.zeros((1, len(maps), column.PER_EDGE))
    return LightResult(
        ("red",), (1.0,), (), "face", maps.size, tallies, maps[None], 1.0, np.zeros(0)
    )


def ramp() -> NDArray[np.float64]:
    """From 0.5 at one side to 1.5 at the other: cv 1 / sqrt(12), darkest patch 0.5 + 1/16."""
    return np.repeat((0.5 + X)[:, None], BINS, axis=1)


@pytest.mark.parametrize("per_bin", [0.2, 2.0, 50.0])
def test_scatter_of_few_rays_is_not_taken_for_unevenness(per_bin: float) -> None:
    rng = np.random.default_rng(5)
    drawn = [result(rng.poisson(per_bin * ramp(), (8, BINS, BINS)) / per_bin) for _ in range(20)]
    found = [r.uniformity() for r in drawn]
    true_cv = float(np.std(ramp()))
    assert np.mean([f.cv for f in found]) == pytest.approx(true_cv, rel=0.05)
    assert np.mean([f.min_over_mean for f in found]) == pytest.approx(0.5625, abs=0.04)
    naive = np.mean([np.std(r.irradiance()) / np.mean(r.irradiance()) for r in drawn])
    assert (naive > 1.2 * true_cv) == (per_bin < 10)


def test_exact_maps_are_measured_exactly() -> None:
    for replicates in (1, 8):
        found = result(np.repeat(ramp()[None], replicates, axis=0)).uniformity()
        assert found.cv == pytest.approx(float(np.std(ramp())), rel=1e-12)
        assert found.min_over_mean == pytest.approx(0.5625, rel=1e-12)
    even = result(np.ones((8, 5, 3))).uniformity()
    assert (even.min_over_mean, even.cv) == pytest.approx((1.0, 0.0), abs=1e-7)


def test_no_light_has_no_evenness() -> None:
    found = result(np.zeros((8, BINS, BINS))).uniformity()
    assert math.isnan(found.min_over_mean)
    assert math.isnan(found.cv)
