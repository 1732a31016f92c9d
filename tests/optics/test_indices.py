"""Indices, critical angles and Fresnel reflection against known values and the textbook form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gelslim_optics.guide.indices import critical_angle_deg, fresnel_reflectance, pmma_index
from gelslim_optics.light.scene import PMMA_SELLMEIER


def test_pmma_at_the_colours_of_the_leds() -> None:
    found = pmma_index([0.525, 0.625])
    np.testing.assert_allclose(found, [1.494, 1.489], atol=6e-4)
    assert np.all(np.diff(pmma_index(np.linspace(0.43, 1.06, 200))) < 0)


def test_the_tracer_uses_the_same_formula() -> None:
    b, c = PMMA_SELLMEIER
    assert float(pmma_index(0.59)) == math.sqrt(1 + b * 0.59**2 / (0.59**2 - c))


@pytest.mark.parametrize("wavelength", [0.0, 0.1, 0.42, 1.1, math.nan, math.inf, -0.5])
def test_wavelengths_beyond_the_fit_are_refused(wavelength: float) -> None:
    with pytest.raises(ValueError, match="holds from"):
        pmma_index(wavelength)


def test_critical_angles() -> None:
    assert float(critical_angle_deg(1.4906)) == pytest.approx(42.134, abs=1e-3)
    assert float(critical_angle_deg(1.4906, 1.41)) == pytest.approx(90 - 18.93, abs=0.01)
    assert float(critical_angle_deg(1.49, 1.49)) == 90.0
    assert math.isnan(float(critical_angle_deg(1.41, 1.49)))
    with pytest.raises(ValueError, match="at least 1"):
        critical_angle_deg(0.9)


def textbook(theta: float, n1: float, n2: float) -> float:
    """By angles: sin² and tan² of difference over those of sum."""
    other = math.asin(n1 * math.sin(theta) / n2)
    difference, total = theta - other, theta + other
    s = math.sin(difference) / math.sin(total)
    p = math.tan(difference) / math.tan(total)
    return (s * s + p * p) / 2


@pytest.mark.parametrize(("n1", "n2"), [(1.0, 1.49), (1.49, 1.0), (1.49, 1.41), (1.41, 1.49)])
def test_reflectance_is_that_of_the_textbook(n1: float, n2: float) -> None:
    limit = math.asin(min(n2 / n1, 1.0))
    theta = np.linspace(0.01, 0.999, 60) * limit
    found = fresnel_reflectance(np.cos(theta), n1, n2)
    np.testing.assert_allclose(found, [textbook(t, n1, n2) for t in theta], rtol=1e-9)
    head_on = ((n1 - n2) / (n1 + n2)) ** 2
    assert float(fresnel_reflectance(1.0, n1, n2)) == pytest.approx(head_on, rel=1e-14)


def test_reflectance_is_the_same_from_both_sides() -> None:
    inside = np.linspace(0.0, 0.99 * math.asin(1 / 1.49), 50)
    outside = np.arcsin(1.49 * np.sin(inside))
    np.testing.assert_allclose(
        fresnel_reflectance(np.cos(inside), 1.49, 1.0),
        fresnel_reflectance(np.cos(outside), 1.0, 1.49),
        rtol=1e-10,
    )


def test_total_grazing_and_absent_reflection() -> None:
    critical = math.asin(1 / 1.49)
    for beyond in (0.0, 1e-9, 0.1, math.pi / 2 - critical):
        assert float(fresnel_reflectance(math.cos(critical + beyond), 1.49, 1.0)) == pytest.approx(
            1.0, abs=1e-3
        )
    just = fresnel_reflectance(math.cos(critical + 1e-9), 1.49, 1.0)
    assert float(just) == 1.0
    assert 0.999 < float(fresnel_reflectance(math.cos(critical - 1e-9), 1.49, 1.0)) < 1.0
    assert float(fresnel_reflectance(0.0, 1.0, 1.49)) == 1.0
    np.testing.assert_array_equal(fresnel_reflectance(np.linspace(0, 1, 9), 1.49, 1.49), 0.0)
    with pytest.raises(ValueError, match="between 0 and 1"):
        fresnel_reflectance(1.1, 1.0, 1.49)
