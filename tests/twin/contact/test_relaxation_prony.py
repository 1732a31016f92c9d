"""Relaxation against closed forms and against brute-force integration of the history."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.contact.relaxation import at_rest, relax

SERIES = PronySeries((0.2, 0.15, 0.05), (0.05, 0.7, 20.0))
PUSH = np.array([[0.1, -0.2, -1.0], [0.0, 0.05, -0.3]])


def relaxed(series: PronySeries, times: np.ndarray, elastic: np.ndarray) -> np.ndarray:
    """Forces (t, n, 3) step by step; the first one is a jump from rest."""
    state, found = at_rest(series, elastic.shape[1]), []
    for step_s, force in zip(np.diff(times, prepend=times[0]), elastic, strict=True):
        now, state = relax(series, state, force, float(step_s))
        found.append(now)
    return np.array(found)


def modulus(time_s: np.ndarray | float) -> np.ndarray:
    """g(t) = 1 - sum of g_i (1 - exp(-t / tau_i))."""
    terms = zip(SERIES.fractions, SERIES.times_s, strict=True)
    return 1 - sum(g * (1 - np.exp(-np.asarray(time_s) / tau)) for g, tau in terms)


def ramp_and_hold(series: PronySeries, t: np.ndarray, ramp_s: float) -> np.ndarray:
    """F(t) / F_end for a force that rises evenly until `ramp_s` and then stays.

    F = integral of g(t - s) F_e'(s) ds with g = 1 - sum g_i (1 - exp(-./tau_i)).
    """
    out = np.minimum(t / ramp_s, 1.0)
    for g, tau in zip(series.fractions, series.times_s, strict=True):
        first = np.minimum(t, ramp_s)
        kept = tau / ramp_s * (np.exp(-(t - first) / tau) - np.exp(-t / tau))
        out = out - g * (np.minimum(t / ramp_s, 1.0) - kept)
    return out


@pytest.mark.parametrize("steps", [1, 2, 7, 100])
def test_ramp_and_hold_is_exact_for_any_step(steps):
    ramp = np.linspace(0, 0.4, steps + 1)
    times = np.concatenate([ramp, 0.4 + np.array([0.001, 0.05, 1.0, 3.0, 500.0])])
    elastic = np.minimum(times / 0.4, 1.0)[:, None, None] * PUSH
    expected = ramp_and_hold(SERIES, times, 0.4)[:, None, None] * PUSH
    np.testing.assert_allclose(relaxed(SERIES, times, elastic), expected, rtol=1e-12, atol=1e-14)


def test_a_step_decays_as_the_modulus_does():
    times = np.array([0.0, 0.01, 0.1, 1.0, 10.0, 1e4])
    out = relaxed(SERIES, times, np.broadcast_to(PUSH, (6, 2, 3)))
    np.testing.assert_allclose(out, modulus(times)[:, None, None] * PUSH, rtol=1e-12)
    assert modulus(1e9) == pytest.approx(1 - sum(SERIES.fractions))


def test_any_history_agrees_with_the_hereditary_integral():
    random = np.random.default_rng(4)
    times = np.concatenate([[0.0], np.cumsum(random.uniform(0.01, 0.5, 12))])
    # Pushed throughout and never less than half: no node pulls.
    elastic = -random.uniform(0.8, 1.0, (13, 1, 3))
    elastic[0] = 0
    out = relaxed(SERIES, times, elastic)
    slopes = np.diff(elastic[:, 0], axis=0) / np.diff(times)[:, None]
    for k in (1, 5, 12):
        for axis in range(3):
            total = sum(
                quad(lambda s, k=k: float(modulus(times[k] - s)), times[j], times[j + 1])[0]
                * slopes[j, axis]
                for j in range(k)
            )
            assert out[k, 0, axis] == pytest.approx(total, rel=1e-9)


def test_no_terms_and_nil_fractions_leave_the_force_bit_for_bit():
    elastic = np.random.default_rng(1).normal(size=(5, 4, 3))
    elastic[..., 2] = -np.abs(elastic[..., 2])
    for series in (PronySeries(), PronySeries((0.0, 0.0), (1.0, 2.0))):
        assert series.is_null
        assert relaxed(series, np.arange(5.0), elastic).tobytes() == elastic.tobytes()


def test_after_release_every_force_is_zero():
    times = np.linspace(0, 2, 9)
    elastic = np.zeros((9, 2, 3))
    elastic[1:5] = PUSH
    out = relaxed(SERIES, times, elastic)
    assert (out[5:] == 0).all()
    assert (out[4, :, 2] < 0).all()
    assert np.abs(out[4]).sum() < np.abs(PUSH).sum()


def test_a_second_press_after_a_rest_is_weaker_than_the_first():
    """What the gel has not forgotten weakens the next press."""
    times = np.array([0.0, 0.1, 1.0, 1.05, 1.1])
    up = np.array([0.0, 1.0, 1.0, 0.0, 1.0])[:, None, None]
    out = relaxed(SERIES, times, up * PUSH)
    assert -out[4, 0, 2] < -out[1, 0, 2]
    # Pushed less than it remembers, the node would pull: it lets go instead.
    soft = relaxed(SERIES, times[:4], np.array([0, 1.0, 1.0, 0.01])[:, None, None] * PUSH)
    assert (soft[3] == 0).all()


def test_forces_never_exceed_the_elastic_ones_while_rising():
    times = np.linspace(0, 1, 50)
    elastic = (times**2)[:, None, None] * PUSH
    out = relaxed(SERIES, times, elastic)
    assert (np.abs(out) <= np.abs(elastic) + 1e-15).all()
    assert (np.abs(out) >= (1 - sum(SERIES.fractions)) * np.abs(elastic) - 1e-15).all()
