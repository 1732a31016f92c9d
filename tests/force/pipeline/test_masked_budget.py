"""A known contact is fitted with an operator that keeps the budget, not always the quick one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sensor_samples import sensor_bundle

from gelslim_core.budget.budget import Budget
from gelslim_force.forces.estimator import ForceEstimator, ForceSettings
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import operator_choices
from ifem_export.operators.operator_ladder import MeasuredRung, OperatorLadder
from ifem_export.operators.surface_operator import surface_operator

ERRORS = {"fft": 0.03, "pcg": 0.012, "factor": 0.01}


@pytest.fixture(scope="module")
def sensor() -> Bundle:
    bare, rungs = sensor_bundle(), []
    for k, (rung, parameters) in enumerate(operator_choices(bare.mesh)):
        if rung == "pcg" and parameters["rtol"] < 1e-2:
            continue
        error = ERRORS.get(rung, 0.4) if rung != "fft" or parameters else 0.1
        rungs.append(MeasuredRung(rung, parameters, error, 0, error, 1, 1, 1.0 + k, 1000 * k))
    return replace(bare, ladder=OperatorLadder(tuple(rungs), "made up", 4, "bbar", 0.3223))


def test_the_fit_takes_the_operator_chosen_where_the_quick_one_errs_more(sensor: Bundle) -> None:
    def fitted_with(budget: Budget | None) -> str:
        return PipelineSettings(budget=budget).compliance(sensor).name

    quick = sensor.surface_operator("fft", lumped=1).name
    for budget in (None, Budget(), Budget(time_ms=1.0), Budget(0.03), Budget(0.5)):
        assert fitted_with(budget) == quick
    assert fitted_with(Budget(0.02)) == "pcg"
    assert fitted_with(Budget(0.011)) == "factor"


def test_a_contact_at_the_edge_is_right_within_a_budget(sensor: Bundle) -> None:
    """The quick operator wraps round: 3 mm from the edge its resultant was a seventh off."""
    mesh = sensor.mesh
    exact = surface_operator(mesh, sensor.material, sensor.formulation, "factor")
    points = np.asarray(mesh.surface_mm)
    centre = np.array([points[:, 0].max() - 1.0, 0.0])
    share = np.maximum(1 - ((points[:, :2] - centre) ** 2).sum(axis=1) / 2.0**2, 0) ** 0.5
    force = share[:, None] * np.array([0.4, 0.0, -1.0]) / share.sum()
    moved = exact.displacement(force)

    def off(budget: Budget | None) -> float:
        settings = PipelineSettings(budget=budget, force=ForceSettings("masked"))
        fitter = ForceEstimator(mesh, settings.compliance(sensor), settings.force)
        found = fitter.estimate(moved, share > 0).force_n.sum(axis=0)
        return float(np.linalg.norm(found - force.sum(axis=0)) / np.linalg.norm(force.sum(axis=0)))

    assert off(None) > 0.05
    assert off(Budget(0.011)) < 0.04
