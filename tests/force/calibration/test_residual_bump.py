"""Shared motion of neighbours told from noise, and turned pictures from upright ones."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import grid_of_dots

from gelslim_force.calibration.checks import picture_turn
from gelslim_force.calibration.residual_bump import split_residuals

GRID = grid_of_dots()
AT = GRID.positions_mm


@pytest.mark.slow
def test_noise_alone_is_hardly_ever_a_bump():
    rng = np.random.default_rng(0)
    fields = [split_residuals(AT, rng.normal(size=AT.shape) * 0.01, 1.1) for _ in range(60)]
    assert max(f.bump.sigmas for f in fields) < 6.0
    assert not any(f.bump.significant for f in fields)
    # Rayleigh: the largest of some hundred independent medians lies near sqrt(2 ln 500) = 3.5.
    assert 2.8 < np.median([f.bump.sigmas for f in fields]) < 4.3
    assert np.mean([f.own_mm for f in fields]) == pytest.approx(0.01, rel=0.05)
    assert np.mean([f.shared_mm for f in fields]) < 0.0025


def test_a_local_shift_is_found_where_it_is():
    rng = np.random.default_rng(1)
    off = rng.normal(size=AT.shape) * 0.01
    near = np.hypot(*(AT - [3.3, -2.0]).T) < 2.5
    off[near] += [0.03, -0.02]
    bump = split_residuals(AT, off, 1.1).bump
    assert bump.local
    assert np.hypot(bump.x_mm - 3.3, bump.y_mm + 2.0) < 2.0
    assert bump.shift_mm == pytest.approx(0.036, abs=0.01)


def test_single_strays_are_no_bump_and_a_common_wave_is_not_local():
    rng = np.random.default_rng(2)
    off = rng.normal(size=AT.shape) * 0.01
    off[::29] += 0.7
    assert not split_residuals(AT, off, 1.1).bump.significant
    wave = off + 0.05 * np.sin(AT / 2.0)
    found = split_residuals(AT, wave, 1.1)
    assert found.bump.significant
    assert not found.bump.local
    assert found.shared_mm > 0.03


def test_few_dots_have_no_neighbourhood():
    assert split_residuals(AT[:3], np.zeros((3, 2)), 1.1).bump is None
    with pytest.raises(ValueError, match="positions"):
        split_residuals(AT, np.zeros((3, 2)), 1.1)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ([[1, 0], [0, 1]], ""),
        ([[-1, 0], [0, 1]], "mirrored left to right"),
        ([[1, 0], [0, -1]], "mirrored top to bottom"),
        ([[-1, 0], [0, -1]], "turned by 180°"),
        ([[0, -1], [1, 0]], "turned by 90° clockwise"),
        ([[0, 1], [-1, 0]], "turned by 90° anticlockwise"),
        ([[0, 1], [1, 0]], "transposed"),
    ],
)
def test_turns_and_mirror_images_are_named(matrix, words):
    rng = np.random.default_rng(3)
    expected = rng.uniform(0, 500, (50, 2))
    small = np.array([[0.95, -0.2], [0.15, 1.1]])
    seen = expected @ small.T @ np.array(matrix).T + [40, 7] + rng.normal(size=(50, 2))
    assert picture_turn(expected, seen) == words


def test_clockwise_is_as_the_picture_is_looked_at():
    """The top left corner of a picture that is turned clockwise is at the top right."""
    corners = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]])
    turned = np.array([[100.0, 0.0], [100.0, 100.0], [0.0, 0.0]])
    assert picture_turn(corners, turned) == "turned by 90° clockwise"
