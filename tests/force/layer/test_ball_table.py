"""Contacts of all sizes from the table, against single solutions and axisymmetric elements."""

from __future__ import annotations

import numpy as np
import pytest
from bonded_layer import layer_contact, stiffness_factor
from pressed_disc import pressed_disc

from gelslim_force.contact.indenter import Sphere
from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.layer.ball_table import BallTable

BALL_MM, THICK_MM, NU = 6.0, 2.0, 0.3223


@pytest.mark.parametrize("skin_mm", [0.0, 0.4])
def test_values_between_the_sizes_are_those_of_single_solutions(skin_mm: float) -> None:
    table = BallTable.of(BALL_MM, THICK_MM, 0.45, skin_mm)
    for size in (0.25, 0.7, 1.33, 2.9, 5.1):
        ball = BallOnLayer.at(size, BALL_MM, THICK_MM, 0.45, skin_mm=skin_mm)
        assert table.holds(size)
        assert table.depth_mm(size) == pytest.approx(ball.depth_mm, rel=2e-3)
        assert table.forces_per_mpa(size).sum() == pytest.approx(ball.force_n_per_mpa, rel=6e-3)
        outward = ball.motion(np.array([size]))[0][0]
        assert table.outward_mm(size) == pytest.approx(outward, rel=5e-3, abs=1e-5)
    assert not table.holds(0.99 * BALL_MM)
    assert not table.holds(0.0)


@pytest.mark.parametrize("size", [0.9, 1.8, 2.7])
def test_rings_carry_the_pressure_of_the_layer(size: float) -> None:
    """Force and its second moment, by which a patch is as wide as it is, by Hankel transforms."""
    table = BallTable.of(BALL_MM, THICK_MM, NU, 0.0)
    ball = Sphere(BALL_MM)
    truth = layer_contact(lambda r: ball.profile(r, 0 * r), size, THICK_MM, 1.0, NU)
    force = table.forces_per_mpa(size)
    assert force.sum() == pytest.approx(truth.force_n, rel=2e-3)
    # p~(k) = p~(0) (1 - k² <r²>/4): the response of the layer is divided out at a small k.
    moment = force @ (size * table.rings) ** 2 / force.sum()
    wave = truth._k[1:40]
    pressure = truth._spectrum[1:40] / stiffness_factor(wave * THICK_MM, NU)
    slope = np.polyfit(wave**2, pressure / pressure[0], 2)
    assert moment == pytest.approx(-4 * slope[1] / slope[2], rel=0.02)


@pytest.mark.parametrize("ball_mm", [4.0, 10.0])
def test_the_rim_at_rest_lies_between_no_slip_and_no_friction(ball_mm: float) -> None:
    """By axisymmetric elements, whose rim is known to within a tenth of a ring."""
    table = BallTable.of(ball_mm, THICK_MM, NU, 0.0)
    for size in (1.3, 2.5):
        for sticks in (False, True):
            disc = pressed_disc(ball_mm, THICK_MM, NU, sticks)
            force = float(table.forces_per_mpa(size).sum())
            _, outward, _ = disc.at_force(force)
            moved = float(np.interp(size, disc.r_mm, outward))
            found, sigma = table.at_rest(size + moved)
            assert moved < 0
            assert abs(found - size) < 1.5 * sigma + 1e-3
