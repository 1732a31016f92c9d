"""Light on the gel's face: interpolation, bins of a tracer, closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import gaussian_filter

from gelslim_optics.light.light_map import LightMap, light_arrays, red_green_sides


def uneven() -> LightMap:
    rng = np.random.default_rng(1)
    return LightMap(
        x_mm=np.array([-3.0, -1.0, 0.5, 4.0]),
        y_mm=np.array([-2.0, 0.0, 5.0]),
        irradiance=rng.uniform(0.1, 2.0, (3, 4, 2)),
        azimuth_deg=np.array([30.0, 200.0]),
        elevation_deg=np.array([20.0, 90.0]),
        colour=rng.uniform(0, 1, (2, 3)),
    )


def test_light_between_samples_is_bilinear_and_constant_beyond_them() -> None:
    light = uneven()
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-5, 6, (2, 7, 9))
    truth = RegularGridInterpolator((light.y_mm, light.x_mm), light.irradiance)
    at = np.stack([np.clip(y, -2, 5), np.clip(x, -3, 4)], axis=-1)
    np.testing.assert_allclose(light.at(x, y), truth(at), rtol=1e-12)
    # On the samples themselves, the last ones included.
    grid = np.meshgrid(light.x_mm, light.y_mm)
    np.testing.assert_allclose(light.at(*grid), light.irradiance, rtol=1e-14)


def test_directions_are_unit_vectors_of_azimuth_and_elevation() -> None:
    light = uneven()
    assert light.sources == 2
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    flat = np.cos(np.radians(20))
    expected = [[flat * c, flat * s, np.sin(np.radians(20))], [0, 0, 1]]
    np.testing.assert_allclose(light.directions, expected, atol=1e-15)


@pytest.mark.parametrize("smooth_mm", [0.0, 0.8])
def test_bins_of_the_tracer_become_samples_at_their_middles(smooth_mm: float) -> None:
    bins = np.random.default_rng(3).uniform(0, 1, (2, 5, 3))
    facts = {
        "azimuth_deg": np.array([90.0, -90.0]),
        "elevation_deg": np.array([25.0, 30.0]),
        "colour": np.ones((2, 3)),
    }
    light = LightMap.from_bins(bins, 10.0, 4.5, smooth_mm=smooth_mm, **facts)
    np.testing.assert_allclose(light.x_mm, [-4, -2, 0, 2, 4])
    np.testing.assert_allclose(light.y_mm, [-1.5, 0, 1.5])
    # Bins are 2 mm long and 1.5 mm wide.
    expected = np.array(
        [gaussian_filter(b, (smooth_mm / 2, smooth_mm / 1.5), mode="nearest") for b in bins]
    )
    expected = expected.transpose(2, 1, 0) / expected.mean()
    np.testing.assert_allclose(light.irradiance, expected, rtol=1e-12)
    for name, value in facts.items():
        np.testing.assert_array_equal(light_arrays(light)[name], value)
    for dark in (np.zeros((2, 5, 3)), bins[0]):
        with pytest.raises(ValueError, match="contain light"):
            LightMap.from_bins(dark, 10.0, 4.5, **facts)


def test_light_of_two_sides_decays_from_each_with_its_mean() -> None:
    light = red_green_sides(20.0, 12.0, decay_mm=5.0, elevation_deg=30.0, red=0.7, green=1.3)
    assert (light.x_mm[0], light.x_mm[-1]) == (-10, 10)
    assert (light.y_mm[0], light.y_mm[-1]) == (-6, 6)
    y, e = light.y_mm, light.irradiance
    for k, (mean, away) in enumerate(((0.7, y + 6), (1.3, 6 - y))):
        for column in e[:, :, k].T:
            np.testing.assert_allclose(column / column[0], np.exp(-away / 5) / np.exp(-away[0] / 5))
            assert np.trapezoid(column, y) / 12 == pytest.approx(mean, rel=1e-12)
    # Red comes from -y and so travels towards +y.
    np.testing.assert_allclose(light.azimuth_deg, [90, -90])
    np.testing.assert_allclose(light.elevation_deg, [30, 30])
    assert light.colour[0, 0] > light.colour[0, 1]
    assert light.colour[1, 1] > light.colour[1, 0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"irradiance": np.full((3, 4, 2), np.nan)}, "finite"),
        ({"irradiance": np.ones((4, 3, 2))}, "irradiance"),
        ({"irradiance": np.ones((3, 4, 3))}, "azimuth_deg"),
        ({"azimuth_deg": np.zeros(3)}, "azimuth_deg"),
        ({"elevation_deg": np.ones(1)}, "elevation_deg"),
        ({"colour": np.ones((2, 4))}, "colour"),
        ({"x_mm": np.array([-3.0, -1.0, -1.0, 4.0])}, "increasing"),
        ({"y_mm": np.array([0.0]), "irradiance": np.ones((1, 4, 2))}, "increasing"),
        ({"irradiance": -np.ones((3, 4, 2))}, "negative"),
        ({"colour": -np.ones((2, 3))}, "negative"),
        ({"elevation_deg": np.array([0.0, 30.0])}, "at most 90"),
        ({"elevation_deg": np.array([30.0, 91.0])}, "at most 90"),
    ],
)
def test_light_that_makes_no_sense_is_refused(change: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        replace(uneven(), **change)


def test_two_samples_are_enough_and_no_light_is_light() -> None:
    light = replace(
        uneven(),
        x_mm=np.array([0.0, 1.0]),
        y_mm=np.array([0.0, 1.0]),
        irradiance=np.zeros((2, 2, 2)),
        colour=np.zeros((2, 3)),
    )
    assert light.at(np.array(0.5), np.array(0.5)).tolist() == [0.0, 0.0]
