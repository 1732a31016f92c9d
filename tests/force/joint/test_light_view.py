"""What a frame's bins tell of their own noise, and of contacts in it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import uniform_filter

from gelslim_force.contact.shading_change import ShadingChange
from gelslim_force.joint.light.view import independent_noise
from gelslim_force.joint.region import changed_bins

SHAPE = 2, 120, 160


def shading(noise: np.ndarray) -> ShadingChange:
    level = np.full(SHAPE, noise.std())
    return ShadingChange(noise, np.ones(SHAPE[1:], dtype=bool), level)


def test_white_noise_is_independent_also_around_a_contact() -> None:
    rng = np.random.default_rng(3)
    change = rng.normal(0, 0.01, SHAPE)
    change[:, 40:70, 50:90] += 0.1
    found = ShadingChange(change, np.ones(SHAPE[1:], dtype=bool), np.full(SHAPE, 0.01))
    assert independent_noise(found) == pytest.approx(1.0, abs=0.06)
    assert independent_noise(shading(np.zeros(SHAPE))) == 1.0


@pytest.mark.parametrize(("width", "common"), [(2, 1 / 2), (3, 2 / 3)])
def test_a_mean_over_bins_leaves_neighbours_their_common_part(width: int, common: float) -> None:
    """Means over `width` bins in a row have the correlation 1 - 1/width with the next."""
    rng = np.random.default_rng(4)
    noise = uniform_filter(rng.normal(0, 0.01, SHAPE), (1, 1, width))
    assert independent_noise(shading(noise)) == pytest.approx(1 - common, abs=0.08)


def coarse(noise: float, grain: float, change: np.ndarray | None = None) -> ShadingChange:
    """Bins whose errors 4 x 4 share: `noise` is that of single bins times `grain`."""
    if change is None:
        rng = np.random.default_rng(5)
        few = rng.normal(0, noise / grain, (SHAPE[0], SHAPE[1] // 4, SHAPE[2] // 4))
        change = few.repeat(4, axis=1).repeat(4, axis=2)
    valid, factors = np.ones(SHAPE[1:], dtype=bool), np.full(SHAPE[0], grain)
    return ShadingChange(change, valid, np.full(SHAPE, noise), grain=factors)


def test_noise_of_blocks_is_no_independent_noise_of_their_size() -> None:
    """Of a noise made larger by its grain, at most the part of single bins is taken off."""
    assert independent_noise(coarse(0.04, 4.0)) < 1.1 * (1 - 3 / 4) / 4**2
    white = np.random.default_rng(6).normal(0, 0.01, SHAPE)
    assert independent_noise(coarse(0.02, 2.0, white)) == pytest.approx(1 / 4, abs=0.02)


def test_a_contact_is_found_among_errors_of_blocks_and_they_are_none() -> None:
    shared = coarse(0.08, 4.0).change
    y, x = np.mgrid[: SHAPE[1], : SHAPE[2]]
    inside = np.hypot(x - 80, y - 60) < 14
    dent = np.where(inside, 0.08 * np.sign(x - 80), 0.0)
    assert changed_bins(coarse(0.02, 1.0, shared)).any()
    assert not changed_bins(coarse(0.08, 4.0, shared)).any()
    pressed = changed_bins(coarse(0.08, 4.0, shared + dent))
    assert pressed[inside].mean() > 0.9
    assert pressed[~inside].mean() < 0.02


def test_contacts_are_fainter_among_errors_that_bins_share() -> None:
    assert shading(np.random.default_rng(7).normal(0, 0.05, SHAPE)).faint == 1.0
    assert coarse(0.015, 1.5).faint == 1.0
    assert coarse(0.04, 2.0).faint == pytest.approx(2.0)
    assert coarse(0.02, 200.0).faint == np.inf
    assert coarse(0.004, 20.0).faint == 1.0
