"""Splines of the motion around a ball against the closed form that they sample."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.presses.radial_motion import RadialMotion


@pytest.mark.parametrize("friction", [(0.0, 0.0), (-0.3, 0.1)])
@pytest.mark.parametrize(("contact", "ball", "thickness"), [(0.5, 3.0, 2.0), (2.3, 6.0, 1.2)])
def test_splines_are_the_closed_form(
    contact: float, ball: float, thickness: float, friction: tuple[float, float]
) -> None:
    """With friction the closed form has ripples of 1e-4 mm of its own, of a truncated integral."""
    solved = BallOnLayer.at(contact, ball, thickness, 0.48, friction)
    reach = contact + 4 * thickness
    found = RadialMotion.of(solved, reach)
    rng = np.random.default_rng(1)
    r = np.concatenate([rng.uniform(0, reach, 300), contact + rng.normal(0, 0.02, 100)])
    turn = rng.uniform(0, 2 * np.pi, len(r))
    unit = np.column_stack([np.cos(turn), np.sin(turn)])
    outward, height = solved.motion(r)
    expected = np.column_stack([unit * outward[:, None], height])
    np.testing.assert_allclose(
        found.at(r[:, None] * unit), expected, atol=2e-4 if any(friction) else 2e-5
    )
    assert found.rim_outward_mm == pytest.approx(solved.motion(np.array([contact]))[0][0])


def test_the_middle_does_not_move_aside() -> None:
    found = RadialMotion.of(BallOnLayer.at(1.0, 4.0, 2.0, 0.4), 3.0)
    still = found.at(np.zeros((2, 3, 2)))
    assert still.shape == (2, 3, 3)
    assert np.abs(still[..., :2]).max() == 0
    assert (still[..., 2] < -0.1).all()
