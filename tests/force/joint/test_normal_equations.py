"""The normal equations against dense least squares with every unknown written out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from gelslim_force.joint.light.sums import LightSums
from gelslim_force.joint.normal_equations import NormalEquations, huber
from gelslim_force.joint.settings import JointSettings

Array = NDArray[np.float64]
NODES, MARKERS, HEIGHTS, BINS = 4, 30, 9, 60
GAIN = 0.15, 0.2


def light_sums(
    slopes: Array, residual: Array, weight: Array, by_gain: Array, gain: float = 1.0
) -> LightSums:
    """The sums over rows (n, m), written out."""
    weighted = slopes.T * weight
    return LightSums(
        np.arange(slopes.shape[1]),
        weighted @ slopes,
        weighted @ residual,
        weighted @ by_gain,
        float(weight @ by_gain**2),
        float(weight @ (by_gain * residual)),
        float(weight @ residual**2),
        float(weight @ residual**2),
        0.0,
        gain,
    )


def problem(seed: int) -> tuple[NormalEquations, Array, Array]:
    """Equations of random data, and the same as rows A (n, 3p + 1) and values with unit weight."""
    rng = np.random.default_rng(seed)
    rows, values = rng.normal(size=(MARKERS, 3 * NODES)), rng.normal(size=MARKERS)
    slopes = rng.normal(size=(BINS, HEIGHTS)) * (rng.random((BINS, HEIGHTS)) < 0.5)
    heights, light = rng.normal(size=(HEIGHTS, 3 * NODES)), rng.normal(size=BINS)
    weights = rng.random(MARKERS) + 0.5, rng.random(BINS) + 0.5
    by_gain = rng.normal(size=BINS)
    equations = (
        NormalEquations.of(3 * NODES)
        .with_rows(rows, values, weights[0])
        .with_light(light_sums(slopes, light, weights[1], by_gain), heights, GAIN)
    )
    blocks = [
        np.column_stack([rows, np.zeros(MARKERS)]) * np.sqrt(weights[0])[:, None],
        np.column_stack([slopes @ heights, by_gain]) * np.sqrt(weights[1])[:, None],
        np.eye(3 * NODES + 1)[-1:] / GAIN[1],
    ]
    right = [values * np.sqrt(weights[0]), light * np.sqrt(weights[1]), [GAIN[0] / GAIN[1]]]
    return equations, np.concatenate(blocks), np.concatenate(right)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_eliminated_gain_is_that_of_least_squares(seed: int) -> None:
    equations, rows, values = problem(seed)
    whole = np.linalg.lstsq(rows, values)[0]
    found = np.linalg.solve(equations.hessian, -equations.slope)
    np.testing.assert_allclose(found, whole[:-1], rtol=1e-9, atol=1e-12)


def test_the_covariance_is_that_of_least_squares_without_free_nodes() -> None:
    equations, rows, _ = problem(2)
    force = np.tile([0.1, 0.0, -1.0], NODES)
    force[5] = 0.0
    kept = np.delete(np.arange(3 * NODES + 1), [3, 4, 5])
    inverse = np.linalg.inv(rows[:, kept].T @ rows[:, kept])[:-1, :-1]
    sums = np.random.default_rng(4).normal(size=(6, 3 * NODES))
    expected = sums[:, kept[:-1]] @ inverse @ sums[:, kept[:-1]].T
    free = np.repeat(force[2::3] < 0, 3)
    np.testing.assert_allclose(equations.spread_of(sums, free) @ sums.T, expected, rtol=1e-9)
    assert not equations.spread_of(sums, np.zeros(3 * NODES, dtype=bool)).any()


def test_forces_are_the_least_in_the_cone() -> None:
    equations, _, _ = problem(3)
    found = equations.solved(np.zeros(3 * NODES), 0.7)
    assert (found[2::3] <= 0).all()
    assert (np.hypot(found[0::3], found[1::3]) <= -0.7 * found[2::3] + 1e-6).all()

    def cost(f: Array) -> float:
        return float(f @ equations.hessian @ f / 2 + equations.slope @ f)

    cones = [
        {"type": "ineq", "fun": lambda f, k=k: -0.7 * f[k + 2] - np.hypot(f[k], f[k + 1])}
        for k in range(0, 3 * NODES, 3)
    ]
    start = np.tile([0.0, 0.0, -0.1], NODES)
    least = minimize(cost, start, constraints=cones, method="SLSQP", options={"ftol": 1e-12})
    assert cost(found) <= least.fun + 1e-3 * abs(least.fun)


def test_the_prior_is_written_out() -> None:
    line = np.diag(np.ones(NODES - 1), 1)
    area = np.array([0.5, 1.0, 1.0, 0.5])
    force = np.random.default_rng(6).normal(size=(NODES, 3))
    made = NormalEquations.of(3 * NODES).with_prior(
        force.ravel(), line + line.T, area, 0.1, 2.0, 0.3
    )
    traction = force / area[:, None]
    expected = ((np.diff(traction, axis=0) / 0.1) ** 2).sum()
    expected += ((traction / [0.3, 0.3, 2.0]) ** 2).sum()
    assert force.ravel() @ made.hessian @ force.ravel() == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(made.slope, made.hessian @ force.ravel(), rtol=1e-12)


def test_huber_weights() -> None:
    weights = huber(np.array([0.0, 0.2, -1.0]), np.full(3, 0.1), 5.0)
    np.testing.assert_allclose(weights, [100.0, 100.0, 50.0])


@pytest.mark.parametrize(
    "wrong",
    [
        {"friction": 0.0},
        {"gamma": -1.0},
        {"least_pressure": 1.0},
        {"rounds": (0, 1)},
    ],
)
def test_impossible_settings(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        JointSettings(**wrong)  # type: ignore[arg-type]
