"""Contacts by the pad's edge: forces from an operator that knows the edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_samples import small_bundle

from gelslim_force.forces.contact_forces import ContactForces
from gelslim_force.forces.estimator import ForceEstimator, ForceSettings
from ifem_export.compliance.contact_columns import ContactCompliance
from ifem_export.mesh.surface_lattice import edge_distance_mm
from ifem_export.operators.surface_operator import surface_operator

RADIUS_MM = 1.5


@pytest.fixture(scope="module")
def pad():
    """Estimators as a pipeline has them, and an operator for the truth."""
    bundle = small_bundle()
    direct = ForceEstimator(bundle.mesh, bundle.surface_operator("pcg", rtol=1e-2), ForceSettings())
    quick = bundle.surface_operator("fft", lumped=1)
    both = ContactForces.of(direct, quick, ContactCompliance(bundle))
    return both, surface_operator(bundle.mesh, bundle.material, "bbar", "factor")


def pressed(points: np.ndarray, x_mm: float) -> np.ndarray:
    share = np.maximum(1 - ((points[:, :2] - [x_mm, 0.0]) ** 2).sum(axis=1) / RADIUS_MM**2, 0)
    return np.sqrt(share)[:, None] * np.array([0.4, 0.1, -1.0]) / np.sqrt(share).sum()


@pytest.mark.parametrize("gap_mm", [2.0, 1.0, 0.0, -1.0])
def test_a_contact_is_right_however_near_the_edge(pad, gap_mm: float) -> None:
    """Field and resultant; the fit by the infinite pad is off, the more the nearer the edge."""
    both, exact = pad
    points = both.fit.points_mm
    force = pressed(points, points[:, 0].max() - gap_mm - RADIUS_MM)
    moved = exact.displacement(force)
    touched = force[:, 2] < 0
    found = both.estimate(moved, touched, None, 0.0)
    assert found.force_n.sum(axis=0) == pytest.approx(force.sum(axis=0), abs=0.02)
    assert np.linalg.norm(found.force_n - force) < 0.09 * np.linalg.norm(force)
    assert (found.contact == touched).all()
    fitted = both.fit.estimate(moved, touched).force_n
    assert np.linalg.norm(fitted.sum(axis=0) - force.sum(axis=0)) > 0.02
    if gap_mm < 2.0:
        assert np.linalg.norm(fitted - force) > 0.15 * np.linalg.norm(force)
    # A pad with too many nodes for columns takes the forces of its stiffness.
    bare = replace(both, edge=None).estimate(moved, touched, None, 0.0)
    assert bare.force_n.sum(axis=0) == pytest.approx(force.sum(axis=0), abs=0.02)


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
    fit = ForceEstimator(both.fit.mesh, both.fit.operator, masked)
    for asked in (ContactForces(both.direct, fit), replace(both, fit=fit)):
        assert asked.estimate(exact.displacement(force), force[:, 2] < 0, None, 0.0).misfit > 0


def test_nothing_is_left_to_make_at_the_first_contact(pad, monkeypatch: pytest.MonkeyPatch) -> None:
    """A first contact by the edge made thirty forces before its own, in the middle of a stream."""
    both, exact = pad
    fresh = ContactForces.of(
        ForceEstimator(both.fit.mesh, exact, ForceSettings()),
        both.fit.operator,
        ContactCompliance(small_bundle()),
    )
    fresh.prepare()
    fresh.prepare_edge()
    columns = fresh.edge.operator.compliance
    assert columns._made[fresh.near_edge].all()
    monkeypatch.delattr(type(columns), "_solved")
    parts = (fresh, fresh.direct, fresh.fit, fresh.edge)
    light = {"area_mm2", "points_mm"}
    before = [set(vars(part)) - light for part in parts]
    points = both.fit.points_mm
    for x_mm in (0.0, points[:, 0].max() - RADIUS_MM):
        force = pressed(points, x_mm)
        fresh.estimate(exact.displacement(force), force[:, 2] < 0, None, 0.0)
    assert [set(vars(part)) - light for part in parts] == before


def test_an_operator_that_knows_the_edge_fits_there_too(pad) -> None:
    both, _ = pad
    assert both.near_edge.any()
    assert not both.near_edge.all()
    assert not ContactForces(both.direct, both.direct).near_edge.any()
    # Where the infinite pad is none, as under a crown, columns serve every contact.
    assert replace(both, fit=both.direct).near_edge.all()


def test_distance_to_the_edge() -> None:
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0))
    points = np.column_stack([0.5 * x.ravel(), 0.4 * y.ravel()])
    found = edge_distance_mm(points, (0.5, 0.4)).reshape(7, 9)
    assert found[0].max() == 0
    assert found[3, 4] == pytest.approx(1.2)
    assert found[3, 1] == pytest.approx(0.5)
