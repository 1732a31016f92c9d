"""Newton's method within limits, against a slow reference and against covariances of numpy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ifem_export.inverse.contact_fit_kernel import descend_within, project_within
from ifem_export.inverse.newton_within import newton_within

Array = NDArray[np.float64]
NORMAL, PAIRS = 30, 12


def problem(seed: int, condition: float = 1e3) -> tuple[Array, Array, Array, Array]:
    """Hessian, slope at the start, start and limits of random forces, some of which must stay 0."""
    rng = np.random.default_rng(seed)
    size = NORMAL + 2 * PAIRS
    turn, _ = np.linalg.qr(rng.normal(size=(size, size)))
    gram = (turn * np.geomspace(1.0, condition, size)) @ turn.T
    wanted = np.concatenate([rng.normal(-0.5, 1.0, NORMAL), rng.normal(0, 1.0, 2 * PAIRS)])
    start = np.concatenate([-rng.uniform(0, 1, NORMAL), 0.3 * rng.normal(size=2 * PAIRS)])
    limit = rng.uniform(0.2, 1.5, PAIRS) * (rng.random(PAIRS) > 0.2)
    return gram, gram @ (start - wanted), start, limit


def reference(gram: Array, slope: Array, start: Array, limit: Array) -> Array:
    """By many accelerated steps along the gradient."""
    force = start.copy()
    step = 0.9 / np.linalg.eigvalsh(gram)[-1]
    change, _ = descend_within(gram, slope, force, limit, step, 1e-13, 200_000)
    assert change < 1e-12
    return force


@pytest.mark.parametrize("seed", range(12))
def test_the_least_energy_is_found_in_a_few_steps(seed: int) -> None:
    gram, slope, start, limit = problem(seed)
    force = start.copy()
    steps, free = newton_within(gram, slope, force, limit, 1e-6, 40)
    assert steps < 40
    assert free is not None
    np.testing.assert_allclose(force, reference(gram, slope, start, limit), atol=1e-7)


def test_limits_are_kept_after_any_number_of_steps() -> None:
    gram, slope, start, limit = problem(3)
    for most in (1, 2, 3):
        force = start.copy()
        newton_within(gram, slope, force, limit, 1e-9, most)
        within = force.copy()
        project_within(within, limit)
        np.testing.assert_allclose(force, within, atol=1e-12)


def test_energy_falls_with_every_step_from_bad_starts() -> None:
    gram, slope, start, limit = problem(5, condition=1e5)
    energies = []
    for most in range(1, 12):
        force = start.copy()
        newton_within(gram, slope, force, limit, 1e-12, most)
        change = force - start
        energies.append(slope @ change + change @ gram @ change / 2)
    assert (np.diff(energies) <= 1e-9 * abs(energies[-1])).all()


def test_without_limits_one_step_is_exact() -> None:
    gram, slope, start, _ = problem(7)
    start[:NORMAL] -= 9.0
    force = start.copy()
    steps, free = newton_within(gram, slope, force, np.full(PAIRS, 1e6), 1e-6, 5)
    assert steps == 2
    assert free is not None
    exact = start - np.linalg.solve(gram, slope)
    assert (exact[:NORMAL] < 0).all()
    np.testing.assert_allclose(force, exact, atol=1e-9)
    sums = np.random.default_rng(1).normal(size=(3, len(start)))
    np.testing.assert_allclose(free.spread_of(sums), sums @ np.linalg.inv(gram), rtol=1e-7)


def test_the_covariance_is_that_of_small_changes_of_the_data() -> None:
    """Forces at a limit vary along it: the change of the solution with the slope is -covariance."""
    gram, slope, start, limit = problem(9)
    force = start.copy()
    _, free = newton_within(gram, slope, force, limit, 1e-9, 60)
    assert free is not None
    size, step = len(start), 1e-5
    unit = np.random.default_rng(2).normal(size=size)
    moved = []
    for sign in (1, -1):
        other = force.copy()
        gradient = slope + gram @ (force - start) + sign * step * unit
        newton_within(gram, gradient, other, limit, 1e-10, 60)
        moved.append(other)
    by_difference = (moved[0] - moved[1]) / (2 * step)
    covariance = free.spread_of(np.eye(size))
    np.testing.assert_allclose(covariance @ unit, -by_difference, atol=2e-4)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)


def test_single_precision_is_enough() -> None:
    gram, slope, start, limit = problem(11, condition=1e4)
    exact = reference(gram, slope, start, limit)
    single = start.astype(np.float32)
    given = gram.astype(np.float32), slope.astype(np.float32)
    _, free = newton_within(*given, single, limit.astype(np.float32), 1e-3, 40)
    assert free is not None
    np.testing.assert_allclose(single, exact, atol=2e-3)


def test_nothing_that_may_vary_stays() -> None:
    gram = np.eye(6)
    force = np.zeros(6)
    _, free = newton_within(gram, np.full(6, -1.0), force, np.zeros(2), 1e-6, 4)
    assert free is None
    assert not force.any()
