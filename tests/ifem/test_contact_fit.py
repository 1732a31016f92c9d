"""Fits of contact forces on small dense problems, against the algorithm's definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.inverse.contact_fit_kernel import descend, largest_eigenvalue, project
from ifem_export.inverse.contact_inverse import GOLDEN, MARGIN, masked_force, smoothing
from ifem_export.operators.convolved_operator import ComplianceProducts
from ifem_export.operators.layered_operator import layered_operator, surface_compliance

START = np.array([0.3, 0.2, -1.0])


class Dense:
    """An operator that knows its compliance matrix (3c, 3c)."""

    def __init__(self, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        points = rng.uniform(-2.0, 2.0, (count, 2))
        near = np.exp(-cdist(points, points))
        axes = np.array([[1.0, 0.1, -0.2], [0.1, 1.3, 0.15], [-0.2, 0.15, 0.8]])
        self.matrix = np.kron(near, axes)
        self.calls = 0

    def displacement(self, force: np.ndarray) -> np.ndarray:
        self.calls += 1
        return (self.matrix @ force.reshape(-1)).reshape(-1, 3)


def nearest(force: np.ndarray, friction: float) -> np.ndarray:
    """Projection (n, 3) onto the cones, by the two rays in the plane of the normal and force."""
    found = np.zeros_like(force)
    for k, (x, y, z) in enumerate(force):
        side = np.hypot(x, y)
        if np.isinf(friction):
            found[k] = (x, y, min(z, 0.0))
        elif side <= -friction * z:
            found[k] = (x, y, z)
        else:
            ray = np.array([friction, -1.0]) / np.hypot(friction, 1.0)
            along = max(ray @ [side, z], 0.0) * ray
            found[k, 2] = along[1]
            if side > 0:
                found[k, :2] = along[0] * np.array([x, y]) / side
    return found


def gradients(slope_of, force, friction, step, tolerance, most):
    """Accelerated projected gradients with restart by the slope (O'Donoghue and Candès 2015)."""
    ahead, theta, steps, change = force.copy(), 1.0, 0, np.inf
    while steps < most and change > tolerance:
        moved = nearest(ahead - step * slope_of(ahead), friction)
        if ((ahead - moved) * (moved - force)).sum() > 0:
            theta = 1.0
        following = 0.5 + np.sqrt(0.25 + theta**2)
        size = np.sqrt((moved**2).sum())
        change = np.sqrt(((moved - force) ** 2).sum()) / size if size > 0 else 0.0
        ahead = moved + (theta - 1.0) / following * (moved - force)
        force, theta, steps = moved, following, steps + 1
    return force, change, steps


@pytest.mark.parametrize("friction", [0.0, 0.4, 1.0, 3.0, np.inf])
def test_projection_is_that_onto_the_nearest_ray(friction: float) -> None:
    forces = np.random.default_rng(2).normal(size=(300, 3)) * [1.0, 1.0, 0.7]
    forces[0], forces[1], forces[2] = (0.0, 0.0, 0.5), (0.0, 0.0, -0.5), (1.0, 0.0, 0.0)
    found = forces.reshape(-1).copy()
    project(found, friction)
    expected = nearest(forces, friction)
    assert found.reshape(-1, 3) == pytest.approx(expected, abs=1e-14)
    again = found.copy()
    project(again, friction)
    assert again == pytest.approx(found, abs=1e-14)


@pytest.mark.parametrize("count", [1, 4, 12, 60])
@pytest.mark.parametrize("decay", [0.5, 0.9, 0.99])
def test_the_largest_eigenvalue_is_never_far_below_the_true_one(count: int, decay: float) -> None:
    """A clustered one too; it was 43 % too low for a ball on 16 nodes, whose fit diverged."""
    turn, _ = np.linalg.qr(np.random.default_rng(count).normal(size=(3 * count, 3 * count)))
    values = 2.5 * decay ** np.arange(3.0 * count)
    found = largest_eigenvalue((turn * values) @ turn.T)
    assert 2.5 / MARGIN < found <= 2.5 * (1 + 1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.5, np.inf])
