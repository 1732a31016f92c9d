"""A ball on a layer in its skin: the responses to waves, and the contact against elements."""

from __future__ import annotations

import numpy as np
import pytest
from pressed_disc import SKIN_RATIO, membrane_stiffness, pressed_disc, surface_stiffness
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import j1

from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_force.layer.layer_response import LayerResponse
from gelslim_force.presses.press_model import skin_length_mm, skin_parameter

PLANE = 1 / (1 - SKIN_RATIO**2)


def test_the_elements_of_the_judge_resist_waves_as_a_membrane_does() -> None:
    """Motion J1(kr) outwards needs the traction T k² J1(kr), where no edge is near."""
    r, _ = surface_stiffness(2.0, 0.48)
    k, stiffness = 1.7, 0.3
    force = membrane_stiffness(r, stiffness) @ j1(k * r)
    x, weight = np.polynomial.legendre.leggauss(8)
    expected = np.zeros(len(r))
    for first in range(0, len(r) - 1, 2):
        middle, half = (r[first + 2] + r[first]) / 2, (r[first + 2] - r[first]) / 2
        at = middle + half * x
        traction = stiffness * PLANE * k**2 * j1(k * at) * 2 * np.pi * at * half * weight
        for node, shape in enumerate((x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2)):
            expected[first + node] += traction @ shape
    inside = r < 4.0
    close = 2e-3 * np.abs(expected[inside]).max()
    np.testing.assert_allclose(force[inside], expected[inside], atol=close)


@pytest.mark.parametrize("ratio", [0.0, 0.3223, 0.48])
@pytest.mark.parametrize("skin", [0.0, 0.02, 3.0])
def test_a_skin_adds_to_the_stiffness_of_the_layer(skin: float, ratio: float) -> None:
    """In waves the skin stiffens the motion outwards by T k², and nothing else."""
    wave = np.array([0.05, 0.5, 2.0, 12.0])
    bare, worn = LayerResponse(2.0, ratio), LayerResponse(2.0, ratio, skin)

    def compliance(layer: LayerResponse) -> np.ndarray:
        sinking, outward = layer.by_base(wave)
        half = layer.of_half_space(wave)
        singular = layer.rigid_limit * half if layer.skin_mm else 0.0
        cross = outward + half
        rows = [[layer.shallow + singular + sinking, cross], [cross, layer.along(wave)]]
        return 2 * (1 - ratio**2) / wave[:, None, None] * np.moveaxis(np.array(rows), 2, 0)

    stiffness = np.linalg.inv(compliance(bare))
    stiffness[:, 1, 1] += skin * wave**2
    np.testing.assert_allclose(np.linalg.inv(compliance(worn)), stiffness, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("apart", [0.01, 0.3, 4.0])
def test_the_kernel_of_the_skin_is_its_integral(apart: float) -> None:
    layer = LayerResponse(2.0, 0.2, 0.4)

    def rest(wave: float) -> float:
        return layer.rigid_limit * float(layer.of_half_space(np.array([wave]))[0])

    found = float(layer.skin_kernel(np.array([apart]))[0])
    expected, _ = quad(rest, 0, np.inf, weight="cos", wvar=apart, limlst=200)
    assert found == pytest.approx(expected, rel=1e-5)
    whole = [quad(lambda v: float(layer.skin_kernel(np.array([v]))[0]), 0, apart)[0]]
    assert float(layer.skin_integral(np.array([apart]))[0]) == pytest.approx(whole[0], rel=1e-6)


def test_a_soft_skin_is_none() -> None:
    bare, soft = (BallOnLayer.at(1.3, 6.0, 2.0, 0.3, (-0.3, 0.1), s) for s in (0.0, 1e-6))
    assert soft.depth_mm == pytest.approx(bare.depth_mm, rel=1e-4)
    assert soft.force_n_per_mpa == pytest.approx(bare.force_n_per_mpa, rel=1e-4)
    r = np.linspace(0, 8, 40)
    for one, other in zip(soft.motion(r), bare.motion(r), strict=True):
        np.testing.assert_allclose(one, other, atol=5e-4 * bare.depth_mm)


def test_the_unknown_of_a_fit_is_the_skin_over_the_layer() -> None:
    assert skin_parameter(0.0, 2.0) == 0.0
    assert skin_parameter(2e-4, 2.0) == pytest.approx(1e-4, rel=1e-3)
    assert skin_length_mm(skin_parameter(3.3, 2.0), 2.0) == pytest.approx(3.3)


@pytest.mark.parametrize(("skin", "ratio"), [(0.2, 0.3223), (2.0, 0.48)])
def test_motion_agrees_with_finite_elements(skin: float, ratio: float) -> None:
    """At the same force, to the bounds of the bare layer; the skin changes u by much more."""
    disc = pressed_disc(6.0, 2.0, ratio, False, skin)

    def at(contact: float) -> BallOnLayer:
        return BallOnLayer.at(contact, 6.0, 2.0, ratio, skin_mm=skin * PLANE)

    for state in (8, 20):
        force = disc.force_n[state]
        contact = brentq(lambda a, due=force: at(a).force_n_per_mpa - due, 0.3, 5.0)
        found = at(contact)
        assert contact == pytest.approx(disc.contact_mm[state], abs=0.05)
        outward, height = found.motion(disc.r_mm)
        assert found.depth_mm == pytest.approx(-disc.height_mm[state, 0], rel=7e-3)
        np.testing.assert_allclose(height, disc.height_mm[state], atol=0.01 * found.depth_mm)
        np.testing.assert_allclose(outward, disc.outward_mm[state], atol=0.004 * found.depth_mm)
        bare = BallOnLayer.at(contact, 6.0, 2.0, ratio).motion(disc.r_mm)[0]
        assert np.abs(outward - bare).max() > 0.02 * found.depth_mm


@pytest.mark.parametrize("skin", [-0.1, np.inf, np.nan])
def test_impossible_skins_are_refused(skin: float) -> None:
    with pytest.raises(ValueError, match="skin"):
        BallOnLayer.at(1.0, 3.0, 2.0, 0.4, skin_mm=skin)
