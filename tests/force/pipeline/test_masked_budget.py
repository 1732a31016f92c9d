"""A known contact is fitted as well as its mesh allows, at the edge too and whatever the budget."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sensor_samples import sensor_bundle

from gelslim_core.budget.budget import Budget
from gelslim_force.forces.contact_forces import ContactForces
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


@pytest.fixture(scope="module", params=[None, Budget(0.011)])
def estimators(sensor: Bundle, request: pytest.FixtureRequest) -> ContactForces:
    settings = PipelineSettings(budget=request.param, gel="linear")
    return settings.contact_forces(sensor, settings.operator(sensor), None)


@pytest.mark.parametrize("gap_mm", [6.0, -1.0])
def test_a_known_contact_is_right_within_a_budget(
    sensor: Bundle, estimators: ContactForces, gap_mm: float
) -> None:
    """Near the edge the infinite pad wraps round: its fit was a seventh to twice the force off."""
    mesh = sensor.mesh
    exact = surface_operator(mesh, sensor.material, sensor.formulation, "factor")
    points = np.asarray(mesh.surface_mm)
    centre = np.array([points[:, 0].max() - gap_mm, 0.0])
    share = np.maximum(1 - ((points[:, :2] - centre) ** 2).sum(axis=1) / 2.0**2, 0) ** 0.5
    force = share[:, None] * np.array([0.4, 0.0, -1.0]) / share.sum()
    found = estimators.estimate(exact.displacement(force), share > 0, None, 0.0).force_n
    total = force.sum(axis=0)
    assert np.linalg.norm(found.sum(axis=0) - total) < 0.04 * np.linalg.norm(total)
    assert np.linalg.norm(found - force) < 0.09 * np.linalg.norm(force)
    fitted = estimators.fit.estimate(exact.displacement(force), share > 0).force_n.sum(axis=0)
    assert (np.linalg.norm(fitted - total) > 0.05 * np.linalg.norm(total)) == (gap_mm < 2.0)
