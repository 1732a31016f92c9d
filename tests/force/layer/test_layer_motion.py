"""The motion of an endless layer, against elements through its thickness and integrals."""

from __future__ import annotations

import numpy as np
import pytest
from layer_waves import hat_response, wave_motion

from gelslim_force.layer.layer_motion import Places, surface_motion
from gelslim_force.layer.layer_response import LayerResponse

THICKNESS_MM, YOUNG_MPA, STEP_MM = 2.0, 0.15, (0.5, 0.4)


def lumped(traction: np.ndarray) -> np.ndarray:
    """Forces of a traction that is bilinear between places, in N, on a lattice without end."""
    for axis in (0, 1):
        traction = (
            4 * traction + np.roll(traction, 1, axis) + np.roll(traction, -1, axis)
        ) / 6  # fmt: skip
    return traction * STEP_MM[0] * STEP_MM[1]


@pytest.mark.parametrize("ratio", [0.3, 0.49])
def test_motion_is_that_of_elements_through_the_thickness(ratio: float) -> None:
    """Of a smooth traction, in all nine pairs of directions."""
    count, layer = 64, LayerResponse(THICKNESS_MM, ratio)
    given = surface_motion(layer, YOUNG_MPA, Places(count, count, STEP_MM), STEP_MM)
    hats = hat_response(count, STEP_MM, THICKNESS_MM, (YOUNG_MPA, ratio))
    rows, columns = np.indices((count, count)) - count // 2
    bump = np.exp(-((rows * STEP_MM[1] / 1.3) ** 2) - (columns * STEP_MM[0] / 1.0) ** 2)
    force, traction = lumped(bump), bump * STEP_MM[0] * STEP_MM[1]
    for i, j in np.ndindex(3, 3):
        found, expected = (
            np.fft.ifft2(np.fft.fft2(load) * np.fft.fft2(motion[..., i, j])).real
            for load, motion in ((force, given), (traction, hats))
        )
        np.testing.assert_allclose(found, expected, atol=5e-4 * np.abs(expected).max())


def test_far_from_each_other_forces_shear_the_layer_evenly() -> None:
    """The sum over all places is h/G along the surface, and h over the oedometric modulus."""
    ratio = 0.4
    places = Places(48, 48, STEP_MM)
    motion = surface_motion(LayerResponse(THICKNESS_MM, ratio), YOUNG_MPA, places, STEP_MM)
    by_stress = motion.sum(axis=(0, 1)) * STEP_MM[0] * STEP_MM[1] / THICKNESS_MM
    shear = 2 * (1 + ratio) / YOUNG_MPA
    pressed = (1 + ratio) * (1 - 2 * ratio) / (1 - ratio) / YOUNG_MPA
    np.testing.assert_allclose(by_stress, np.diag([shear, shear, pressed]), atol=1e-6 * shear)


def test_a_disc_moves_as_the_mean_of_its_places() -> None:
    places, radius = Places(240, 240, (0.1, 0.1)), 0.4
    layer = LayerResponse(THICKNESS_MM, 0.45)
    points = surface_motion(layer, YOUNG_MPA, places, STEP_MM)
    disc = surface_motion(layer, YOUNG_MPA, places, STEP_MM, radius)
    parts = (np.arange(10) + 0.5) / 10 - 0.5
    inside = [
        np.mean(np.hypot.outer(i - 4 + parts, j - 4 + parts) < radius / 0.1)
        for i, j in np.ndindex(9, 9)
    ]
    share = np.reshape(inside, (9, 9)) / np.sum(inside)
    mean = sum(
        share[i, j] * np.roll(points, (i - 4, j - 4), axis=(0, 1)) for i, j in np.ndindex(9, 9)
    )
    np.testing.assert_allclose(disc, mean, atol=4e-3 * np.abs(points).max())


def test_waves_in_a_skin_are_those_of_each_function() -> None:
    layer = LayerResponse(THICKNESS_MM, 0.47, skin_mm=0.3)
    wave = np.geomspace(0.05, 8.0, 9)
    sinking, outward, along = layer.by_wave(wave)
    by_base = layer.by_base(wave)
    held = layer.skin_length_mm * wave
    half_space = 1 - held / (1 + held) * layer.rigid_limit**2
    np.testing.assert_allclose(sinking, by_base[0] + half_space, atol=1e-9)
    np.testing.assert_allclose(outward, by_base[1] + layer.of_half_space(wave), atol=1e-9)
    bare = LayerResponse(THICKNESS_MM, 0.47).along(wave)
    np.testing.assert_allclose(1 / along, 1 / bare + held, rtol=1e-12)


def test_elements_through_the_thickness_give_the_known_sinking() -> None:
    """Of long waves, the oedometric modulus; of short ones, that of a half-space."""
    motion, ratio = wave_motion(0.45), 0.45
    pressed = (1 + ratio) * (1 - 2 * ratio) / (1 - ratio)
    assert float(motion.sinking(np.log(0.02))) / 0.02 == pytest.approx(pressed, rel=0.01)
    assert float(motion.sinking(np.log(30.0))) == pytest.approx(2 * (1 - ratio**2), rel=1e-4)
