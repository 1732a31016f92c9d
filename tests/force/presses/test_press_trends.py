"""Trends of residual forces: known ones are found, and none is told where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_force.presses.gel_fit import FittedPress
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_trends import PressTrends, press_trends

Array = NDArray[np.float64]
UP_AND_DOWN = np.array([0.1, 0.3, 0.6, 0.8, 0.5, 0.2, 0.7, 0.4])


def series(force_n: Array, residual: Array, time_s: Array | None = None) -> tuple[FittedPress, ...]:
    """Presses whose loads are off their fitted forces by relative residuals."""
    times = [None] * len(force_n) if time_s is None else [float(t) for t in time_s]
    loads = [Load(f"{k}.png", force_n[k] * (1 + residual[k]), 0.01, times[k])
             for k in range(len(force_n))]  # fmt: skip
    return tuple(
        FittedPress(load, float(force), 1.0, 0.3, np.zeros(2), 1.0, 0.0, 0.02, 0.02)
        for load, force in zip(loads, force_n, strict=True)
    )


def trends(residual: Array, time_s: Array | None = None, sigma: float = 0.01) -> PressTrends:
    presses = series(UP_AND_DOWN[: len(residual)], residual, time_s)
    return press_trends(presses, np.full(len(residual), sigma))


def test_a_change_over_time_is_found_at_the_times_of_the_presses() -> None:
    time = np.array([0.0, 10.0, 30.0, 200.0, 400.0, 500.0, 900.0, 1000.0])
    found = trends(-0.08 * time / 1000, time)
    assert found.timed
    assert found.over_time.change == pytest.approx(-0.08, abs=1e-9)
    assert found.over_time.clear
    assert "creep" in found.lines()[0]
    assert found.modulus_sigma == pytest.approx(0.08 / np.sqrt(12))
    shuffled = np.array([3, 0, 7, 1, 5, 2, 6, 4])
    presses = series(UP_AND_DOWN, -0.08 * time / 1000, time)
    again = press_trends([presses[k] for k in shuffled], np.full(8, 0.01))
    assert again.over_time.change == pytest.approx(found.over_time.change)
    assert again.unloading.sigma == pytest.approx(found.unloading.sigma)


def test_presses_after_a_larger_load_are_compared_with_the_others() -> None:
    falling = np.concatenate([[False], np.diff(UP_AND_DOWN) < 0])
    found = trends(np.where(falling, -0.06, 0.0))
    assert not found.timed
    assert found.unloading.change == pytest.approx(-0.06)
    assert found.unloading.clear
    assert "(hysteresis)" in found.lines()[1]
    assert found.modulus_sigma == pytest.approx(0.03)


def test_scatter_alone_is_told_as_no_trend() -> None:
    """Deviations hold: scores have a size of one, and hardly any is told as a trend."""
    rng = np.random.default_rng(3)
    scores, told = [], 0
    for _ in range(400):
        found = trends(0.01 * rng.normal(size=8))
        scores.append([found.over_time.change / found.over_time.sigma,
                       found.unloading.change / found.unloading.sigma])  # fmt: skip
        told += found.over_time.clear + found.unloading.clear
    size = np.sqrt(np.mean(np.square(scores), axis=0))
    assert ((size > 0.75) & (size < 1.1)).all()
    assert told < 0.02 * 2 * 400


def test_few_presses_have_no_trend() -> None:
    found = trends(np.array([0.0, 0.1, 0.2]))
    assert not found.over_time.known
    assert not found.unloading.known
    assert not found.lines()
    assert found.modulus_sigma == 0
    rising = press_trends(series(np.arange(1.0, 6.0), np.zeros(5)), np.full(5, 0.01))
    assert rising.over_time.known
    assert not rising.unloading.known
    assert len(rising.lines()) == 1
