"""Sums over the light against rows that are written out, and the gain against least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_force.joint.kernels.light_kernel import saturated_bins
from gelslim_force.joint.light.sums import PlacedBins
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_optics.light.light_law import LightLaw

Array = NDArray[np.float64]
BINS, STEP = 40, 1e-6
LAW = LightLaw(np.array([[0.0, 2.0], [0.3, -1.8]]))


def lattice() -> NodeLattice:
    axis = np.arange(8) * 0.5
    nodes = np.column_stack([a.ravel() for a in np.meshgrid(axis, axis, indexing="ij")])
    return NodeLattice.of(nodes, np.full(2, 0.5))


def bins(seed: int) -> PlacedBins:
    rng = np.random.default_rng(seed)
    share = rng.uniform(0.2, 1.0, (2, 2, BINS))
    return PlacedBins(
        lattice().slopes_at(rng.uniform(0.6, 2.9, (BINS, 2))),
        rng.normal(0, 0.1, (2, BINS)),
        rng.uniform(0.01, 0.02, (2, BINS)),
        np.zeros((2, BINS), dtype=bool),
        share / share.sum(axis=0),
        rng.uniform(0.9, 1.0, (2, BINS)),
        rng.uniform(0.01, 0.02, BINS),
        LAW,
    )


def change(found: PlacedBins, height_mm: Array, gain: float) -> Array:
    """(2n,) change of the light at given heights."""
    slope = found.taps.slopes(height_mm)
    return LAW.change(slope, found.share, found.level, gain)[0].ravel()


def test_sums_are_those_of_rows_by_differences() -> None:
    found, gain = bins(1), 1.1
    height = np.random.default_rng(2).normal(0, 0.02, 64)
    sums = found.sums(height, gain, 0.05)
    base = change(found, height, gain)
    rows = np.column_stack(
        [(change(found, height + STEP * unit, gain) - base) / STEP for unit in np.eye(64)]
    )[:, sums.nodes]
    by_gain = (change(found, height, gain + STEP) - base) / STEP
    residual = found.change.ravel() - base
    sigma = np.hypot(0.05 / np.sqrt(found.area_mm2), found.noise).ravel()
    assert (np.abs(residual) < 10 * sigma).all()
    weight = sigma**-2
    expected = {
        "matrix": (rows.T * weight) @ rows,
        "pull": rows.T @ (weight * residual),
        "mixed": rows.T @ (weight * by_gain),
        "by_gain": weight @ by_gain**2,
        "gain_pull": weight @ (by_gain * residual),
        "left": weight @ residual**2,
        "seen": weight @ found.change.ravel() ** 2,
        "by_noise": weight @ found.noise.ravel() ** 2,
    }
    for name, value in expected.items():
        scale = np.abs(value).max()
        np.testing.assert_allclose(getattr(sums, name), value, atol=2e-4 * scale, err_msg=name)


def test_calibrated_gains_multiply_that_of_the_frame() -> None:
    plain = bins(9)
    height = np.random.default_rng(2).normal(0, 0.02, 64)
    even = replace(plain, built=np.full((2, BINS), 1.25)).sums(height, 0.8, 0.05)
    same = plain.sums(height, 1.0, 0.05)
    np.testing.assert_allclose(even.matrix, same.matrix, atol=1e-9 * same.matrix.max())
    np.testing.assert_allclose(even.mixed, 1.25 * same.mixed, atol=1e-9 * same.mixed.max())
    assert even.gain_pull == pytest.approx(1.25 * same.gain_pull)


def test_what_is_left_after_a_step_is_that_of_the_rows() -> None:
    found = bins(3)
    sums = found.sums(np.zeros(64), 1.0, 0.05)
    step = np.random.default_rng(4).normal(0, 0.01, len(sums.nodes))
    height = np.zeros(64)
    height[sums.nodes] = step * 1e-3
    weight = (np.hypot(0.05 / np.sqrt(found.area_mm2), found.noise) ** -2).ravel()
    left = found.change.ravel() - change(found, height, 1.0)
    by_noise = weight @ found.noise.ravel() ** 2
    share = (weight @ left**2 - by_noise) / (weight @ found.change.ravel() ** 2 - by_noise)
    assert sums.unexplained(step * 1e-3) == pytest.approx(share, rel=1e-5)


def test_noise_is_nothing_that_forces_have_to_explain() -> None:
    height = np.random.default_rng(5).normal(0, 0.02, 64)
    plain = bins(10)
    noise = np.random.default_rng(11).normal(size=(2, BINS)) * 0.15
    drawn = change(plain, height, 1.0).reshape(2, -1) + noise
    known, unknown = (
        replace(plain, change=drawn, noise=np.full((2, BINS), size)).sums(height, 1.0, 0.01)
        for size in (0.15, 0.01)
    )
    still = np.zeros(len(known.nodes))
    assert known.unexplained(still) < 0.15
    alike = replace(plain, change=drawn, noise=np.full((2, BINS), 0.15), independent=0.2)
    assert alike.sums(height, 1.0, 0.01).unexplained(still) > 0.4
    assert unknown.unexplained(still) > 0.4


def test_the_gain_of_drawn_changes_is_found() -> None:
    height = np.random.default_rng(5).normal(0, 0.05, 64)
    drawn = bins(6)
    drawn = replace(drawn, change=change(drawn, height, 1.3).reshape(2, -1))
    gain = 1.0
    for _ in range(4):
        sums = drawn.sums(height, gain, 0.01)
        gain = sums.gain_after(np.zeros(len(sums.nodes)), 10.0)
    assert gain == pytest.approx(1.3, abs=2e-3)


def test_light_that_saturates_does_not_pull_a_brighter_model_down() -> None:
    found = replace(bins(7), saturated=np.ones((2, BINS), dtype=bool))
    dark = replace(found, change=np.full((2, BINS), -1.0))
    assert dark.sums(np.zeros(64), 1.0, 0.05).left == 0.0
    bright = replace(found, change=np.full((2, BINS), 0.5))
    assert bright.sums(np.zeros(64), 1.0, 0.05).left > 0.0


def test_saturated_bins_are_those_with_a_bright_pixel() -> None:
    rng = np.random.default_rng(8)
    image = rng.integers(0, 256, (26, 35, 3), dtype=np.uint8)
    image[rng.random(image.shape) < 0.9] = 10
    found = np.zeros((2, 6, 8), dtype=bool)
    saturated_bins(image, np.array([0, 2]), 4, 250, found)
    cut = image[:24, :32][..., [0, 2]].reshape(6, 4, 8, 4, 2)
    expected = np.moveaxis(cut.max(axis=(1, 3)), -1, 0) >= 250
    np.testing.assert_array_equal(found, expected)
