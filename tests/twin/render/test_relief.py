"""Shadows cast on the gel and the parallax of its light against closed forms for one beam."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.relief import BIN_WIDTH
from gelslim_twin.render.shading import relief_on
from gelslim_twin.render.surface_state import SurfaceState

Array = NDArray[np.float64]
STEP_MM, RISE = 0.25, np.tan(np.radians(25.0))
AXIS = np.arange(-10, 10 + STEP_MM / 2, STEP_MM)


def beams(azimuth_deg: float, fall_per_mm: float = 0.0) -> LightMap:
    """One beam at 25°, brighter by a constant ratio per mm against its travel."""
    turn = np.radians(azimuth_deg)
    x, y = np.meshgrid(AXIS, AXIS)
    level = np.exp(-fall_per_mm * (x * np.cos(turn) + y * np.sin(turn)))
    return LightMap(AXIS, AXIS, level[..., None], [azimuth_deg], [25.0], np.eye(3)[:1])


def relief(light: LightMap, height: Array, rest_mm: Array | None = None) -> Array:
    state = SurfaceState(AXIS, AXIS, np.stack([0 * height, 0 * height, height], axis=2))
    factor, origin, step = relief_on(light, state, rest_mm)
    assert origin == pytest.approx([AXIS[0], AXIS[0]])
    assert step == pytest.approx([STEP_MM, STEP_MM])
    return factor[..., 0]


@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0, -90.0, 180.0, 45.0])
def test_a_bar_casts_a_shadow_as_long_as_its_depth_over_the_rise(azimuth_deg: float) -> None:
    depth, turn = 0.8, np.radians(azimuth_deg)
    x, y = np.meshgrid(AXIS, AXIS)
    along = x * np.cos(turn) + y * np.sin(turn)
    height = np.where(np.abs(along) < 1, -depth, 0.0)
    left = relief(beams(azimuth_deg), height)
    inner = (np.abs(x) < 6) & (np.abs(y) < 6)
    # The horizon falls with the distance from the bar; soft within a bin's breadth of the rise.
    last = along[height < 0].max()
    dark = inner & (along > last + 2 * STEP_MM) & (along - last < depth / (RISE + BIN_WIDTH))
    lit = inner & ((along < -1.5) | (along - last > depth / (RISE - BIN_WIDTH) + 2 * STEP_MM))
    assert dark.sum() > 50
    assert left[dark].max() < 0.05
    assert np.abs(left[lit] - 1).max() < 1e-6


def test_a_lowered_place_gets_the_light_on_its_way_to_farther_on() -> None:
    depth, fall = 0.2, 0.05
    lowered = relief(beams(90.0, fall), np.full((len(AXIS), len(AXIS)), -depth))
    assert lowered[20:-20, 20:-20] == pytest.approx(np.exp(-fall * depth / RISE), rel=1e-3)


def test_a_crown_at_rest_and_a_level_gel_change_nothing() -> None:
    x, y = np.meshgrid(AXIS, AXIS)
    crown = 0.8 * (1 - (x / 20) ** 2 - (y / 20) ** 2)
    assert (relief(beams(90.0, 0.1), 0 * x) == 1).all()
    assert (relief(beams(90.0, 0.1), crown, crown) == 1).all()
