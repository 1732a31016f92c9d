"""The validation's own truths, and that it tells good chains from bad."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sim_rig import small_sensor

from gelslim_twin.simulation.twin_sensor import TwinSensor
from gelslim_twin.validation.case import path, standard_cases
from gelslim_twin.validation.truth_pad import truth_pad
from gelslim_twin.validation.validate import Outcome, validate
from ifem_export.bundle_io import load_bundle


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> TwinSensor:
    place: Path = small_sensor(tmp_path_factory.mktemp("validated"))
    return TwinSensor(load_bundle(place))


@pytest.fixture(scope="module")
def outcomes(sensor: TwinSensor) -> tuple[Outcome, ...]:
    return validate(sensor).outcomes


def test_truth_is_finer_on_the_same_surface(sensor: TwinSensor) -> None:
    finer = truth_pad(sensor.bundle)
    assert finer.mesh.layers == 8
    assert np.asarray(finer.mesh.surface_mm) == pytest.approx(sensor.points_mm, abs=1e-12)


def test_cases_stay_on_the_pad() -> None:
    for case in standard_cases(2.0, 28.0, 28.0):
        assert max(p.depth_mm for p in case.poses) == pytest.approx(0.3)
        assert all(abs(p.x_mm) < 14 and abs(p.y_mm) < 14 for p in case.poses)
        assert case.poses[0].depth_mm == 0
    ends = path(standard_cases(2.0, 28.0, 28.0)[1].poses[-1])
    assert len(ends) == 7


def test_resultant_is_right_where_the_depth_is_known(outcomes: tuple[Outcome, ...]) -> None:
    ours = [o for o in outcomes if o.chain == "ours, depth known"]
    assert len(ours) == 4
    for outcome in ours:
        off = np.abs(np.subtract(outcome.found_n, outcome.true_n))
        assert (off < 0.06 * abs(outcome.true_n[2])).all(), outcome


def test_field_is_better_than_the_papers(outcomes: tuple[Outcome, ...]) -> None:
    by = {(o.case, o.chain): o for o in outcomes}
    for case in {o.case for o in outcomes}:
        ours, papers = by[case, "ours, depth known"], by[case, "paper, depth known"]
        assert ours.field_error < 0.7 * papers.field_error


def test_what_is_not_known_is_not_invented(outcomes: tuple[Outcome, ...]) -> None:
    for outcome in outcomes:
        if outcome.chain == "ours, tangential":
            assert np.isnan(outcome.found_n[2])
            off = np.abs(np.subtract(outcome.found_n, outcome.true_n))[:2]
            assert (off < 4 * np.array(outcome.sigma_n[:2]) + 0.01).all()
