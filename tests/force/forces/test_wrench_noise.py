"""The covariance of a wrench and its resultant, entry by entry, for numbers without structure."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.forces.wrench import WrenchNoise, resultant, rigid_motions

NODES, MARKERS = 7, 4
RNG = np.random.default_rng(3)
POINTS = RNG.uniform(-5, 5, (NODES, 3))


class Linear:
    """A symmetric stiffness without any other structure."""

    def __init__(self) -> None:
        half = RNG.normal(size=(3 * NODES, 3 * NODES))
        self.matrix = half @ half.T

    def force(self, motion: np.ndarray) -> np.ndarray:
        return (self.matrix @ np.ravel(motion)).reshape(-1, 3)


class Interpolation:
    """From lateral motions of markers to nodes."""

    weights = RNG.uniform(0, 1, (NODES, MARKERS))

    def transposed(self, values: np.ndarray) -> np.ndarray:
        return self.weights.T @ values


def test_resultant_is_the_sum_of_forces_and_torques() -> None:
    force = RNG.normal(size=(NODES, 3))
    found = resultant(POINTS, force)
    torque = np.zeros(3)
    for (x, y, z), (fx, fy, fz) in zip(POINTS, force, strict=True):
        torque += [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx]
    np.testing.assert_allclose(found[0], force.sum(axis=0))
    np.testing.assert_allclose(found[1], torque)
    turned = rigid_motions(POINTS)
    np.testing.assert_allclose(turned[:3].sum(axis=1), NODES * np.eye(3))
    for motion, axis in zip(turned[3:], np.eye(3), strict=True):
        np.testing.assert_allclose(motion, [np.cross(axis, p) for p in POINTS])


def test_covariance_is_the_sum_over_markers_and_correlated_errors() -> None:
    operator, interpolation = Linear(), Interpolation()
    noise = WrenchNoise.of(operator, POINTS)  # type: ignore[arg-type]
    gains = noise.gains(interpolation)  # type: ignore[arg-type]
    assert gains.shape == (6, MARKERS, 2)

    def wrench_of(motion: np.ndarray) -> np.ndarray:
        return np.concatenate(resultant(POINTS, operator.force(motion)))

    each = np.empty((6, MARKERS, 2))
    for marker in range(MARKERS):
        for axis in range(2):
            motion = np.zeros((NODES, 3))
            motion[:, axis] = interpolation.weights[:, marker]
            each[:, marker, axis] = wrench_of(motion)
    np.testing.assert_allclose(gains, each, rtol=1e-9)

    sigma = RNG.uniform(0, 1, MARKERS)
    expected = sum(sigma[k] ** 2 * each[:, k] @ each[:, k].T for k in range(MARKERS))
    np.testing.assert_allclose(noise.covariance(gains, sigma), expected, rtol=1e-9)

    deep, aside = RNG.uniform(0, 1, NODES), RNG.uniform(0, 1, (MARKERS, 2))
    sunk = wrench_of(np.column_stack([np.zeros((NODES, 2)), deep]))
    shifted = sum(each[:, k, i] * aside[k, i] for k in range(MARKERS) for i in range(2))
    np.testing.assert_allclose(
        noise.covariance(gains, sigma, [noise.by_error(gains, deep, aside)]),
        expected + np.outer(sunk + shifted, sunk + shifted),
        rtol=1e-9,
    )


def test_an_unknown_normal_motion_leaves_three_components() -> None:
    noise = WrenchNoise(POINTS, np.zeros((6, NODES, 3)))
    force = RNG.normal(size=(NODES, 3))
    covariance = np.arange(36.0).reshape(6, 6) + np.diag([100.0] * 6)
    whole = noise.wrench(force, covariance)
    np.testing.assert_allclose(whole.vector, np.concatenate(resultant(POINTS, force)))
    np.testing.assert_array_equal(whole.covariance, covariance)
    np.testing.assert_allclose(whole.standard_deviation**2, np.diag(covariance))

    blind = force.copy()
    blind[:, 2] = np.nan
    found = noise.wrench(blind, covariance)
    flat = np.concatenate(resultant(POINTS, force * [1, 1, 0]))
    assert found.vector[[0, 1, 5]] == pytest.approx(flat[[0, 1, 5]])
    unknown = np.isnan(found.covariance)
    for i in range(6):
        for j in range(6):
            assert unknown[i, j] == (i in (2, 3, 4) or j in (2, 3, 4))
    # What the caller holds stays as it is.
    assert np.isfinite(covariance).all()
    assert np.isnan(blind[:, 2]).all()