@pytest.mark.parametrize("most", [1, 2, 3, 5, 40, 400])
def test_descent_is_the_accelerated_projected_gradient(friction: float, most: int) -> None:
    compliance = Dense(7, 3).matrix
    gram = compliance @ compliance
    rng = np.random.default_rng(4)
    target = nearest(rng.normal(size=(7, 3)) - [0.0, 0.0, 1.0], friction)
    start = nearest(rng.normal(size=(7, 3)), friction)
    slope = gram @ (start - target).reshape(-1) + 0.3 * rng.normal(size=21)
    step = 0.9 / np.linalg.eigvalsh(gram)[-1]

    def slope_of(force: np.ndarray) -> np.ndarray:
        return (slope + gram @ (force - start).reshape(-1)).reshape(-1, 3)

    found = start.reshape(-1).copy()
    change, steps = descend(gram, slope, found, friction, step, 1e-6, most)
    expected = gradients(slope_of, start, friction, step, 1e-6, most)
    assert steps == expected[2]
    assert change == pytest.approx(expected[1], rel=1e-6)
    assert found.reshape(-1, 3) == pytest.approx(expected[0], abs=1e-9)
    assert (change <= 1e-6) == (most == 400)


def test_a_descent_that_ends_without_force_has_not_changed() -> None:
    force = np.array([0.1, 0.0, -0.2])
    change, steps = descend(np.eye(3), np.array([0.0, 0.0, -9.0]), force, 0.5, 1.0, 1e-3, 9)
    assert (change, steps, force.tolist()) == (0.0, 1, [0.0, 0.0, 0.0])


