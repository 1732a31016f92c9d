"""Drawn shading against the tracer's own sensitivity to the slope of the gel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from render_rig import AXIS_X, AXIS_Y, CAMERA
from test_render_light import tilted

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.trace import trace_light
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surroundings import Sight

DESIGNS = Path(__file__).parents[3] / "designs"
SLOPE = 0.01


@dataclass(frozen=True)
class Lit:
    """Light of a design on the pad of the test's camera."""

    traced: LightResult
    light: LightMap


def lit(name: str) -> Lit:
    d = derive(read_spec(DESIGNS / f"{name}.yaml").spec)
    traced = trace_light(light_scene(d, guide_profile(d)), 1 << 15)
    size = float(np.ptp(AXIS_X)), float(np.ptp(AXIS_Y))
    bins = np.stack([traced.irradiance(c) for c in traced.colours])
    return Lit(
        traced,
        LightMap.from_bins(
            bins, *size, azimuth_deg=[90, -90], elevation_deg=[25, 25], colour=np.eye(3)[:2],
            fans=traced.fans,
        ),
    )  # fmt: skip


@pytest.mark.parametrize("name", ["gelslim2", "mini20"])
def test_a_small_slope_changes_the_picture_as_the_tracer_says(name: str) -> None:
    """Over the whole pad: the mean of the drawn light against the mean over all rays."""
    made, sight = lit(name), Sight.of(CAMERA, 2)
    at = sight.rest_mm
    inside = (np.abs(at[..., 0]) < AXIS_X[-1]) & (np.abs(at[..., 1]) < AXIS_Y[-1])
    area = np.where(inside, sight.pixel_mm() ** 2, 0.0)[..., None]
    level = made.light.at(at[..., 0], at[..., 1]) * area
    up, down = (
        Shading(pixel_step=2, relief=False).gain(sight, tilted(0.0, s), made.light)
        for s in (SLOPE, -SLOPE)
    )
    change = ((up - down) * level).sum(axis=(0, 1)) / level.sum(axis=(0, 1)) / (2 * SLOPE)
    for k, colour in enumerate(made.traced.colours):
        expected = made.traced.slope_sensitivity(colour).value
        assert abs(expected) > 1.5
        assert change[k] == pytest.approx(expected, rel=0.03)
