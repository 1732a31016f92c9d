"""The light of the deep contacts against closed forms, and against the traced light."""

from __future__ import annotations

import numpy as np
import pytest
from guided_light import AMBIENT_SHARE, FANS, guided_bundle, irradiance, sensitivity
from traced_light import AROUND, directions, traced_bundle, traced_irradiance
from traced_light import sensitivity as traced_sensitivity
from traced_light import traced as traced_sums

from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_map import LightMap

CELL_MM = 0.1
TRACED = {-1.2: 2.42, -0.8: 2.20, -0.4: 1.75, 0.4: 0.45, 0.8: 0.38, 1.2: 0.38}
"""Light of gelslim2 as traced, with 0.12 of ambient light, over that of a level coat by its rise
along the light."""


def facet(rise: float) -> float:
    """Irradiance of a facet by the light that travels along y; without its shadow on others."""
    flat = np.zeros((1, 1))
    return float(irradiance(flat, (flat, flat + rise), CELL_MM)[0, 0, 0])


def test_small_slopes_change_the_light_by_its_sensitivity() -> None:
    assert sum(share for _, _, share in FANS) == pytest.approx(1)
    assert (facet(1e-4) - facet(-1e-4)) / 2e-4 == pytest.approx(-sensitivity(), rel=1e-4)
    directions = LightMap.from_arrays(guided_bundle(0.45).light).directions
    np.testing.assert_allclose(directions[:, 1] / directions[:, 2], [sensitivity(), -sensitivity()])


def test_it_is_near_the_traced_light_and_near_the_law() -> None:
    law = LightLaw(np.array([[0.0, sensitivity()]]))
    for rise, traced in TRACED.items():
        assert facet(rise) == pytest.approx(traced, abs=0.08)
        value, _ = law.irradiance(np.array([[0.0, rise]]))
        assert facet(rise) == pytest.approx(value.item(), abs=0.1)


def test_a_wall_casts_a_shadow_as_long_as_its_height_over_the_tangent() -> None:
    height = np.zeros((3, 121))
    height[:, :21] = -0.4  # it hangs into the gel, and the light along +y comes from its side
    flat = np.zeros_like(height)
    light = irradiance(height, (flat, flat), CELL_MM)[1]
    behind = (np.arange(121) - 20) * CELL_MM
    for elevation in {e for e, azimuth, _ in FANS if azimuth == 0}:
        length = 0.4 / np.tan(np.radians(elevation))
        near, far = (light[np.argmin(abs(behind - length * k))] for k in (0.8, 1.2))
        assert near[0] < far[0] - 0.02
    assert light[22, 0] < AMBIENT_SHARE + 0.2 * (1 - AMBIENT_SHARE)
    np.testing.assert_allclose(light[30:, 1], 1.0)  # the light along -y sees no wall


def test_drawn_directions_are_the_traced_light_and_no_bins_of_the_bundle() -> None:
    """Facets are lit as by all traced directions; small slopes count as in the bundle's trace."""
    level = np.zeros((1, 1))
    for sums, drawn, source in zip(traced_sums(fine=True), directions(), (0, 1), strict=True):
        assert drawn[:, 0].sum() == pytest.approx(1)
        bundle = LightMap.from_arrays(traced_bundle(0.45, fans=True).light)
        own = bundle.light_fans.sums[source, 0, 0]
        lit = own[own[:, 0] > 0]
        ways = lit[:, 1:] / lit[:, :1]
        apart = np.hypot(*np.moveaxis(drawn[:, None, 1:] - ways, 2, 0)).min(axis=1)
        assert len(drawn) % AROUND == 0
        assert (apart > 1e-3).mean() > 0.9
        for rise in (-1.2, -0.4, 0.4, 1.2):
            every = np.maximum(sums[:, 0] - rise * sums[:, 2], 0).sum() / np.hypot(1, rise)
            expected = AMBIENT_SHARE + (1 - AMBIENT_SHARE) * every
            slope = level, level + rise
            found = traced_irradiance(level, slope, CELL_MM)[0, 0, source]
            assert found == pytest.approx(expected, abs=0.03)
    fine, coarse = (traced_sensitivity(traced_sums(fine=f)) for f in (True, False))
    np.testing.assert_allclose(fine, coarse, atol=0.02)
