"""Structural similarity against a plain sum over the window, and its closed form for noise."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_twin.appearance.similarity import profile_error_dn, similarity, similarity_map


def similarity_at(one: np.ndarray, other: np.ndarray, y: int, x: int) -> float:
    """The definition for one pixel of one channel, with a window of 11 x 11."""
    away = np.arange(-5, 6)
    weight = np.exp(-(away[:, None] ** 2 + away[None] ** 2) / (2 * 1.5**2))
    weight /= weight.sum()
    a, b = (v[y - 5 : y + 6, x - 5 : x + 6].astype(float) for v in (one, other))
    mean_a, mean_b = (weight * a).sum(), (weight * b).sum()
    own_a, own_b = (weight * (a - mean_a) ** 2).sum(), (weight * (b - mean_b) ** 2).sum()
    common = (weight * (a - mean_a) * (b - mean_b)).sum()
    first, second = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return float(
        (2 * mean_a * mean_b + first)
        * (2 * common + second)
        / ((mean_a**2 + mean_b**2 + first) * (own_a + own_b + second))
    )


def pictures(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    one = rng.integers(0, 256, (40, 50, 3), dtype=np.uint8)
    mixed = 0.7 * one + 0.3 * rng.integers(0, 256, one.shape)
    return one, mixed.astype(np.uint8)


def test_it_is_the_sum_of_the_definition() -> None:
    one, other = pictures(1)
    found = similarity_map(one, other)
    for y, x in ((10, 12), (25, 40), (30, 8)):
        expected = np.mean([similarity_at(one[..., c], other[..., c], y, x) for c in range(3)])
        assert found[y, x] == pytest.approx(expected, abs=1e-9)


def test_equal_pictures_are_1_and_order_does_not_matter() -> None:
    one, other = pictures(2)
    assert similarity(one, one) == pytest.approx(1.0, abs=1e-12)
    assert similarity(one, other) == pytest.approx(similarity(other, one), abs=1e-12)
    assert similarity(one[..., 0], one[..., 0]) == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(ValueError, match="same shape"):
        similarity(one, one[:-1])


def test_independent_noise_on_grey_leaves_what_its_variance_says() -> None:
    """C2 / (C2 + 2 s²) for large windows; the window of 1.5 px lowers the local variance."""
    rng = np.random.default_rng(3)
    one, other = (
        np.rint(120 + 5 * rng.standard_normal((300, 300))).astype(np.uint8) for _ in range(2)
    )
    away = np.arange(-5, 6)
    line = np.exp(-(away**2) / (2 * 1.5**2))
    line /= line.sum()
    kept = (25 + 1 / 12) * (1 - (line**2).sum() ** 2)
    second = (0.03 * 255) ** 2
    assert similarity(one, other) == pytest.approx(second / (second + 2 * kept), abs=0.01)


def test_profiles_differ_by_what_was_added() -> None:
    one = np.full((60, 80, 3), 100, dtype=np.uint8)
    other = one.copy()
    other[..., 1] += 7
    mask = np.ones((60, 80), dtype=bool)
    np.testing.assert_allclose(profile_error_dn(one, other, mask), [0, 7, 0], atol=1e-9)
