"""Forces from the motion of the surface, on pads with known forces."""

from __future__ import annotations

import numpy as np
import pytest
from pad_samples import hertz_like, small_bundle
from scipy.spatial import cKDTree

from gelslim_force.forces.estimator import ForceEstimator, ForceSettings
from gelslim_force.forces.finite_strain import DepthLaw, FiniteStrainForce, deep_mm
from gelslim_force.forces.frame_result import ForceField
from gelslim_force.forces.wrench import WrenchNoise, resultant, rigid_motions
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.inverse.contact_inverse import masked_force
from ifem_export.mesh.surface_lattice import surface_share_mm2
from ifem_export.operators.ladder import lumped, refined
from ifem_export.operators.surface_operator import surface_operator


@pytest.fixture(scope="module")
def case():
    bundle = small_bundle()
    operator = bundle.surface_operator("factor")
    points = np.asarray(bundle.mesh.nodes_mm)[bundle.mesh.surface]
    force = hertz_like(points, 1.0, (0.3, -0.2))
    return bundle, operator, force, operator.displacement(force)


def estimator(case, method: str, **settings) -> ForceEstimator:
    bundle, operator, _, _ = case
    return ForceEstimator(bundle.mesh, operator, ForceSettings(method=method, **settings))


def test_direct_returns_the_forces_that_made_the_motion(case) -> None:
    _, _, force, moved = case
    found = estimator(case, "direct").estimate(moved)
    assert np.abs(found.force_n - force).max() < 1e-7
    assert found.centre_of_pressure_mm == pytest.approx([0.4, -0.3], abs=0.06)
    assert found.slip_margin == pytest.approx(1 - np.hypot(0.3, 0.2), abs=1e-6)
    assert found.traction_mpa[:, 2] @ found_area(case) == pytest.approx(-1.0, abs=1e-6)


def found_area(case) -> np.ndarray:
    return surface_share_mm2(case[0].mesh)


def test_shares_of_the_surface_sum_to_its_cells(case) -> None:
    mesh = case[0].mesh
    share = surface_share_mm2(mesh)
    cells = np.asarray(mesh.occupancy)[:, :, -1].sum()
    hx, hy, _ = mesh.cell_size_mm
    assert abs(hx / hy - 1) > 0.1
    assert share.sum() == pytest.approx(cells * hx * hy, rel=1e-12)
    assert share.max() == pytest.approx(hx * hy)
    assert share.min() >= hx * hy / 4 - 1e-12


def test_low_pass_keeps_the_resultant(case) -> None:
    _, _, force, moved = case
    found = estimator(case, "low_pass").estimate(moved)
    assert found.force_n.sum(axis=0) == pytest.approx(force.sum(axis=0), abs=1e-7)


def test_masked_fit_keeps_forces_on_the_contact(case) -> None:
    _, operator, force, moved = case
    noisy = moved + np.random.default_rng(5).normal(0, 0.005, moved.shape)
    touched = force[:, 2] < 0
    masked = estimator(case, "auto", most_steps=200).estimate(noisy, touched)
    pitch_mm = 0.5
    away = np.hypot(masked.points_mm[:, 0] - 0.4, masked.points_mm[:, 1] + 0.3)
    assert not masked.force_n[away > 2.2 + pitch_mm].any()
    assert (masked.contact == touched).all()
    raw = operator.force(noisy)
    size = np.linalg.norm(force)
    assert np.linalg.norm(masked.force_n - force) < 0.5 * np.linalg.norm(raw - force)
    assert np.linalg.norm(masked.force_n - force) < 0.04 * size
    assert masked.force_n.sum(axis=0) == pytest.approx([0.3, -0.2, -1.0], abs=0.04)


def test_without_normal_motion_the_tangential_resultant_is_right(case) -> None:
    _, _, _, moved = case
    blind = moved.copy()
    blind[:, 2] = np.nan
    found = estimator(case, "auto").estimate(blind)
    assert np.isnan(found.force_n[:, 2]).all()
    assert np.isnan(found.slip_margin)
    assert np.isnan(found.centre_of_pressure_mm).all()
    assert found.force_n[:, :2].sum(axis=0) == pytest.approx([0.3, -0.2], abs=0.02)


def test_rest_is_no_force_and_no_nan(case) -> None:
    _, _, force, _ = case
    rest = np.zeros_like(force)
    for touched in (None, np.zeros(len(force), bool), force[:, 2] < 0):
        found = estimator(case, "auto").estimate(rest, touched)
        assert not found.force_n.any()
        assert np.isfinite(found.force_n).all()
        assert np.isnan(found.slip_margin)


