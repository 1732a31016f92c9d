"""The closed form of a ball on a bonded layer against limits, another solution and elements."""

from __future__ import annotations

import numpy as np
import pytest
from bonded_layer import layer_contact
from pressed_disc import SKIN_RATIO, membrane_stiffness, pressed_disc, surface_stiffness
from scipy.optimize import brentq

from gelslim_force.layer.ball_on_layer import BallOnLayer


def test_hertz_on_a_thick_layer() -> None:
    found = BallOnLayer.at(0.1, 10.0, 100.0, 0.4)
    assert found.depth_mm == pytest.approx(0.1**2 / 10, rel=5e-3)
    hertz = 4 / 3 / (1 - 0.4**2) * 0.1**3 / 10
    assert found.force_n_per_mpa == pytest.approx(hertz, rel=1e-3)


def test_a_thin_layer_is_a_foundation_of_springs() -> None:
    """F = π M a⁴ / (4 R h) with the modulus of a layer that cannot widen, and depth a² / 2R."""
    ratio, thickness = 0.3, 0.1
    modulus = (1 - ratio) / ((1 + ratio) * (1 - 2 * ratio))
    found = BallOnLayer.at(2.0, 40.0, thickness, ratio)
    assert found.depth_mm == pytest.approx(2.0**2 / 80, rel=0.02)
    springs = np.pi * modulus * 2.0**4 / (4 * 40 * thickness)
    assert found.force_n_per_mpa == pytest.approx(springs, rel=0.03)


def test_the_force_of_a_thin_incompressible_layer_grows_with_the_sixth_power() -> None:
    force = [BallOnLayer.at(a, 100.0, 0.1, 0.49999).force_n_per_mpa for a in (1.6, 2.0)]
    assert np.log(force[1] / force[0]) / np.log(2.0 / 1.6) == pytest.approx(6, abs=0.5)
    thinner = BallOnLayer.at(2.0, 100.0, 0.095, 0.49999).force_n_per_mpa
    assert np.log(thinner / force[1]) / np.log(0.95) == pytest.approx(-3, abs=0.45)


@pytest.mark.parametrize(("contact", "ball", "ratio"), [(1.5, 5.0, 0.48), (3.0, 10.0, 0.3223)])
def test_agrees_with_collocation(contact: float, ball: float, ratio: float) -> None:
    found = BallOnLayer.at(contact, ball, 2.0, ratio)
    truth = layer_contact(lambda r: ball - np.sqrt(ball**2 - r * r), contact, 2.0, 1.0, ratio)
    assert found.depth_mm == pytest.approx(truth.depth_mm, rel=1e-4)
    assert found.force_n_per_mpa == pytest.approx(truth.force_n, rel=1e-4)
    r = np.array([0.0, 0.4, 0.9, 1.1, 1.6, 3.0]) * contact
    height = found.motion(r)[1]
    np.testing.assert_allclose(height, -truth.exact_sinking(r), atol=5e-4 * found.depth_mm)
    rings = np.linspace(0, contact, 2001)
    whole = np.trapezoid(2 * np.pi * rings * found.pressure(rings), rings)
    assert whole == pytest.approx(found.force_n_per_mpa, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.3223, 0.48])
def test_motion_agrees_with_finite_elements(ratio: float) -> None:
    """At the same force: depth, height and outward motion of the whole surface."""
    disc = pressed_disc(6.0, 2.0, ratio)
    state = 20
    force = disc.force_n[state]
    contact = brentq(lambda a: BallOnLayer.at(a, 6.0, 2.0, ratio).force_n_per_mpa - force, 0.3, 5.0)
    found = BallOnLayer.at(contact, 6.0, 2.0, ratio)
    assert contact == pytest.approx(disc.contact_mm[state], abs=0.05)
    outward, height = found.motion(disc.r_mm)
    assert found.depth_mm == pytest.approx(-disc.height_mm[state, 0], rel=3e-3)
    np.testing.assert_allclose(height, disc.height_mm[state], atol=0.008 * found.depth_mm)
    np.testing.assert_allclose(outward, disc.outward_mm[state], atol=0.004 * found.depth_mm)


@pytest.mark.parametrize("ratio", [0.3223, 0.48])
@pytest.mark.parametrize(
    ("friction", "skin"), [((-0.3, 0.0), 0.0), ((0.1, -0.3), 0.0), ((0.1, -0.3), 0.3)]
)
def test_friction_agrees_with_finite_elements(
    ratio: float, friction: tuple[float, float], skin: float
) -> None:
    """The tractions of the solution, put on the elements, give its motion and fit the ball."""
    contact, ball, thickness = 2.0, 6.0, 2.0
    plane = skin / (1 - SKIN_RATIO**2)
    smooth = BallOnLayer.at(contact, ball, thickness, ratio, skin_mm=plane)
    found = BallOnLayer.at(contact, ball, thickness, ratio, friction, plane)
    r, stiffness = surface_stiffness(thickness, ratio)
    stiffness[0::2, 0::2] += membrane_stiffness(r, skin)
    force = np.zeros(2 * len(r))
    x, weight = np.polynomial.legendre.leggauss(12)
    for cell in range(0, int(np.searchsorted(r, contact)), 2):
        low, high = r[cell], min(r[cell + 2], contact)
        ring = low + (high - low) * (x + 1) / 2
        load = np.pi * ring * weight * (high - low)
        part = ring / contact
        radial = smooth.pressure(ring) * (friction[0] * part + friction[1] * part**3)
        at = (ring - r[cell + 1]) / ((r[cell + 2] - r[cell]) / 2)
        for k, shape in enumerate((at * (at - 1) / 2, 1 - at * at, at * (at + 1) / 2)):
            force[2 * (cell + k)] += float((load * shape) @ radial)
            force[2 * (cell + k) + 1] -= float((load * shape) @ found.pressure(ring))
    motion = np.zeros(2 * len(r))
    motion[1:] = np.linalg.solve(stiffness[1:, 1:], force[1:])
    outward, height = found.motion(r)
    away_from_rim = np.abs(r - contact) > 0.1
    for one, other in ((motion[0::2], outward), (motion[1::2], height)):
        apart = np.abs(one - other)[away_from_rim]
        assert apart.max() < 0.006 * found.depth_mm
    assert abs(found.force_n_per_mpa / smooth.force_n_per_mpa - 1) > 0.002


@pytest.mark.parametrize(
    "values", [(3.0, 3.0, 2.0, 0.4), (0.0, 3.0, 2.0, 0.4), (1.0, 3.0, 0.0, 0.4), (1, 3, 2, 0.5)]
)
def test_impossible_contacts_are_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="Poisson's ratio"):
        BallOnLayer.at(*values)
