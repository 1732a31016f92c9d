"""The noise of markers and of a depth map, estimated in a frame, against noise that is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from gelslim_force.forces.estimator import curvature_operator
from gelslim_force.forces.low_pass import normal_noise_mm
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.marker_noise import noise_px, robust_sigma
from ifem_export.mesh.surface_lattice import neighbour_matrix

ROWS, COLUMNS = 40, 55
SITES = np.stack(np.mgrid[:ROWS, :COLUMNS], axis=-1).reshape(-1, 2)
LATTICE = ReferenceLattice(
    sites=SITES, positions_px=SITES[:, ::-1] * [11.0, 14.0], markers=np.arange(len(SITES))
)


def test_marker_noise_is_the_one_that_was_added() -> None:
    """Within 2 %: the difference of a marker from its neighbours' mean is 12 % noisier than it."""
    rng = np.random.default_rng(3)
    found = [noise_px(LATTICE, rng.normal(0, 0.2, (len(SITES), 2))) for _ in range(10)]
    assert np.mean(found) == pytest.approx(0.2, rel=0.02)


def test_a_smooth_motion_and_a_contact_are_not_noise() -> None:
    rng = np.random.default_rng(4)
    off = (SITES - [20.0, 25.0]) / 4.0
    contact = 3.0 * off * np.exp(-(off**2).sum(axis=1) / 2)[:, None]
    drift = 0.05 * SITES[:, ::-1]
    noise = rng.normal(0, 0.2, (len(SITES), 2))
    lost = rng.random(len(SITES)) < 0.05
    noise[lost] = np.nan
    assert noise_px(LATTICE, contact + drift + noise) == pytest.approx(0.2, rel=0.1)


def test_too_few_markers_give_no_noise() -> None:
    small = ReferenceLattice(
        sites=SITES[:9], positions_px=LATTICE.positions_px[:9], markers=np.arange(9)
    )
    assert noise_px(small, np.ones((9, 2))) == 0.0
    assert robust_sigma(np.ones(7)) == 0.0


def test_normal_noise_is_the_one_that_was_added() -> None:
    """On cells that are not square, around a dent that curves the surface."""
    cell_mm = np.array([0.5, 0.7])
    nodes = SITES[:, ::-1] * cell_mm
    bend = curvature_operator(neighbour_matrix(nodes, cell_mm))
    assert bend.shape == ((ROWS - 2) * (COLUMNS - 2), len(nodes))
    assert (bend**2).sum(axis=1) == pytest.approx(1.25)
    rng = np.random.default_rng(5)
    found = [normal_noise_mm(bend, rng.normal(0, 0.01, len(nodes))) for _ in range(20)]
    assert np.mean(found) == pytest.approx(0.01, rel=0.02)
    dent = -0.3 * np.exp(-((nodes - [14.0, 12.0]) ** 2).sum(axis=1) / 8)
    assert normal_noise_mm(bend, dent + rng.normal(0, 0.01, len(nodes))) == pytest.approx(
        0.01, rel=0.1
    )


def test_sigma_is_the_lower_quartile_over_that_of_a_normal_variable() -> None:
    values = np.random.default_rng(7).normal(0, 1, (9, 2))
    quartile = np.quantile(np.abs(values), 0.25)
    # A normal variable is within 0.31864 sigma in a quarter of the cases.
    assert robust_sigma(values) == pytest.approx(quartile / norm.ppf(0.625), rel=1e-4)
    assert robust_sigma(values[:8]) > 0
    assert robust_sigma(values[:7]) == 0


def test_noise_is_that_of_markers_whose_four_neighbours_are_seen() -> None:
    moved = np.random.default_rng(8).normal(0, 0.3, (len(SITES), 2))
    moved[[3, 400, 777]] = np.nan
    grid = moved.reshape(ROWS, COLUMNS, 2)
    around = (grid[:-2, 1:-1] + grid[2:, 1:-1] + grid[1:-1, :-2] + grid[1:-1, 2:]) / 4
    off = (grid[1:-1, 1:-1] - around).reshape(-1, 2)
    off = off[np.isfinite(off).all(axis=1)]
    expected = np.quantile(np.abs(off), 0.25) / norm.ppf(0.625) / np.sqrt(1.25)
    assert noise_px(LATTICE, moved) == pytest.approx(expected, rel=1e-4)
