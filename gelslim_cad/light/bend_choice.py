"""The bend radius that brings most light to the gel's coat, found by ray tracing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gelslim_cad.geometry.guide_section import curved_guide, gel_section
from gelslim_cad.light.scene import light_scene
from gelslim_optics.guide.shapes import curved_profile
from gelslim_optics.light.trace import trace_light

LEAST, MOST, STEP = 0.5, 6.0, 0.25
GOOD_ENOUGH = 0.99
RAYS = 1 << 14


def brightest_ratio(values: Mapping[str, Any]) -> float:
    """Least R/t whose light is within 1 % of the most.

    `values` holds what `light_scene` and `curved_guide` look up by dotted name, with side wall
    and envelope.max_width_mm; wider bends than that allows are not tried, but at least R/t = 0.5.
    """
    return _brightest(tuple(sorted(values.items())))


@lru_cache(maxsize=4096)
def _brightest(items: tuple[tuple[str, Any], ...]) -> float:
    values = dict(items)
    own = curved_guide({**values, "guide.inner_radius_mm": LEAST})
    gel, ratios = gel_section(values), candidates(values)
    light = []
    for ratio in ratios:
        profile = curved_profile(replace(own, inner_radius_mm=ratio * own.thickness_mm), gel)
        light.append(trace_light(light_scene(values, profile), RAYS).value("delivered"))
    enough = np.asarray(light) >= GOOD_ENOUGH * max(light)
    return float(ratios[int(np.argmax(enough))])


def candidates(values: Mapping[str, Any]) -> list[float]:
    """Ratios R/t to try, in ascending order, up to the largest that the width allows."""
    limit, most = values["design.envelope.max_width_mm"], MOST
    if limit is not None:
        t = values["design.light_guide.thickness_mm"]
        wall = values["design.housing.side_wall_mm"] + values["design.housing.fit_clearance_mm"]
        radius = limit / 2 - wall - t - values["guide.flat_width_mm"] / 2
        most = min(MOST, radius / t)
    steps = [float(r) for r in np.arange(LEAST, most, STEP)]
    last = [] if most < LEAST else [int(most * 1000) / 1000]
    return [*(s for s in steps if not last or s < last[0]), *last] or [LEAST]
