"""The law of the light at places against sums over directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_law_map import LightLawMap, law_at
from gelslim_optics.light.light_map import LED_COLOURS, LightMap, red_green_sides

Array = NDArray[np.float64]
RISES = np.linspace(-1.2, 1.2, 25)
BACK, SPREAD = 0.15, 0.35
SIDES_DEG = np.array([90.0, -90.0])
PLACES_MM = np.array([[-6.25, -7.5], [6.25, -2.5], [6.25, 2.5], [-6.25, 7.5]])
"""Middles of some of the 2 x 4 parts of a pad of 25 x 20 mm."""


def rays(tangent: float, seed: int) -> Array:
    """(r, 3) share and tangent of rays of a mean tangent along +y; some of the light comes back."""
    rng = np.random.default_rng(seed)
    steep = tangent * rng.lognormal(-(SPREAD**2) / 2, SPREAD, 400)
    turn = rng.normal(0, np.radians(15), 400)
    ways = np.column_stack([steep * np.sin(turn), steep * np.cos(turn)])
    share = np.full(400, (1 - BACK) / 400)
    ahead = np.column_stack([share, share[:, None] * ways])
    return np.vstack([ahead, [BACK, 0.0, -BACK * 1.5]])


def light() -> LightMap:
    """Red light that is lower the farther it has come, and green light as high everywhere."""
    sums = np.stack(
        [
            [[rays(tangent, 8 * row + column) for column in range(2)] for row in range(4)]
            for tangent in (1.0, 2.0, 3.0, 4.0)
        ]
    )
    red = np.stack([sums[row, row] for row in range(4)])
    green = np.broadcast_to(sums[1, 0, 0] * np.array([1.0, 1.0, -1.0]), red.shape)
    steep = [fan[..., 2].sum(axis=-1).mean() for fan in (red, green)]
    elevation = np.degrees(np.arctan(1 / np.abs(steep)))
    x, y = ((np.arange(n) + 0.5) * 2.5 - n * 1.25 for n in (10, 8))
    fans = np.stack([red, green])
    return LightMap(x, y, np.ones((8, 10, 2)), SIDES_DEG, elevation, LED_COLOURS, fans)


def irradiance(sums: Array, rise: float) -> float:
    """Of a facet that rises along y, over that of a level one."""
    return float(np.maximum(sums[:, 0] - rise * sums[:, 2], 0).sum() / np.hypot(1, rise))


def test_each_place_has_the_law_of_its_rays() -> None:
    made = light()
    law = law_at(made, PLACES_MM, 1.4)
    assert made.fans is not None
    assert law.gamma == 1.4
    for number, (row, column) in enumerate([(0, 0), (1, 1), (2, 1), (3, 0)]):
        sums = made.fans[0, row, column]
        np.testing.assert_allclose(
            law.sensitivity[0, number], sums[:, 1:].sum(axis=0), rtol=1e-6, atol=1e-9
        )
        there = law.taken(np.full(len(RISES), number))
        value, _ = there.irradiance(np.column_stack([np.zeros_like(RISES), RISES]))
        expected = [irradiance(sums, rise) for rise in RISES]
        np.testing.assert_allclose(value[0], expected, atol=0.06)


def test_the_law_of_the_mean_is_wrong_by_half_where_light_has_come_far() -> None:
    made = light()
    there, mean = law_at(made, PLACES_MM, 1.0), LightLaw.of(made)
    ratio = mean.sensitivity[0, 1] / there.sensitivity[0, :, 1]
    assert ratio[0] > 1.9
    assert ratio[-1] < 0.7
    np.testing.assert_allclose(there.sensitivity[1], np.tile(mean.sensitivity[1], (4, 1)), atol=0.1)


def test_laws_are_bilinear_between_places_and_constant_beyond_the_pad() -> None:
    laws = LightLawMap.of(light())
    steps = np.linspace(PLACES_MM[1], PLACES_MM[2], 5)
    between = laws.at(steps, 1.0).sensitivity[0, :, 1]
    np.testing.assert_allclose(between, np.linspace(between[0], between[-1], 5), rtol=1e-12)
    beyond, edge = laws.at(np.array([[99.0, 99.0]]), 1.0), laws.at(np.array([[12.5, 10.0]]), 1.0)
    np.testing.assert_array_equal(beyond.sensitivity, edge.sensitivity)


def test_derivatives_at_places_are_those_by_differences() -> None:
    rng, step = np.random.default_rng(4), 1e-6
    law = law_at(light(), rng.uniform(-10, 10, (30, 2)), 1.8)
    slope = rng.normal(0, 0.5, (30, 2))
    _, by_slope = law.irradiance(slope)
    for axis in (0, 1):
        ends = [law.irradiance(slope + sign * step * np.eye(2)[axis])[0] for sign in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(by_slope[..., axis], numeric, atol=1e-7)


def test_light_that_the_mean_direction_leaves_out_is_ambient() -> None:
    """A fifth of ambient light: the sensitivity is four fifths of that of the directions."""
    made = light()
    steep = 0.8 / np.tan(np.radians(made.elevation_deg))
    less = replace(made, elevation_deg=np.degrees(np.arctan(1 / steep)))
    whole, part = (law_at(some, PLACES_MM, 1.0) for some in (made, less))
    np.testing.assert_allclose(part.sensitivity, 0.8 * whole.sensitivity, rtol=1e-6)
    shadow = np.tile([0.0, 1.2], (4, 1))
    assert (part.irradiance(shadow)[0][0] > whole.irradiance(shadow)[0][0] + 0.1).all()


def test_without_directions_the_law_is_the_same_everywhere() -> None:
    plain = red_green_sides(25.0, 20.0, decay_mm=1e6)
    law = law_at(plain, PLACES_MM, 1.0)
    assert law.taken(np.arange(2)) is law
    np.testing.assert_array_equal(law.sensitivity, LightLaw.of(plain).sensitivity)


@pytest.mark.parametrize("gamma", [1.0, 1.8])
def test_changes_at_places_are_those_of_each_place_alone(gamma: float) -> None:
    rng = np.random.default_rng(2)
    law = law_at(light(), PLACES_MM, gamma)
    slope, share, level = rng.normal(0, 0.4, (4, 2)), np.ones((2, 1, 4)) / 2, np.ones((1, 4))
    whole = law.change(slope, share, level, 1.0)[0]
    for k in range(4):
        own = law.taken(np.array([k]))
        alone = own.change(slope[k : k + 1], share[..., :1], level[:, :1], 1.0)[0]
        assert alone.item() == pytest.approx(whole[0, k])


def test_light_from_straight_below_changes_with_no_slope_alone() -> None:
    made = replace(light(), elevation_deg=np.array([90.0, 90.0]))
    law = law_at(made, PLACES_MM, 1.0)
    value, _ = law.irradiance(np.zeros((4, 2)))
    np.testing.assert_allclose(value, 1.0)
    assert np.abs(law.sensitivity).max() < 1e-6
