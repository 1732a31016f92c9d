"""Pictures made wider and narrower, against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from gelslim_force.joint.morphology import closed, filled, narrowed, opened, widened


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9, 1.0])
@pytest.mark.parametrize("steps", [1, 2, 4])
def test_pictures_agree_with_scipy(share: float, steps: int) -> None:
    rng = np.random.default_rng([steps, int(100 * share)])
    for _ in range(5):
        picture = rng.random((rng.integers(1, 25), rng.integers(1, 25))) < share
        of = {"iterations": steps}
        np.testing.assert_array_equal(
            widened(picture, steps), ndimage.binary_dilation(picture, **of)
        )
        np.testing.assert_array_equal(
            narrowed(picture, steps), ndimage.binary_erosion(picture, **of)
        )
        np.testing.assert_array_equal(opened(picture, steps), ndimage.binary_opening(picture, **of))
        wide = np.pad(picture, 2 * steps)
        inner = slice(2 * steps, -2 * steps)
        expected = ndimage.binary_closing(wide, **of)[inner, inner]
        np.testing.assert_array_equal(closed(picture, steps), expected)
        np.testing.assert_array_equal(filled(picture), ndimage.binary_fill_holes(picture))


def test_nothing_true_stays_nothing() -> None:
    empty = np.zeros((1, 2), dtype=bool)
    assert not widened(empty, 3).any()
    assert not closed(empty, 3).any()
    assert not filled(empty).any()


def test_rings_are_filled_and_bays_are_not() -> None:
    y, x = np.mgrid[-20:21, -30:31]
    ring = np.abs(np.hypot(x, y) - 12) < 2
    assert (filled(ring) == (np.hypot(x, y) < 14)).all()
    bay = ring & ~((x > 0) & (np.abs(y) < 2))
    np.testing.assert_array_equal(filled(bay), bay)
