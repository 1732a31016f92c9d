"""Forces on designs whose light differs from place to place, as that of a guide does."""

from __future__ import annotations

import numpy as np
import pytest
from designed_presses import DESIGNS, DesignedSensor


@pytest.mark.slow
@pytest.mark.parametrize("design", ["mini20", "gelslim3_lens"])
def test_forces_in_the_light_of_a_guide(design: str) -> None:
    """With the mean direction of each colour, F_z was 5 to 11 % off, and 3 to 7 % too large."""
    found = DesignedSensor(DESIGNS / f"{design}.yaml", in_place=True).scores(12)
    assert len(found.normal) == 12
    assert np.median(np.abs(found.normal)) < 0.04
    assert abs(np.median(found.normal)) < 0.04
    assert np.median(found.shear) < 0.02
    assert (np.abs(found.score) < 3.5).all()


@pytest.mark.slow
def test_deviations_hold_where_leds_are_off_their_places() -> None:
    found = DesignedSensor(DESIGNS / "thin.yaml").scores(12)
    assert len(found.normal) == 12
    assert (np.abs(found.score) < 3.5).all()
    assert np.sqrt((found.score[:, 2] ** 2).mean()) < 1.4
