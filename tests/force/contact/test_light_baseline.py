"""What is left out of the change of light: its level, its trend over the pad, reflections."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_force.contact.light_baseline import without_baseline
from gelslim_force.contact.reflections import colours_oppose, reflecting
from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
SHAPE = (120, 160)
NOISE = 0.02


def noise(layers: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).normal(0, NOISE, (layers, *SHAPE))


def dent() -> Array:
    """Change of log R/G at a contact that fills a tenth of the picture."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    u, v = (x - 95) / 25, (y - 50) / 25
    return np.where(u**2 + v**2 < 1, 0.8 * u, 0.0)


def test_level_and_noise_are_those_outside_the_contact() -> None:
    valid = np.random.default_rng(1).random(SHAPE) < 0.8
    change = noise(2) + 0.3
    change[0] += dent()
    expected = change - 0.3
    sigma = without_baseline(change, valid, np.ones_like(change))
    assert (change[:, ~valid] == 0).all()
    np.testing.assert_allclose(change[:, valid], expected[:, valid], atol=0.1 * NOISE)
    assert sigma[1].min() == sigma[1].max() == pytest.approx(NOISE, rel=0.1)


def test_a_contact_without_a_trend_is_left_as_it_is() -> None:
    """Only the median is taken off, to the last digit."""
    change = noise(1)
    change[0] += dent()
    expected = change.copy()
    valid = np.ones(SHAPE, dtype=bool)
    without_baseline(change, valid, np.ones_like(change))
    assert np.ptp(change - expected) < 1e-12


@pytest.mark.parametrize("slope", [(0.2, 0.0), (0.0, -0.1), (-0.15, 0.3)])
def test_a_trend_is_taken_off_and_a_contact_is_not(slope: tuple[float, float]) -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, SHAPE[1]), np.linspace(-1, 1, SHAPE[0]))
    change = noise(1)
    plain = change[0] + dent()
    change[0] = plain + slope[0] * x + slope[1] * y - 0.4
    sigma = without_baseline(change, np.ones(SHAPE, dtype=bool), np.ones_like(change))
    np.testing.assert_allclose(change[0], plain, atol=0.5 * NOISE)
    assert sigma.max() == pytest.approx(NOISE, rel=0.15)


def test_without_bins_nothing_is_known() -> None:
    change = noise(2)
    sigma = without_baseline(change, np.zeros(SHAPE, dtype=bool), np.ones_like(change))
    assert not change.any()
    assert np.isposinf(sigma).all()


def layers(red: Array, green: Array, blue: Array) -> Array:
    """The combinations of `ShadingChange` from logarithmic changes of the colours."""
    mean = (red + green) / 2
    return np.stack([red - green, mean, blue - mean])


def test_light_on_all_colours_is_a_reflection_and_a_tilt_is_none() -> None:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    white = 0.5 * np.exp(-(((x - 40) / 12) ** 2) - ((y - 80) / 8) ** 2)
    rng = np.random.default_rng(3)
    red, green, blue = (rng.normal(0, 0.01, SHAPE) for _ in range(3))
    tilted = layers(red + dent(), green - dent(), blue + 0.3 * dent())
    level, valid = np.full(tilted.shape, 0.01), np.ones(SHAPE, dtype=bool)
    assert not reflecting(tilted, level, valid).any()
    found = reflecting(
        layers(red + dent() + white, green - dent() + white, blue + white), level, valid
    )
    assert found[white > 0.05].all()
    assert not found[white < 1e-4].any()
    assert not reflecting(layers(red + white, green + white, blue), level, valid).any()


def light(azimuth_deg: list[float], colours: list[int]) -> LightMap:
    count, axis = len(azimuth_deg), np.array([-1.0, 1.0])
    return LightMap(
        axis, axis, np.ones((2, 2, count)), np.array(azimuth_deg), np.full(count, 35.0),
        np.eye(3)[colours],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("azimuth_deg", "colours", "opposed"),
    [
        ([90.0, -90.0], [0, 1], True),
        ([88.0, -87.0, 180.0], [0, 1, 2], True),
        ([0.0, 120.0, 240.0], [0, 1, 2], True),
        ([90.0, 0.0], [0, 1], False),
        ([90.0], [0], False),
        ([90.0, -90.0], [0, 0], False),
    ],
)
def test_colours_that_no_tilt_brightens_together(
    azimuth_deg: list[float], colours: list[int], opposed: bool
) -> None:
    """Two lights of one colour cancel at small slopes, and tell nothing of large ones."""
    assert colours_oppose(light(azimuth_deg, colours)) == opposed