@pytest.mark.slow
def test_wrench_covariance_is_that_of_many_draws(case) -> None:
    bundle, operator, _force, _moved = case
    points = np.asarray(bundle.mesh.nodes_mm)[bundle.mesh.surface]
    noise = WrenchNoise.of(operator, points)
    to_nodes = bundle.markers.to_surface
    count = to_nodes.shape[1]
    spread = np.array([[4e-6, 1e-6], [1e-6, 2e-6]])
    gains = noise.gains(bundle.markers.sparse) @ np.linalg.cholesky(spread)
    predicted = noise.covariance(gains, np.ones(count))
    rng = np.random.default_rng(0)
    draws = []
    for _ in range(400):
        d = np.zeros((count, 3))
        d[:, :2] = rng.multivariate_normal([0, 0], spread, count)
        f, t = resultant(points, operator.force(to_nodes @ d))
        draws.append([*f, *t])
    found = np.cov(np.array(draws).T)
    ratio = np.diag(found) / np.diag(predicted)
    assert ((ratio > 0.75) & (ratio < 1.3)).all()
    scale = np.sqrt(np.outer(np.diag(predicted), np.diag(predicted)))
    assert np.abs((found - predicted) / scale).max() < 0.25


def test_uncertain_depth_adds_to_the_normal_force(case) -> None:
    bundle, operator, _, moved = case
    points = np.asarray(bundle.mesh.nodes_mm)[bundle.mesh.surface]
    noise = WrenchNoise.of(operator, points)
    gains = noise.gains(bundle.markers.sparse)
    nothing = np.zeros(gains.shape[1])
    sigma = np.abs(moved[:, 2]) * 0.1
    still = np.zeros(gains.shape[1:])
    found = noise.covariance(gains, nothing, [noise.by_error(gains, sigma, still)])
    shift = np.zeros_like(moved)
    shift[:, 2] = sigma
    assert found[2, 2] == pytest.approx(operator.force(shift).sum(axis=0)[2] ** 2, rel=1e-5)


def test_wrench_without_normal_motion_marks_what_it_does_not_know(case) -> None:
    bundle, operator, force, _ = case
    points = np.asarray(bundle.mesh.nodes_mm)[bundle.mesh.surface]
    blind = force.copy()
    blind[:, 2] = np.nan
    wrench = WrenchNoise.of(operator, points).wrench(blind, np.eye(6))
    assert np.isnan(wrench.vector).tolist() == [False, False, True, True, True, False]
    assert np.isnan(wrench.standard_deviation).tolist() == [False, False, True, True, True, False]


def test_rigid_motions_turn_forces_into_the_resultant(case) -> None:
    _, _, force, _ = case
    points = np.asarray(case[0].mesh.nodes_mm)[case[0].mesh.surface]
    found = np.einsum("ack,ck->a", rigid_motions(points), force)
    assert found == pytest.approx(np.concatenate(resultant(points, force)), abs=1e-12)


def test_neo_hookean_equals_linear_for_small_motion_and_differs_for_large(case) -> None:
    bundle, _operator, force, moved = case
    law = FiniteStrainForce(bundle, tolerance=1e-6)
    small = law.force(1e-5 * moved) / 1e-5
    assert np.linalg.norm(small - force) < 2e-3 * np.linalg.norm(force)
    large = law.force(0.5 * moved)
    assert large[:, 2].sum() < 0.51 * force[:, 2].sum()


def test_the_law_follows_the_depth(case) -> None:
    bundle, operator, _, moved = case
    strained = FiniteStrainForce(bundle)
    law = DepthLaw(operator, strained, deep_mm(bundle))
    thickness = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    assert law.from_mm == pytest.approx(0.1 * thickness)
    unit = moved / -moved[:, 2].min() * law.from_mm
    assert (law.force(0.99 * unit) == operator.force(0.99 * unit)).all()
    assert (law.force(1.01 * unit) == strained.force(1.01 * unit)).all()
    assert not law.of(1.01 * unit).by_linear_law


def test_a_motion_that_no_gel_has_gets_linear_forces_which_are_told(case) -> None:
    bundle, operator, _, moved = case
    thickness = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    inverted = moved * [1.0, 1.0, 1.5 * thickness / -moved[:, 2].min()]
    strained = FiniteStrainForce(bundle)
    with pytest.raises(FiniteStrainError):
        strained.force(inverted)
    law = DepthLaw(operator, strained, deep_mm(bundle))
    found = law.of(inverted)
    assert found.by_linear_law
    assert (found.force_n == operator.force(inverted)).all()
    estimator = ForceEstimator(bundle.mesh, operator, ForceSettings(method="direct"), law)
    field = estimator.estimate(inverted)
    assert field.by_linear_law
    assert ForceField.from_record(field.to_record()).by_linear_law
    assert not estimator.estimate(0.5 * moved).by_linear_law


