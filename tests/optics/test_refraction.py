"""Exact refraction through flat layers, against a bracketing solver and Snell's law."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from gelslim_optics.refraction import lateral_reach, ray_slope

LAYERS = [
    ([8.0], [1.0]),
    ([15.0, 2.5, 2.0], [1.0, 1.49, 1.41]),
    ([2.0, 10.0, 15.0], [1.0, 1.49, 1.41]),
    ([0.5, 3.0, 1.0, 4.0], [1.0, 2.4, 1.3, 1.0]),
]


def reach_by_snell(angle: float, heights: list[float], indices: list[float]) -> float:
    return sum(
        h * math.tan(math.asin(math.sin(angle) / n)) for h, n in zip(heights, indices, strict=True)
    )


def bracketed(reach: float, heights: list[float], indices: list[float]) -> float:
    def off(angle: float) -> float:
        return reach_by_snell(angle, heights, indices) - reach

    return float(brentq(off, 0.0, math.pi / 2 - 1e-9, xtol=1e-16, rtol=9e-16))


@pytest.mark.parametrize(("heights", "indices"), LAYERS)
def test_ray_slope_agrees_with_a_bracketing_solver(
    heights: list[float], indices: list[float]
) -> None:
    # From almost normal to 200 times the stack's height: 89.7° and more from the normal.
    total = sum(heights)
    reaches = total * np.concatenate([np.geomspace(1e-9, 1e-2, 12), np.geomspace(0.02, 200, 30)])
    angles = np.arctan(ray_slope(reaches, heights, indices))
    truth = np.array([bracketed(r, heights, indices) for r in reaches])
    assert np.abs(angles - truth).max() < 1e-12


def test_the_normal_ray_stays_normal_and_small_reaches_keep_their_digits() -> None:
    heights, indices = LAYERS[1]
    assert ray_slope(0.0, heights, indices) == 0.0
    paraxial = sum(h / n for h, n in zip(heights, indices, strict=True))
    for reach in (1e-3 * 1e-9, 1e-12, 1e-100):
        assert float(ray_slope(reach, heights, indices)) == pytest.approx(
            reach / paraxial, rel=1e-12
        )


def test_reach_and_slope_invert_each_other_on_both_sides() -> None:
    slopes = np.concatenate([-np.geomspace(50, 1e-6, 40), [0.0], np.geomspace(1e-6, 50, 40)])
    for heights, indices in LAYERS:
        reach = lateral_reach(slopes, heights, indices)
        np.testing.assert_array_equal(np.sign(reach), np.sign(slopes))
        np.testing.assert_allclose(ray_slope(reach, heights, indices), slopes, rtol=1e-11)


def test_reach_follows_snells_law() -> None:
    for heights, indices in LAYERS:
        for angle in (0.01, 0.4, 0.9, 1.3, 1.5):
            assert float(lateral_reach(math.tan(angle), heights, indices)) == pytest.approx(
                reach_by_snell(angle, heights, indices), rel=1e-12
            )


def test_layers_that_vary_from_ray_to_ray_broadcast() -> None:
    heights = [np.array([10.0, 12.0, 14.0]), 2.5, np.array([2.0, 1.8, 1.0])]
    indices = [1.0, 1.49, 1.41]
    reaches = np.array([3.0, -7.0, 20.0])
    together = ray_slope(reaches, heights, indices)
    for k in range(3):
        alone = ray_slope(reaches[k], [heights[0][k], 2.5, heights[2][k]], indices)
        assert together[k] == pytest.approx(float(alone), rel=1e-14)


def test_reach_is_concave_in_the_slope_and_below_the_straight_ray() -> None:
    # What lets Newton climb to the root without passing it.
    t = np.linspace(0, 30, 3001)
    for heights, indices in LAYERS:
        reach = lateral_reach(t, heights, indices)
        assert np.all(np.diff(reach) > 0)
        assert np.all(np.diff(reach, 2) < 1e-10)
        assert np.all(reach <= t * sum(heights) + 1e-9)


@pytest.mark.parametrize("air_mm", [0.0, -1.0])
def test_a_camera_without_air_before_it_is_refused(air_mm: float) -> None:
    with pytest.raises(ValueError, match="air gap"):
        ray_slope(1.0, [air_mm, 2.0], [1.0, 1.49])