def ritz_value(square: np.ndarray) -> float:
    """Largest Ritz value of a matrix in the Krylov space of eight vectors from an uneven force."""
    uneven = (np.arange(1, len(square) + 1) * GOLDEN) % 1.0 - 0.5
    space = [np.tile(START, len(square) // 3) + uneven]
    for _ in range(7):
        space.append(square @ space[-1] / np.linalg.norm(space[-1]))
    basis, _ = np.linalg.qr(np.array(space).T)
    return float(np.linalg.eigvalsh(basis.T @ square @ basis)[-1])


@pytest.mark.parametrize("friction", [0.0, 0.6, np.inf])
@pytest.mark.parametrize("most", [1, 4, 30, 3000])
def test_fit_by_an_operator_is_the_accelerated_projected_gradient(
    friction: float, most: int
) -> None:
    operator, rng = Dense(12, 5), np.random.default_rng(6)
    mask = np.arange(12) % 3 != 1
    inside = np.repeat(mask, 3)
    u = operator.displacement(rng.normal(size=(12, 3)) - [0.0, 0.0, 2.0])
    start = rng.normal(size=(12, 3))
    block = operator.matrix[:, inside]
    step = 1.0 / (MARGIN * ritz_value(block.T @ block))

    def slope_of(force: np.ndarray) -> np.ndarray:
        return (block.T @ (block @ force.reshape(-1) - u.reshape(-1))).reshape(-1, 3)

    found = masked_force(
        operator, u, mask, friction=friction, start_n=start, most_steps=most, tolerance=1e-5
    )
    first = nearest(start[mask], friction)
    force, change, steps = gradients(slope_of, first, friction, step, 1e-5, most)
    assert not found.force_n[~mask].any()
    assert found.steps == steps
    assert found.force_n[mask] == pytest.approx(force, abs=1e-8)
    assert found.change == pytest.approx(change, rel=1e-5)
    assert found.converged == (change <= 1e-5) == (most == 3000)
    residual = block @ force.reshape(-1) - u.reshape(-1)
    assert found.misfit == pytest.approx(np.linalg.norm(residual) / np.linalg.norm(u), rel=1e-7)


class Convolved:
    """The surface of a pad whose opposite sides are joined, where the products are exact."""

    def __init__(self) -> None:
        element = hex8_stiffness((0.5, 0.7, 0.4), Material(0.147, 0.4, 1.0), "bbar")
        columns = np.argwhere(np.ones((4, 6), dtype=bool))
        self.compliance = layered_operator(element, 2, columns, (0, 0), surface_compliance)
        self.compliance_products = ComplianceProducts(self.compliance)

    def displacement(self, force: np.ndarray) -> np.ndarray:
        return self.compliance(force[None])[0]


@pytest.mark.parametrize("friction", [0.3, np.inf])
@pytest.mark.parametrize("most", [1, 6, 40, 3000])
def test_fit_by_products_takes_the_slope_anew_in_every_round(friction: float, most: int) -> None:
    operator, rng = Convolved(), np.random.default_rng(8)
    columns = [operator.displacement(e.reshape(-1, 3)).reshape(-1) for e in np.eye(72)]
    mask = np.arange(24) % 5 < 2
    block = np.array(columns).T[:, np.repeat(mask, 3)]
    gram = block.T @ block
    u = operator.displacement(rng.normal(size=(24, 3)) - [0.0, 0.0, 1.0])
    start, tolerance = rng.normal(size=(24, 3)), 1e-5
    step = 1.0 / (MARGIN * largest_eigenvalue(gram))
    found = masked_force(
        operator, u, mask, friction=friction, start_n=start, most_steps=most, tolerance=tolerance
    )
    force, steps = nearest(start[mask], friction), 0
    while True:
        before = force
        slope = block.T @ (block @ before.reshape(-1) - u.reshape(-1))

        def slope_of(force: np.ndarray, slope=slope, before=before) -> np.ndarray:
            return (slope + gram @ (force - before).reshape(-1)).reshape(-1, 3)

        force, change, taken = gradients(slope_of, before, friction, step, tolerance, most - steps)
        steps += taken
        moved = np.linalg.norm(force - before) / np.linalg.norm(force)
        if steps >= most or moved <= 10 * tolerance:
            break
    assert (found.steps, found.converged) == (steps, change <= tolerance)
    assert found.force_n[mask] == pytest.approx(force, abs=1e-6 * np.abs(force).max())
    assert not found.force_n[~mask].any()
    assert found.change == pytest.approx(change, rel=1e-3)
    residual = block @ force.reshape(-1) - u.reshape(-1)
    assert found.misfit == pytest.approx(np.linalg.norm(residual) / np.linalg.norm(u), rel=1e-6)


def test_the_step_size_takes_few_operator_calls() -> None:
    """Two for each of eight Lanczos steps and of the steps of the fit, and one for the misfit."""
    operator, u = Dense(12), np.random.default_rng(1).normal(size=(12, 3))
    masked_force(operator, u, np.ones(12, bool), most_steps=3)
    assert operator.calls == 2 * 8 + 2 * 3 + 1
    single = Dense(1)
    single.matrix = 2.0 * np.eye(3)
    masked_force(single, np.array([[0.1, 0.0, -1.0]]), [True], most_steps=1)
    # A uniform force is an eigenvector here, so that Lanczos ends after its first step.
    assert single.calls == 2 + 2 + 1


def test_smoothing_is_a_gaussian_of_three_widths_with_columns_of_one() -> None:
    points = np.random.default_rng(7).uniform(0.0, 4.0, (60, 3))
    away = cdist(points[:, :2], points[:, :2])
    weights = np.where(away <= 3 * 0.5, np.exp(-0.5 * (away / 0.5) ** 2), 0.0)
    expected = weights / weights.sum(axis=0)
    assert smoothing(points, 0.5).toarray() == pytest.approx(expected, abs=1e-14)
    for width in (0.0, -1.0, np.inf):
        with pytest.raises(IfemError) as caught:
            smoothing(points, width)
        assert (caught.value.field, caught.value.value) == ("width_mm", width)


def test_without_contact_or_motion_there_is_no_force() -> None:
    for contact, motion, misfit in ((False, 0.1, 1.0), (True, 0.0, 0.0), (False, 0.0, 0.0)):
        found = masked_force(Dense(2), np.full((2, 3), motion), [contact, contact])
        assert (found.misfit, found.change, found.steps, found.converged) == (misfit, 0.0, 0, True)
        assert found.force_n.tolist() == [[0.0] * 3] * 2


def test_a_mask_of_two_axes_is_refused() -> None:
    with pytest.raises(IfemError) as caught:
        masked_force(Dense(2), np.zeros((2, 3)), np.ones((2, 1), bool))
    assert caught.value.field == "mask"
