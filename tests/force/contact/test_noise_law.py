"""The noise of the light by its level, against noise that is drawn."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_force.contact.noise_law import NoiseLaw
from gelslim_force.contact.shading_change import ShadingReference
from gelslim_force.joint.region import changed_bins

SHAPE = (480, 640)
MARKERS = np.array([[320.0, 240.0]])


def scene() -> NDArray[np.float64]:
    """Two colours that fade from either side, from 150 to 10, and a third one everywhere."""
    fall = np.broadcast_to(150 * np.exp(-2.7 * np.linspace(0, 1, SHAPE[1])), SHAPE)
    return np.stack([fall, fall[:, ::-1], np.full(SHAPE, 60.0)], axis=2)


def photograph(shot: bool, seed: int, dent: float = 0.0) -> NDArray[np.uint8]:
    """With noise of 3 at a level of 60; `dent` changes the light of a disc by this share."""
    light, rng = scene(), np.random.default_rng(seed)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    slope = np.clip((x - 200) / 40, -1, 1) * (np.hypot(x - 200, y - 200) < 40)
    light = light * (1 + dent * slope[..., None] * [1, -1, 0])
    sigma = 3 * np.sqrt(light / 60) if shot else 3.0
    return np.clip(np.rint(light + rng.normal(size=light.shape) * sigma), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("shot", [False, True])
def test_deviations_hold_at_all_levels(shot: bool) -> None:
    """Scores of bins by level: brighter ones had twice their deviation under shot noise."""
    reference = ShadingReference(photograph(shot, 0), MARKERS, np.array([8.0]), 4)
    seen = reference.change(photograph(shot, 1), MARKERS)
    level = scene()[2::4, 2::4, 0]
    score = seen.change[0] / seen.noise[0]
    for low, high in ((10, 20), (20, 40), (40, 80), (80, 150)):
        some = seen.valid & (level > low) & (level < high)
        assert np.sqrt((score[some] ** 2).mean()) == pytest.approx(1.0, abs=0.15), (low, high)


def test_only_the_contact_has_changed_in_the_pictures_of_a_linear_camera() -> None:
    """A band of 2600 bins over the bright middle of the gel had, around a contact of 300."""
    reference = ShadingReference(photograph(True, 0), MARKERS, np.array([8.0]), 4)
    rest, pressed = (reference.change(photograph(True, 2, dent), MARKERS) for dent in (0.0, 0.5))
    assert changed_bins(rest).sum() < 10
    rows, columns = np.nonzero(changed_bins(pressed))
    away = np.hypot(4 * columns - 200, 4 * rows - 200)
    assert np.quantile(away, 0.98) < 60
    assert len(away) > 150


def test_a_contact_is_no_shot_noise() -> None:
    """Even noise stays even where a third of the bins changes, such as under a rod."""
    levels = np.broadcast_to(np.linspace(10, 150, 60, dtype=np.float32), (1, 40, 60))
    law, rng, valid = NoiseLaw.of(levels), np.random.default_rng(3), np.ones((40, 60), dtype=bool)
    change = law.even * rng.normal(size=levels.shape)
    change[:, :, 36:56] += 0.5 * np.sin(np.linspace(0, np.pi, 20))
    assert law.growth(change, law.even, valid) is None
    shot = law.even * np.sqrt(law.shot) * rng.normal(size=levels.shape)
    usual = law.even * np.median(np.sqrt(law.shot))
    grown = law.growth(shot, usual, valid)
    assert grown is not None
    np.testing.assert_allclose(grown * usual, law.even * np.sqrt(law.shot), rtol=0.15)
