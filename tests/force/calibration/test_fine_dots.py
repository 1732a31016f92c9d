"""Centres measured with little bias where a reference picture has little noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_force.calibration.fine_dots import fine_centres_px
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings

SETTINGS = DetectorSettings(smallest_diameter_px=4.0, largest_diameter_px=12.0)
RADIUS_PX = 3.2
STEP_PX = 20
SUPER = 16


def discs(rng: np.random.Generator, noise: float) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Dark discs at random places within a pixel, integrated over the area of each pixel."""
    sites = np.argwhere(np.ones((12, 14))) * STEP_PX + STEP_PX
    centres = sites + rng.uniform(-0.5, 0.5, sites.shape)
    size = sites.max(axis=0) + STEP_PX
    bright = np.full((size[1], size[0]), 210.0)
    near = np.arange(-6, 7)
    fine = (np.arange(SUPER) + 0.5) / SUPER - 0.5
    x = (near[:, None] + fine).ravel()
    for (column, row), (cx, cy) in zip(sites, centres, strict=True):
        inside = np.hypot(x[None] - (cx - column), x[:, None] - (cy - row)) < RADIUS_PX
        covered = inside.reshape(13, SUPER, 13, SUPER).mean(axis=(1, 3))
        bright[row - 6 : row + 7, column - 6 : column + 7] -= 150 * covered
    noisy = bright + rng.normal(0, noise, bright.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), centres


def error_px(found: NDArray[np.float64], centres: NDArray[np.float64]) -> float:
    away = np.abs(found[:, None] - centres[None]).sum(axis=2)
    return float(np.sqrt(np.mean((found - centres[np.argmin(away, axis=1)]) ** 2)))


@pytest.mark.parametrize(("noise", "share"), [(0.0, 0.3), (2.0, 0.6), (12.0, 1.05)])
def test_centres_are_nearer_to_the_discs(noise: float, share: float) -> None:
    """Without noise the bias goes; with much noise the centres are those of tracking."""
    image, centres = discs(np.random.default_rng(5), noise)
    dots = Detector(SETTINGS).detect(image)
    assert len(dots) == len(centres)
    fine = fine_centres_px(image, dots, SETTINGS)
    assert error_px(fine, centres) < share * error_px(dots.centres_px, centres)


def test_glare_beside_a_dot_does_not_move_it() -> None:
    """Dirt that the share of tracking leaves out."""
    image, centres = discs(np.random.default_rng(6), 0.0)
    column, row = np.rint(centres[0]).astype(int)
    image[row - 3 : row + 4, column + 5] = 180
    dots = Detector(SETTINGS).detect(image)
    fine = fine_centres_px(image, dots, SETTINGS)
    first = int(np.argmin(np.hypot(*(dots.centres_px - centres[0]).T)))
    assert np.array_equal(fine[first], dots.centres_px[first])
    assert not np.array_equal(fine, dots.centres_px)
