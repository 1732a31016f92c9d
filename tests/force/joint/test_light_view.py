"""What a frame's bins tell of their own noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import uniform_filter

from gelslim_force.contact.shading_change import ShadingChange
from gelslim_force.joint.light_view import independent_noise

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
