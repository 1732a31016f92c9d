"""Looks of real sensors, judged by their own frames; skipped where these are absent."""

from __future__ import annotations

import numpy as np
import pytest
from real_looks import RESTS, presses_compared, rest_compared
from test_real_unknown_shape import real_sensor

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("name", "least"), zip(RESTS, (0.90, 0.93, 0.95, 0.98), strict=True))
def test_a_drawn_picture_at_rest_looks_like_the_real_one(name: str, least: float) -> None:
    found, _ = rest_compared(name)
    assert found["similarity"] >= least
    assert found["similarity_with_noise"] >= least - 0.09
    real, drawn = found["real"], found["drawn"]
    assert drawn["dot_contrast"] == pytest.approx(real["dot_contrast"], abs=0.07)
    assert drawn["edge_percent"] == pytest.approx(real["edge_percent"], rel=0.12)
    assert drawn["noise_dn"] == pytest.approx(real["noise_dn"], rel=0.25)
    for apart in range(3):
        assert drawn["noise_correlation"][apart] == pytest.approx(
            real["noise_correlation"][apart], abs=0.15
        )
    assert max(found["profile_error_dn"]) < 4.0


def test_presses_that_the_look_was_not_fitted_to() -> None:
    rows, _ = presses_compared(real_sensor())
    changed, of_rest, whole = (
        np.array([row[key] for row in rows])
        for key in ("similarity_changed", "similarity_changed_of_rest", "similarity")
    )
    assert whole.mean() > 0.885
    assert (changed > of_rest + 0.01).all()
    assert (changed - of_rest).mean() > 0.025
