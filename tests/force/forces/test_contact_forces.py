"""Contacts by the pad's edge: forces from an operator that knows the edge."""

from __future__ import annotations

import numpy as np
import pytest
from pad_samples import small_bundle

from gelslim_force.forces.estimator import (
    ContactForces,
    ForceEstimator,
    ForceSettings,
    edge_distance_mm,
)
from ifem_export.operators.surface_operator import surface_operator

RADIUS_MM = 1.5


@pytest.fixture(scope="module")
def pad():
    """Estimators as a pipeline has them, and an operator for the truth."""
    bundle = small_bundle()
    settings, mesh = ForceSettings(), bundle.mesh
    quick = bundle.surface_operator("fft", lumped=1)
    both = ContactForces(
        ForceEstimator(mesh, bundle.surface_operator("pcg", rtol=1e-2), settings),
        ForceEstimator(mesh, quick, settings),
    )
    return both, surface_operator(mesh, bundle.material, "bbar", "factor")


def pressed(points: np.ndarray, x_mm: float) -> np.ndarray:
    share = np.maximum(1 - ((points[:, :2] - [x_mm, 0.0]) ** 2).sum(axis=1) / RADIUS_MM**2, 0)
    return np.sqrt(share)[:, None] * np.array([0.4, 0.1, -1.0]) / np.sqrt(share).sum()


@pytest.mark.parametrize("gap_mm", [2.0, 1.0, 0.0, -1.0])
def test_resultant_is_right_however_near_the_edge(pad, gap_mm: float) -> None:
    both, exact = pad
    points = both.fit.points_mm
    force = pressed(points, points[:, 0].max() - gap_mm - RADIUS_MM)
    moved = exact.displacement(force)
    touched = force[:, 2] < 0
    found = both.estimate(moved, touched, None, 0.0)
    assert found.force_n.sum(axis=0) == pytest.approx(force.sum(axis=0), abs=0.02)
    assert (found.contact == touched).all()
    fitted = both.fit.estimate(moved, touched).force_n.sum(axis=0)
    assert np.linalg.norm(fitted - force.sum(axis=0)) > 0.02


def test_far_from_the_edge_the_contact_is_fitted(pad) -> None:
    both, exact = pad
    force = pressed(both.fit.points_mm, 0.0)
    found = both.estimate(exact.displacement(force), force[:, 2] < 0, None, 0.0)
    away = np.hypot(*both.fit.points_mm[:, :2].T)
    assert not found.force_n[away > RADIUS_MM + 0.5].any()
    assert found.low_pass_mm is None


def test_a_fit_that_is_asked_for_is_made(pad) -> None:
    both, exact = pad
    points, masked = both.fit.points_mm, ForceSettings(method="masked")
    force = pressed(points, points[:, 0].max() - RADIUS_MM)
    asked = ContactForces(both.direct, ForceEstimator(both.fit.mesh, both.fit.operator, masked))
    assert asked.estimate(exact.displacement(force), force[:, 2] < 0, None, 0.0).misfit > 0


def test_nothing_is_left_to_make_at_the_first_contact(pad) -> None:
    """A first contact by the edge made thirty forces before its own, in the middle of a stream."""
    both, exact = pad
    fresh = ContactForces(ForceEstimator(both.fit.mesh, exact, ForceSettings()), both.fit)
    fresh.prepare()
    made = dict(vars(fresh.direct)), dict(vars(fresh.fit)), dict(vars(fresh))
    points = both.fit.points_mm
    for x_mm in (0.0, points[:, 0].max() - RADIUS_MM):
        force = pressed(points, x_mm)
        fresh.estimate(exact.displacement(force), force[:, 2] < 0, None, 0.0)
    after = dict(vars(fresh.direct)), dict(vars(fresh.fit)), dict(vars(fresh))
    assert [sorted(a) for a in after] == [sorted(m | {"area_mm2": 0}) if k < 2 else sorted(m)
                                          for k, m in enumerate(made)]  # fmt: skip


def test_an_operator_that_knows_the_edge_fits_there_too(pad) -> None:
    both, _ = pad
    assert both.near_edge.any()
    assert not ContactForces(both.direct, both.direct).near_edge.any()


def test_distance_to_the_edge() -> None:
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0))
    points = np.column_stack([0.5 * x.ravel(), 0.4 * y.ravel()])
    found = edge_distance_mm(points, (0.5, 0.4)).reshape(7, 9)
    assert found[0].max() == 0
    assert found[3, 4] == pytest.approx(1.2)
    assert found[3, 1] == pytest.approx(0.5)
