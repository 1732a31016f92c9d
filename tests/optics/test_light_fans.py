"""Directions of light against sums over all rays, and the tracer's own tallies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from light_cases import finger
from numpy.typing import NDArray

from gelslim_optics.light import trace_geometry as column
from gelslim_optics.light.light_fans import STEEPEST, LightFans
from gelslim_optics.light.light_map import LightMap, red_green_sides
from gelslim_optics.light.trace import trace_light

Array = NDArray[np.float64]
SIZE = 20.0, 16.0


def rays(seed: int, count: int = 4000) -> tuple[Array, Array]:
    """Fluxes (n,) and tangents (n, 2) of light that rises at 5 to 80 degrees, mostly along +y."""
    rng = np.random.default_rng(seed)
    rise, turn = np.radians(rng.uniform(5, 80, count)), rng.normal(np.pi / 2, 0.7, count)
    flux = rng.uniform(0.5, 1.0, count)
    return flux, np.column_stack([np.cos(turn), np.sin(turn)]) / np.tan(rise)[:, None]


def tallied(flux: Array, tangent: Array, turns: int = 12, rises: int = 12) -> Array:
    """Tallies (turns, rises, 3) as of the tracer."""
    found = np.zeros((turns, rises, 3))
    angle = np.arctan2(tangent[:, 1], tangent[:, 0]) / (2 * np.pi) + 0.5
    cosine = 1 / np.sqrt(1 + (tangent**2).sum(axis=1))
    at = (angle * turns).astype(int) % turns, np.minimum((cosine * rises).astype(int), rises - 1)
    np.add.at(found, at, np.column_stack([flux, flux[:, None] * tangent]))
    return found


@pytest.mark.parametrize("slope", [(0.0, 0.02), (0.1, -0.1), (-0.4, 0.3), (0.0, 1.0), (0.5, -2.0)])
def test_a_facet_gets_the_light_of_all_rays_that_meet_its_front(slope: tuple[float, float]) -> None:
    places = [[rays(3 * i + j) for j in range(2)] for i in range(3)]
    fans = LightFans.of_trace(np.array([[[tallied(*p) for p in row] for row in places]]), SIZE)
    gain = fans.gain(slope)
    assert gain.shape == (1, 2, 3)
    for i, row in enumerate(places):
        for j, (flux, tangent) in enumerate(row):
            lit = flux @ np.maximum(1 - tangent @ np.array(slope), 0.0) / flux.sum()
            truth = lit / np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
            assert gain[0, j, i] == pytest.approx(truth, abs=0.02)


def test_the_change_by_small_slopes_is_exact() -> None:
    flux, tangent = rays(5)
    fans = LightFans.of_trace(tallied(flux, tangent)[None, None, None], SIZE)
    for axis in range(2):
        step = np.eye(2)[axis] * 1e-3
        change = (fans.gain(tuple(step)) - fans.gain(tuple(-step))) / 2e-3
        assert change.item() == pytest.approx(-(flux @ tangent[:, axis]) / flux.sum(), rel=1e-6)


def test_tables_hold_the_gains() -> None:
    fans = LightFans.of_trace(tallied(*rays(6))[None, None, None], SIZE)
    count = fans.tables.shape[-1]
    axis = np.linspace(-STEEPEST, STEEPEST, count)
    for j, i in ((0, 0), (7, 30), (count // 2, 5), (count - 1, count // 2)):
        size = np.sqrt(1 + axis[j] ** 2 + axis[i] ** 2)
        held = fans.tables[0, 0, 0, j, i] / size
        assert held == pytest.approx(fans.gain((axis[i], axis[j])).item(), abs=1e-6)
    assert fans.tables[..., count // 2, count // 2].item() == 1.0


def test_places_without_light_take_the_directions_of_the_pad() -> None:
    some = tallied(*rays(7))
    tallies = np.stack([some, np.zeros_like(some), some])[None, :, None]
    found = LightFans.of_trace(tallies, SIZE).gain((0.1, 0.2))
    np.testing.assert_allclose(found, found[0, 0, 0], rtol=1e-9)
    with pytest.raises(ValueError, match="does not reach"):
        LightFans.of_trace(np.zeros((1, 2, 2, 3, 3, 3)), SIZE)


@pytest.mark.parametrize(
    "sums",
    [np.ones((1, 1, 1, 3)), np.full((1, 1, 1, 2, 3), np.nan), np.ones((1, 1, 1, 2, 3))],
)
def test_fans_that_make_no_sense_are_refused(sums: Array) -> None:
    with pytest.raises(ValueError, match="fan"):
        LightFans(sums, (-1.0, -1.0), (1.0, 1.0))


def test_a_map_without_fans_has_one_direction_per_source() -> None:
    light = red_green_sides(20.0, 16.0, decay_mm=8.0, elevation_deg=30.0)
    fans = light.light_fans
    np.testing.assert_allclose((fans.lower_mm, fans.upper_mm), ((-10.625, -8.125), (10.625, 8.125)))
    steep = 1 / np.tan(np.radians(30))
    np.testing.assert_allclose(fans.sums[:, 0, 0, 0], [[1, 0, steep], [1, 0, -steep]], atol=1e-12)
    with pytest.raises(ValueError, match="sources"):
        _ = replace(light, fans=fans.sums[:1]).light_fans


@pytest.mark.parametrize("mirror", ["", "glued"])
def test_tallies_of_direction_sum_to_those_of_the_whole(mirror: str) -> None:
    traced = trace_light(finger(mirror=mirror), 1 << 13)
    whole = traced.tallies.mean(axis=1)
    sums = traced.fans.sum(axis=(1, 2, 3, 4))
    np.testing.assert_allclose(sums[:, 0], whole[:, column.ARRIVED], rtol=1e-9)
    np.testing.assert_allclose(sums[:, 1], -whole[:, column.SLOPE_ALONG], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(sums[:, 2], -whole[:, column.SLOPE], rtol=1e-9)
    by_place = traced.maps.mean(axis=1).reshape(len(sums), 4, 10, 8, 5).sum(axis=(2, 4))
    np.testing.assert_allclose(traced.fans[..., 0].sum(axis=(3, 4)), by_place, rtol=1e-9)
    light = LightMap.from_bins(
        traced.maps.mean(axis=1), *SIZE, azimuth_deg=[90, -90], elevation_deg=[25, 25],
        colour=np.ones((2, 3)), fans=traced.fans,
    )  # fmt: skip
    assert light.light_fans.sums.shape[:3] == (2, 8, 4)
