"""The law of light and slope against differences, and against a sum over directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_map import red_green_sides

Array = NDArray[np.float64]
SIDES = LightLaw(np.array([[0.0, 2.3], [0.0, -2.3], [-1.5, 0.0]]))


def view(count: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(7)
    share = rng.random((3, 2, count))
    return (
        rng.normal(0, 0.4, (count, 2)),
        share / share.sum(axis=0),
        rng.uniform(0.5, 1, (2, count)),
    )


def test_a_level_surface_does_not_change() -> None:
    value, by_slope = SIDES.irradiance(np.zeros((1, 2)))
    np.testing.assert_allclose(value, 1.0, rtol=1e-12)
    np.testing.assert_allclose(by_slope[:, 0], -SIDES.sensitivity, rtol=1e-12)


def test_derivatives_are_those_of_differences() -> None:
    slope, share, level = view(40)
    _, by_slope, by_gain = SIDES.change(slope, share, level, 1.1)
    small = 1e-6
    for axis, step in enumerate(np.eye(2) * small):
        ends = [SIDES.change(slope + k * step, share, level, 1.1)[0] for k in (1, -1)]
        np.testing.assert_allclose(
            by_slope[..., axis], (ends[0] - ends[1]) / (2 * small), atol=1e-8
        )
    ends = [SIDES.change(slope, share, level, 1.1 + k * small)[0] for k in (1, -1)]
    np.testing.assert_allclose(by_gain, (ends[0] - ends[1]) / (2 * small), atol=1e-8)


def test_small_slopes_scale_with_gamma() -> None:
    slope = np.array([[0.0, 1e-5]])
    share, level = np.ones((1, 1, 1)), np.ones((1, 1))
    law = LightLaw(np.array([[0.0, 2.0]]), gamma=1.6)
    assert law.change(slope, share, level, 1.0)[0].item() == pytest.approx(-2e-5 / 1.6, rel=1e-3)


def test_light_of_a_range_of_directions() -> None:
    """Lambert's law summed over rays: a quarter ambient, the rest spread about its elevation."""
    rng = np.random.default_rng(8)
    steep, turn = rng.lognormal(np.log(2.5), 0.5, 4000), rng.normal(0, np.radians(20), 4000)
    rays = np.column_stack([steep * np.sin(turn), steep * np.cos(turn)])
    ambient = 0.27
    law = LightLaw(np.array([(1 - ambient) * rays.mean(axis=0)]))
    for rise in np.linspace(-1.2, 1.2, 17):
        slope = np.array([0.0, rise])
        direct = np.maximum(1 - rays @ slope, 0).mean() / np.sqrt(1 + rise**2)
        whole = ambient + (1 - ambient) * direct
        assert law.irradiance(slope[None])[0].item() == pytest.approx(whole, abs=0.08)


def test_the_law_of_a_light_map() -> None:
    light = replace(
        red_green_sides(20.0, 20.0, decay_mm=15.0), elevation_deg=np.array([30.0, 45.0])
    )
    expected = [[0.0, np.sqrt(3.0)], [0.0, -1.0]]
    np.testing.assert_allclose(LightLaw.of(light).sensitivity, expected, atol=1e-12)