@pytest.mark.parametrize("steps", [0, 9])
def test_the_law_of_a_frame_is_that_of_tight_tolerances(case, steps: int) -> None:
    """In the middle, and where the dent is at the edge, which the infinite pad does not have."""
    bundle, _, _, moved = case
    places = np.round(np.asarray(bundle.mesh.surface_mm)[:, :2] / bundle.mesh.cell_size_mm[:2])
    shifted = places + np.array([steps, 0])
    gap, source = cKDTree(shifted).query(places)
    u = np.where((gap < 0.1)[:, None], 0.5 * moved[source], 0.0)
    exact = FiniteStrainForce(bundle, tolerance=1e-7, inner_rtol=1e-8, most_steps=60).force(u)
    law = FiniteStrainForce.per_frame(bundle)
    found = law.held(u)
    again = law.held(u, law.held(0.9 * u))
    for force in (found.force_n, again.force_n):
        assert np.linalg.norm(force - exact) < 0.01 * np.linalg.norm(exact)
        total = np.linalg.norm(exact.sum(axis=0))
        assert np.linalg.norm((force - exact).sum(axis=0)) < 0.005 * total


@pytest.mark.slow
def test_neo_hookean_inner_nodes_are_in_balance(case) -> None:
    """Against Newton's method with the exact tangent, to the last digit."""
    bundle, _, _, moved = case
    from scipy.sparse.linalg import spsolve

    u = 0.5 * moved
    law = FiniteStrainForce(bundle, tolerance=1e-3)
    columns = law.system.columns
    whole = np.zeros((bundle.mesh.n_nodes, 3))
    whole[-columns:] = u
    inside = np.arange(3 * columns, whole.size - 3 * columns)
    for step in range(30):
        whole[-columns:] = min(1.0, (step + 1) / 10) * u
        rest = law.pad.force(whole).reshape(-1)[inside]
        tangent = law.pad.tangent(whole).tocsr()[inside][:, inside]
        whole.reshape(-1)[inside] -= spsolve(tangent.tocsc(), rest)
    assert np.abs(law.pad.force(whole).reshape(-1)[inside]).max() < 1e-10
    exact = law.pad.force(whole)[-columns:]
    assert np.linalg.norm(law.force(u) - exact) < 2e-3 * np.linalg.norm(exact)


@pytest.mark.slow
def test_masked_fit_holds_pressure_between_the_nodes(case) -> None:
    """Truth from half the pitch and eight layers: its rim loads nodes outside the contact."""
    bundle, operator, _, _ = case
    fine = refined(bundle.mesh)
    points = np.asarray(fine.surface_mm)
    pressed = hertz_like(points, 1.0, (0.3, -0.2))
    every = [int(k) for k in cKDTree(points[:, :2]).query(bundle.mesh.surface_mm[:, :2])[1]]
    u = surface_operator(fine, bundle.material, "bbar", "pcg").displacement(pressed)[every]
    touched = np.hypot(points[every, 0] - 0.4, points[every, 1] + 0.3) < 2.2
    found = estimator(case, "auto", most_steps=400, tolerance=1e-4).estimate(u, touched).force_n
    bare = masked_force(operator, u, touched, most_steps=400, tolerance=1e-4).force_n
    true = lumped(pressed, fine, bundle.mesh)
    assert found.sum(axis=0) == pytest.approx([0.3, -0.2, -1.0], abs=0.02)
    assert np.linalg.norm(found - true) < 0.8 * np.linalg.norm(bare - true)


@pytest.mark.slow
def test_masked_fit_of_a_neo_hookean_gel(case) -> None:
    bundle, operator, force, moved = case
    law = FiniteStrainForce(bundle, tolerance=1e-4)
    u = 0.5 * moved
    true = law.force(u).sum(axis=0)
    touched = force[:, 2] < 0
    settings = ForceSettings(most_steps=400, tolerance=1e-4)
    linear = ForceEstimator(bundle.mesh, operator, settings).estimate(u, touched)
    found = ForceEstimator(bundle.mesh, operator, settings, law).estimate(u, touched)
    off = np.linalg.norm(found.force_n.sum(axis=0) - true)
    assert off < 0.03 * np.linalg.norm(true)
    assert off < 0.5 * np.linalg.norm(linear.force_n.sum(axis=0) - true)


def test_impossible_settings_are_named() -> None:
    for bad, name in (
        ({"method": "magic"}, "method"),
        ({"friction": -1.0}, "friction"),
        ({"low_pass_mm": 0.0}, "low_pass_mm"),
        ({"most_steps": 0}, "most_steps"),
    ):
        with pytest.raises(ValueError, match=name):
            ForceSettings(**bad)
