"""Noise of known level and correlation, on light that varies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from gelslim_twin.appearance.noise_fit import FittedNoise, fit_noise

NONE = np.zeros((360, 480), dtype=bool)


def picture(seed: int, gamma: float, grain_px: float) -> np.ndarray:
    """Variance 1.5² + v / 40 in linear light v."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:360, :480]
    linear = np.stack([30 + 0.2 * x + 0.06 * y, 150 - 0.2 * x, 80 - 0.1 * x + 0.1 * y], axis=2)
    noise = rng.standard_normal(linear.shape)
    if grain_px:
        noise = gaussian_filter(noise, (grain_px, grain_px, 0))
        noise /= noise.std()
    seen = np.clip(linear + noise * np.sqrt(1.5**2 + linear / 40), 0, 255) / 255
    return np.rint(255 * seen ** (1 / gamma)).astype(np.uint8)


def sigma_at(found: FittedNoise, light: float) -> float:
    return float(np.sqrt(found.read_dn**2 + light / found.electrons_per_dn))


@pytest.mark.parametrize(("gamma", "grain_px"), [(1.8, 0.0), (1.0, 0.7)])
def test_noise_is_found_from_one_picture_and_from_two(gamma: float, grain_px: float) -> None:
    one, two = (picture(seed, gamma, grain_px) for seed in (1, 2))
    single = fit_noise(one, NONE, gamma)
    double = fit_noise(one, NONE, gamma, [(two, NONE)])
    for found in (single, double):
        for light in (40.0, 100.0, 150.0):
            assert sigma_at(found, light) == pytest.approx(np.sqrt(2.25 + light / 40), rel=0.06)
        assert found.grain_px == pytest.approx(grain_px, abs=0.12)


def test_texture_is_not_noise_where_two_pictures_are_compared() -> None:
    """A texture three times as strong as the noise on the whole gel."""
    texture = 8 * np.random.default_rng(5).standard_normal((360, 480, 1))
    one, two = (
        np.clip(picture(seed, 1.0, 0.0) + texture, 0, 255).astype(np.uint8) for seed in (1, 2)
    )
    found = fit_noise(one, NONE, 1.0, [(two, NONE)])
    assert sigma_at(found, 100.0) == pytest.approx(np.sqrt(2.25 + 2.5), rel=0.06)
    assert sigma_at(fit_noise(one, NONE, 1.0), 100.0) > 6


def test_a_press_between_two_pictures_is_left_out() -> None:
    one, two = (picture(seed, 1.0, 0.0) for seed in (1, 2))
    two[100:220, 150:300] = np.clip(two[100:220, 150:300] * 1.2 + 9, 0, 255).astype(np.uint8)
    found = fit_noise(one, NONE, 1.0, [(two, NONE)])
    assert sigma_at(found, 100.0) == pytest.approx(np.sqrt(2.25 + 2.5), rel=0.06)


def test_a_picture_full_of_dots_is_refused() -> None:
    with pytest.raises(ValueError, match="too few even places"):
        fit_noise(picture(1, 1.0, 0.0), ~NONE, 1.0)
