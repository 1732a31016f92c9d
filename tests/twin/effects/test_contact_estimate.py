"""Estimates of the contact against the formulas of contact mechanics and their limits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from scipy.integrate import quad

from gelslim_twin.effects.contact_estimate import (
    ContactEstimate,
    Footprint,
    contact_estimate,
    nonlinear_excess,
)

AREA_MM2, VOLUME_MM3, WIDTH_MM = 7.3, 1.9, 2.2
DEPTH_MM, YOUNGS_MPA = 0.45, 0.21
TOOL = Footprint(
    area_mm2=lambda d: AREA_MM2 * d / DEPTH_MM,
    volume_mm3=lambda d: VOLUME_MM3 * d / DEPTH_MM,
    reach_mm=lambda _d: 3.0,
    steepest=lambda _d: 0.4,
    width_mm=lambda d: WIDTH_MM * d / DEPTH_MM,
)
RADIUS_MM = math.sqrt(AREA_MM2 / math.pi)
EMPTY = Footprint(*[lambda _d: 0.0] * 5)


def estimated(thickness_mm: float, poisson: float) -> ContactEstimate:
    return contact_estimate(TOOL, DEPTH_MM, thickness_mm, YOUNGS_MPA, poisson)


def half_space_n(poisson: float) -> float:
    """Flat punch of the mean overlap on a half-space, with the margin of 10 %."""
    return 1.1 * 2 * YOUNGS_MPA / (1 - poisson**2) * RADIUS_MM * VOLUME_MM3 / AREA_MM2


def shear_modulus_mpa(poisson: float) -> float:
    return YOUNGS_MPA / (2 + 2 * poisson)


@pytest.mark.parametrize("poisson", [0.2, 0.4, 0.49])
@pytest.mark.parametrize("thickness_mm", [0.7, 2.0, 4.0])
def test_force_is_half_space_and_layer(thickness_mm: float, poisson: float) -> None:
    """Two springs of the layer in series, no softer than uniaxial stress."""
    found, h = estimated(thickness_mm, poisson), thickness_mm
    shear, bulk = shear_modulus_mpa(poisson), YOUNGS_MPA / (3 - 6 * poisson)
    compress = (bulk + 4 / 3 * shear) * VOLUME_MM3 / h
    flow = 3 * shear * VOLUME_MM3 * AREA_MM2 / (8 * math.pi * h**3)
    free, stuck = flow * (1 + 1.2 * h / RADIUS_MM) ** 4, 4 * flow * (1 + 0.5 * h / RADIUS_MM) ** 4
    uniaxial = YOUNGS_MPA * VOLUME_MM3 / h
    slips, sticks = (max(uniaxial, 1 / (1 / compress + 1 / out)) for out in (free, stuck))
    assert found.normal_n == pytest.approx(half_space_n(poisson) + slips)
    assert found.stick_n == pytest.approx(half_space_n(poisson) + max(slips, sticks))
    assert found.squeezed == pytest.approx(compress / (compress + free))
    assert found.squeezed_at_rim == pytest.approx(compress / (compress + flow))
    assert found.radius_mm == pytest.approx(RADIUS_MM)
    assert (found.area_mm2, found.depth_mm) == (AREA_MM2, DEPTH_MM)
    assert found.indentation == pytest.approx(DEPTH_MM / h)
    assert found.shear_n_per_mm == pytest.approx(
        shear * (AREA_MM2 / h + 8 * RADIUS_MM / (2 - poisson))
    )


def test_a_thick_gel_is_a_half_space_and_a_thin_one_is_compressed() -> None:
    """A thick layer adds what uniaxial compression of it would; a thin one cannot flow."""
    assert estimated(1e7, 0.45).normal_n == pytest.approx(half_space_n(0.45), rel=1e-5)
    thin = estimated(1e-4, 0.3)
    modulus = YOUNGS_MPA * 0.7 / (1.3 * 0.4)
    assert thin.normal_n == pytest.approx(modulus * VOLUME_MM3 / 1e-4, rel=1e-3)
    assert thin.squeezed < 1e-3


def test_a_layer_is_no_softer_than_in_uniaxial_stress() -> None:
    """Poisson's ratio 0 on a narrow contact of a thin layer: series stiffness below E V/h."""
    found = estimated(1.6, 0.0)
    assert found.normal_n == pytest.approx(half_space_n(0.0) + YOUNGS_MPA * VOLUME_MM3 / 1.6)


def test_no_contact_has_no_force() -> None:
    for tool, depth_mm in ((TOOL, 0.0), (TOOL, -0.3), (EMPTY, 0.4)):
        found = contact_estimate(tool, depth_mm, 2.0, YOUNGS_MPA, 0.4)
        depth_mm = max(depth_mm, 0.0)
        assert (found.depth_mm, found.indentation, found.strain) == (
            depth_mm, depth_mm / 2, depth_mm / 2,
        )  # fmt: skip
        assert (found.area_mm2, found.radius_mm, found.normal_n, found.stick_n) == (0, 0, 0, 0)
        assert (found.shear_n_per_mm, found.squeezed, found.squeezed_at_rim) == (0, 0, 0)


def test_strain_is_over_the_thickness_or_the_narrowest_width() -> None:
    assert estimated(1.0, 0.4).strain == pytest.approx(DEPTH_MM / 1.0)
    assert estimated(4.0, 0.4).strain == pytest.approx(DEPTH_MM / WIDTH_MM)


def test_sideways_is_of_the_depth_or_of_what_is_squeezed_out() -> None:
    """0.75 of the depth, or of 1.44 a d/h times the share squeezed out at the rim."""
    narrow = replace(estimated(2.0, 0.3), squeezed_at_rim=0.1)
    assert narrow.sideways_mm == pytest.approx(0.75 * DEPTH_MM)
    wide = replace(narrow, squeezed_at_rim=0.8, radius_mm=9.0, indentation=0.3)
    assert wide.sideways_mm == pytest.approx(0.75 * 1.44 * 0.8 * 9.0 * 0.3)


@pytest.mark.parametrize(
    ("indentation", "excess"),
    [(-0.2, 0.0), (0.0, 0.0), (0.025, 0.01), (0.05, 0.02), (0.1, 0.05), (0.15, 0.08),
     (0.2, 0.08 + 0.13 / 3), (0.4, 0.34), (0.5, 0.47), (0.6, 0.73), (0.7, 0.99)],
)  # fmt: skip
def test_the_table_is_linear_between_and_twice_as_steep_beyond(
    indentation: float, excess: float
) -> None:
    assert nonlinear_excess(indentation) == pytest.approx(excess, abs=1e-15)


@pytest.mark.parametrize("indentation", [1e-3, 0.2, 0.6, 0.8, 1.1])
def test_a_layer_squeezed_thin_stiffens_by_the_integral(indentation: float) -> None:
    """Mean of 1/(1 - e)³ on the way down, for the displaced share; up to 0.8 of the thickness."""
    e = min(indentation, 0.8)
    thinner = quad(lambda x: (1 - x) ** -3, 0, e)[0] / e - 1
    one = replace(estimated(2.0, 0.4), indentation=indentation, strain=0.3, squeezed=0.7)
    expected = 0.21 + 0.7 * max(0.0, thinner - 0.21)
    assert one.nonlinear_excess == pytest.approx(expected, rel=1e-9)
    assert replace(one, indentation=0.0).nonlinear_excess == pytest.approx(0.21)
