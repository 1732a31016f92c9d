"""The data of markers: their response, and the covariance where their weights expect too much."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.joint.markers.rows import MarkerRows

COUNT, UNKNOWNS, TRIALS = 60, 12, 1500


@pytest.mark.parametrize("expected", [2.0, 1.0, 0.5])
def test_the_covariance_is_that_of_estimates_from_random_data(expected: float) -> None:
    """Weights expect `expected` times the scatter that the data have."""
    rng = np.random.default_rng(3)
    rows, sums = rng.normal(size=(2 * COUNT, UNKNOWNS)), rng.normal(size=(6, UNKNOWNS))
    weight = rng.uniform(0.5, 2.0, 2 * COUNT)
    spread = sums @ np.linalg.inv((rows.T * weight) @ rows)
    found, estimates = np.zeros((6, 6)), []
    for _ in range(TRIALS):
        data = rng.normal(size=2 * COUNT) / np.sqrt(weight) / expected
        estimate = (spread @ rows.T * weight) @ data
        step = np.linalg.lstsq(rows * np.sqrt(weight)[:, None], data * np.sqrt(weight))[0]
        markers = MarkerRows(np.arange(COUNT), rows, data - rows @ step, weight)
        found += spread @ sums.T / TRIALS
        found -= markers.overstated(markers.by_motion(spread), UNKNOWNS) / TRIALS
        estimates.append(estimate)
    # A scatter larger than expected is for the misfit of the markers, not for their weights.
    scatter = np.cov(np.array(estimates).T) * min(1.0, expected) ** 2
    ratio = np.diag(found) / np.diag(scatter)
    np.testing.assert_allclose(ratio, 1.0, atol=0.12)


def test_the_response_is_the_change_of_the_sums_with_a_marker() -> None:
    rng = np.random.default_rng(4)
    rows, used = rng.normal(size=(2 * COUNT, UNKNOWNS)), np.arange(0, 2 * COUNT, 2)
    weight = rng.uniform(0.5, 2.0, 2 * COUNT)
    mm_per_px = rng.normal(size=(2 * COUNT, 2, 2))
    sums = rng.normal(size=(6, UNKNOWNS))
    inverse = np.linalg.inv((rows.T * weight) @ rows)
    markers = MarkerRows(used, rows, np.zeros(2 * COUNT), weight)
    found = markers.response(markers.by_motion(sums @ inverse), mm_per_px)
    shift_px = rng.normal(size=(2 * COUNT, 2))
    moved = np.einsum("nij,nj->ni", mm_per_px, shift_px)[used].ravel()
    by_data = sums @ (inverse @ (rows.T @ (weight * moved)))
    np.testing.assert_allclose(np.einsum("ani,ni->a", found, shift_px), by_data, rtol=1e-9)
    assert not found[:, 1::2].any()


def test_the_number_that_is_determined_is_a_trace() -> None:
    """With a prior, markers determine less than all forces; with none, all of them."""
    rng = np.random.default_rng(6)
    rows = rng.normal(size=(2 * COUNT, UNKNOWNS)) * np.geomspace(1, 0.01, UNKNOWNS)
    weight = rng.uniform(0.5, 2.0, 2 * COUNT)
    markers = MarkerRows(np.arange(COUNT), rows, np.zeros(2 * COUNT), weight)
    own = (rows.T * weight) @ rows
    for prior in (1e-12, 1.0):
        covariance = np.linalg.inv(own + prior * np.eye(UNKNOWNS))
        probes = markers.probes()
        found = markers.determined(probes, probes @ covariance)
        expected = np.trace(covariance @ own)
        # Hutchinson's variance, by the number of probes.
        projection = np.sqrt(weight)[:, None] * rows @ covariance @ (rows.T * np.sqrt(weight))
        off = projection - np.diag(np.diag(projection))
        assert abs(found - expected) < 3 * np.sqrt(2 * np.sum(off**2) / len(probes))
        assert found == pytest.approx(expected, rel=0.3)
