"""The standard deviations of forces hold over random contacts.

`bench/force/force_sigma.py` scores 200 of each mode.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from press_gate import KNOWLEDGE
from sigma_cases import CONDITIONS, spread_normal
from sigma_gate import COVERAGE, MODES, RMS, Score, scores, summaries

STORED = Path(__file__).parents[2] / "docs" / "data" / "force_sigma.json"
CASES = 40
TRUTH = 0.003
"""Relative error of the true motion near a force, by its splines and what the pad's edges do."""
LIMITS = [(0.035, 0.115), (0.035, 0.10), (0.025, 0.08), (0.025, 0.08)]
"""Median and 95th percentile of the error of F_z, by knowledge of the sensor."""


def test_a_summary_of_scores() -> None:
    rng = np.random.default_rng(3)
    sigma = rng.uniform(0.01, 0.02, (4000, 3))
    error = sigma * rng.normal(size=sigma.shape) * [1.0, 2.0, 0.5] + sigma * [0.0, 0.0, 0.5]
    some = [
        Score(k, (0.0, 0.0, -1.0), tuple(e.tolist()), tuple(s.tolist()))
        for k, (e, s) in enumerate(zip(error, sigma, strict=True))
    ]
    x, y, z = summaries([*some, Score(9999, (0.0, 0.0, -1.0), problem="nothing is seen")])
    assert x.cases == len(some)
    assert x.rms == pytest.approx(1.0, abs=0.05)
    assert x.covered == pytest.approx(0.95, abs=0.02)
    assert y.rms == pytest.approx(2.0, abs=0.1)
    assert y.covered == pytest.approx(0.673, abs=0.03)
    assert z.mean == pytest.approx(0.5, abs=0.03)


def test_evenly_spread_values_are_standard_normal() -> None:
    values = np.array([spread_normal(k) for k in range(200)])
    assert np.mean(values) == pytest.approx(0, abs=0.02)
    assert np.std(values) == pytest.approx(1, abs=0.02)
    assert (np.abs(values) < 1.96).mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_deviations_hold(mode: str) -> None:
    """A few contacts in all conditions: the limits are wider than those of 200 by their scatter."""
    found = scores(mode, range(CASES))
    every = [s for some in found.values() for s in some]
    assert sum(not s.error_n for s in every) < 0.25 * len(every)
    for summary in summaries(every):
        assert 0.55 < summary.rms < 1.45
        assert summary.covered > 0.85


def test_the_stored_scores_keep_the_gate() -> None:
    """What the table in the docs claims, from the scores themselves."""
    record = json.loads(STORED.read_text("utf-8"))
    assert record["cases"] >= 200
    assert set(record["modes"]) == set(MODES)
    for mode, conditions in record["modes"].items():
        assert set(conditions) == set(CONDITIONS)
        error, sigma = (
            np.concatenate([row[key] for row in conditions.values()])
            for key in ("error_mn", "sigma_mn")
        )
        refused = sum(row["refused"] for row in conditions.values())
        assert len(error) + refused == record["cases"]
        z = error / sigma
        rms, inside = np.sqrt((z**2).mean(axis=0)), (np.abs(z) < 1.96).mean(axis=0)
        assert ((rms > RMS[0]) & (rms < RMS[1])).all(), mode
        assert ((inside > COVERAGE[0]) & (inside < COVERAGE[1])).all(), mode


def test_the_stored_scores_of_gels_that_are_hardly_known_keep_the_gate() -> None:
    record = json.loads(STORED.read_text("utf-8"))["wide"]
    assert set(record) == set(CONDITIONS)
    error, sigma = (
        np.concatenate([row[key] for row in record.values()]) for key in ("error_mn", "sigma_mn")
    )
    assert len(error) >= 180
    z = error / sigma
    rms, inside = np.sqrt((z**2).mean(axis=0)), (np.abs(z) < 1.96).mean(axis=0)
    assert ((rms > RMS[0]) & (rms < RMS[1])).all()
    # One of 194 contacts more than 98 % is within 1.96 deviations of F_z.
    assert ((inside > COVERAGE[0]) & (inside < COVERAGE[1] + 0.01)).all()


def test_the_stored_errors_of_strong_presses_are_small() -> None:
    """Of presses of at least 0.2 N by light and markers; half were drawn after all weights."""
    strong = json.loads(STORED.read_text("utf-8"))["strong"]
    for known, (normal, normal_95) in zip(KNOWLEDGE, LIMITS, strict=True):
        row, reached = strong[known], strong[known]["relative"]
        assert reached["contacts"] + row["refused"] >= 200
        assert row["refused"] <= 2
        assert reached["normal"] < normal
        assert reached["normal_95"] < normal_95
        # With a calibrated light all forces are found 0.5 to 0.8 % too small.
        common = 0.004 if "light calibrated" in known else TRUTH
        assert abs(reached["mean"]) < 2 * reached["mean_sigma"] + common
        assert reached["shear"] < 0.01
        assert reached["centre_mm"] < 0.1
        assert reached["field"] < 0.22
        z = np.array(row["error_mn"]) / np.array(row["sigma_mn"])
        rms, inside = np.sqrt((z**2).mean(axis=0)), (np.abs(z) < 1.96).mean(axis=0)
        # With a known gel the deviations are up to a quarter too careful.
        assert ((rms > 0.75) & (rms < RMS[1])).all()
        assert (inside > COVERAGE[0]).all()


def test_the_stored_scores_of_deep_contacts_hold() -> None:
    """Coverage lacks up to 2 %."""
    deep = json.loads(STORED.read_text("utf-8"))["deep"]
    assert set(deep) == {"linear", "auto"}
    for law, row in deep.items():
        z = np.array(row["error_mn"]) / np.array(row["sigma_mn"])
        assert len(z) + row["refused"] >= 40
        rms, inside = np.sqrt((z**2).mean(axis=0)), (np.abs(z) < 1.96).mean(axis=0)
        assert (rms > RMS[0]).all(), law
        assert (rms < RMS[1]).all(), law
        assert (inside > 0.88).all(), law
    assert deep["auto"]["relative"]["normal"] < 0.5 * deep["linear"]["relative"]["normal"]
