"""What the model leaves out of the forces of an unknown shape."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.joint.model_errors import by_heights


def test_heights_that_are_off_together_are_a_shear_along_the_camera_s_lean() -> None:
    """By finite differences: markers seen where a deeper dent would show them move the wrench."""
    rng = np.random.default_rng(3)
    by_motion = rng.normal(size=(6, 40, 2))
    heights, lean = -rng.random(40), np.array([0.3, 0.02])
    share = 0.07
    apparent = share * heights[:, None] * lean
    moved = np.zeros(6)
    for k in range(40):
        moved += by_motion[:, k] @ apparent[k]
    found = by_heights(by_motion, apparent)
    np.testing.assert_allclose(found, np.outer(moved, moved), rtol=1e-9)
    assert np.linalg.matrix_rank(found) == 1
    assert by_heights(by_motion, 2 * apparent) == pytest.approx(4 * found)
