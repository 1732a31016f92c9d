"""Figures of a force field by their definitions, on a pad with a law that needs no solver."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from pad_samples import small_bundle
from scipy import sparse

from gelslim_force.forces.contact_forces import ContactForces
from gelslim_force.forces.estimator import (
    ForceEstimator,
    ForceSettings,
    curvature_operator,
    with_neighbours,
)
from gelslim_force.forces.low_pass import ForceNoise, LowPass, MotionNoise
from ifem_export.mesh.surface_lattice import edge_distance_mm, neighbour_matrix

MESH = small_bundle().mesh
POINTS = np.asarray(MESH.surface_mm)
COUNT = len(POINTS)
SPRINGS = np.array([2.0, 3.0, 5.0])


class Springs:
    """Every node on its own springs, in N/mm along x, y and z."""

    def __init__(self, name: str = "springs") -> None:
        self.name = name

    def force(self, motion: np.ndarray) -> np.ndarray:
        return np.asarray(motion) * SPRINGS

    def displacement(self, force: np.ndarray) -> np.ndarray:
        return np.asarray(force) / SPRINGS


def estimator(**settings: object) -> ForceEstimator:
    chosen = ForceSettings(**{"method": "direct", **settings})  # type: ignore[arg-type]
    return ForceEstimator(MESH, Springs(), chosen)  # type: ignore[arg-type]


def random_motion(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 0.1, (COUNT, 3)) - [0.02, -0.01, 0.05]


def test_a_field_holds_forces_tractions_centre_and_margin() -> None:
    moved = random_motion()
    found = estimator(friction=0.7).estimate(moved)
    force = moved * SPRINGS
    np.testing.assert_allclose(found.force_n, force)
    np.testing.assert_allclose(found.traction_mpa, force / estimator().area_mm2[:, None])
    # Only nodes that push count for the centre.
    push = np.where(force[:, 2] < 0, -force[:, 2], 0.0)
    np.testing.assert_allclose(
        found.centre_of_pressure_mm, (push[:, None] * POINTS[:, :2]).sum(axis=0) / push.sum()
    )
    total = force.sum(axis=0)
    assert total[2] < 0
    expected = 1 - math.hypot(total[0], total[1]) / (0.7 * -total[2])
    assert found.slip_margin == pytest.approx(expected)
    assert found.contact.all()
    assert found.misfit == 0.0


def test_a_pull_and_a_surface_without_friction_have_no_margin() -> None:
    moved = random_motion()
    assert math.isnan(estimator(friction=0.0).estimate(moved).slip_margin)
    pulled = estimator().estimate(np.abs(moved))
    assert math.isnan(pulled.slip_margin)
    assert np.isnan(pulled.centre_of_pressure_mm).all()
    assert math.isnan(estimator().estimate(np.zeros((COUNT, 3))).slip_margin)


def test_an_unknown_normal_motion_leaves_the_tangential_forces() -> None:
    blind = random_motion()
    blind[5, 2] = np.nan
    found = estimator().estimate(blind)
    np.testing.assert_allclose(found.force_n[:, :2], blind[:, :2] * SPRINGS[:2])
    assert np.isnan(found.force_n[:, 2]).all()
    assert math.isnan(found.slip_margin)
    np.testing.assert_array_equal(found.displacement_mm, blind)
    # A contact region does not help where the depth is unknown.
    touched = np.zeros(COUNT, dtype=bool)
    touched[40] = True
    fitted = estimator(method="masked").estimate(blind, touched)
    np.testing.assert_allclose(fitted.force_n[:, :2], blind[:, :2] * SPRINGS[:2])
    assert fitted.low_pass_mm is not None
    assert (fitted.contact == touched).all()


@pytest.mark.parametrize("normal_known", [True, False])
def test_a_contact_is_a_force_of_five_sigmas(normal_known: bool) -> None:
    moved = random_motion(2)
    if not normal_known:
        moved[:, 2] = np.nan
    ours = estimator(method="low_pass")
    draws = np.random.default_rng(4).normal(0, 1.0, (2, 3, COUNT, 3))
    vars(ours)["low_pass"] = LowPass.of(POINTS, np.array([0.0]), ForceNoise(draws))
    noise_px = 0.06
    found = ours.estimate(moved, noise_px=noise_px)
    noise = MotionNoise(noise_px, 0.0)
    axes = [0, 1, 2] if normal_known else [0, 1]
    # Springs of one node do not spread, so that the noise is that of the draws.
    square = (draws[0][:, :, axes] ** 2).sum(axis=-1).mean(axis=0) * noise.marker_px**2
    if normal_known:
        inner = np.asarray(curvature_operator(ours.neighbours) @ moved[:, 2])
        sigma_mm = np.quantile(np.abs(inner), 0.25) / 0.31864 / math.sqrt(1.25)
        square += (draws[1] ** 2).sum(axis=-1).mean(axis=0) * sigma_mm**2
    else:
        square += 0.0
    size = np.linalg.norm((moved * SPRINGS)[:, axes], axis=1)
    np.testing.assert_array_equal(found.contact, size > 5 * np.sqrt(square))
    assert (0.02 if normal_known else 0.2) < found.contact.mean() + 0.02 < 0.95


def test_settings_are_checked_at_their_limits() -> None:
    for bad in (
        {"friction": -1e-9}, {"friction": math.inf}, {"low_pass_mm": math.nan},
        {"low_pass_mm": -0.1}, {"low_pass_mm": math.inf}, {"most_steps": 0},
        {"tolerance": 0.0}, {"tolerance": 1.0},
    ):  # fmt: skip
        with pytest.raises(ValueError, match="must be"):
            ForceSettings(**bad)  # type: ignore[arg-type]
    lowest = ForceSettings(friction=0.0, most_steps=1, tolerance=0.999, low_pass_mm=1e-6)
    assert lowest.friction == 0


def test_neighbours_share_an_edge_of_a_cell() -> None:
    nx, ny, cell = 6, 5, np.array([0.5, 0.8])
    i, j = (v.ravel() for v in np.meshgrid(np.arange(nx), np.arange(ny)))
    # Not an arithmetic grid: one corner is missing.
    i, j = i[1:], j[1:]
    points = np.column_stack([i * cell[0], j * cell[1], 0 * i])
    found = neighbour_matrix(points, cell).toarray()
    expected = np.abs(i[:, None] - i) + np.abs(j[:, None] - j) == 1
    np.testing.assert_array_equal(found, expected)
    inner = np.flatnonzero(expected.sum(axis=1) == 4)
    bend = curvature_operator(sparse.csr_array(found)).toarray()
    np.testing.assert_allclose(bend, np.eye(len(i))[inner] - expected[inner] / 4)
    edge = expected.sum(axis=1) < 4
    apart = np.hypot(*(points[:, None, :2] - points[None, edge, :2]).transpose(2, 0, 1))
    np.testing.assert_allclose(edge_distance_mm(points, cell), apart.min(axis=1))
    touched = np.zeros(len(i), dtype=bool)
    touched[[0, 13]] = True
    np.testing.assert_array_equal(
        with_neighbours(touched, sparse.csr_array(found)), touched | expected[touched].any(axis=0)
    )


def test_near_the_edge_is_within_one_and_a_half_thicknesses() -> None:
    fit = ForceEstimator(MESH, Springs("fft of springs"), ForceSettings())  # type: ignore[arg-type]
    both = ContactForces(estimator(), fit)
    distance = edge_distance_mm(POINTS, MESH.cell_size_mm[:2])
    np.testing.assert_array_equal(both.near_edge, distance < 3.0)
    assert 0.1 < both.near_edge.mean() < 0.95
    other = ContactForces(estimator(), estimator())
    assert not other.near_edge.any()


def test_the_operator_of_the_fit_is_used_only_where_it_may() -> None:
    made: list[str] = []

    def recorder(name: str, method: str) -> SimpleNamespace:
        def estimate(moved: object, touched: object, start: object, noise: float) -> object:
            made.append(f"{name} {'blind' if touched is None else 'touched'}")
            return estimator().estimate(random_motion())

        return SimpleNamespace(
            estimate=estimate, settings=ForceSettings(method=method),  # type: ignore[arg-type]
            mesh=MESH, points_mm=POINTS, operator=Springs("fft"),
        )  # fmt: skip

    middle, edge = np.zeros((2, COUNT), dtype=bool)
    distance = edge_distance_mm(POINTS, MESH.cell_size_mm[:2])
    middle[np.argmax(distance)] = edge[np.argmin(distance)] = True
    for method, touched, expected in (
        ("auto", None, "direct blind"),
        ("auto", middle, "fit touched"),
        ("auto", edge, "direct blind"),
        ("masked", None, "direct blind"),
        ("masked", middle, "fit touched"),
        ("masked", edge, "fit touched"),
        ("low_pass", middle, "direct touched"),
        ("direct", edge, "direct touched"),
    ):
        both = ContactForces(recorder("direct", method), recorder("fit", method))  # type: ignore[arg-type]
        found = both.estimate(random_motion(), touched, None, 0.0)
        assert made.pop() == expected
        if method == "auto" and touched is edge:
            assert (found.contact == edge).all()


def test_the_low_pass_stops_where_steins_estimate_rises() -> None:
    """Width by width, as the formula says: |f - H f|² + 2 tr(H C), for each part alone."""
    rng = np.random.default_rng(6)
    count = 5
    for _ in range(40):
        spreads = [np.eye(count), *rng.dirichlet(np.ones(count), (3, count)).transpose(0, 2, 1)]
        traces, variances = rng.uniform(0, 6, (4, 2, 2)), rng.uniform(0, 1, (4, 2, 2, count))
        widths = np.array([0.0, 0.5, 0.7, 1.0])
        passes = LowPass(widths, tuple(map(sparse.csr_array, spreads)), traces, variances)
        force, noise = rng.normal(0, 1, (count, 3)), MotionNoise(0.7, 0.4)
        found = passes.applied(force, noise)
        per_unit = np.array([0.49, 0.16])
        risk = np.array(
            [
                [
                    ((force - spread @ force)[:, part] ** 2).sum() + 2 * traces[k, p] @ per_unit
                    for p, part in enumerate((slice(0, 2), slice(2, 3)))
                ]
                for k, spread in enumerate(spreads)
            ]
        )
        tried = 1
        while tried < 4 and (risk[tried] < risk[:tried].min(axis=0)).any():
            tried += 1
        best = risk[:tried].argmin(axis=0)
        np.testing.assert_allclose(found.force_n[:, :2], (spreads[best[0]] @ force)[:, :2])
        np.testing.assert_allclose(found.force_n[:, 2], (spreads[best[1]] @ force)[:, 2])
        np.testing.assert_array_equal(found.width_mm, widths[best])
        for p in range(2):
            np.testing.assert_allclose(
                found.sigma_n[:, p] ** 2, per_unit @ variances[best[p], p], rtol=1e-12
            )
