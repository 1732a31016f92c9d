"""The bends' radius: given, or the brightest that the finger's width leaves room for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.names import Name

LEAST, MOST, STEP = 0.5, 6.0, 0.25
GOOD_ENOUGH = 0.99
RAYS = 1 << 14
GIVEN: Name = "design.light_guide.bend_radius_ratio"
LIGHT_NAMES: tuple[Name, ...] = (
    "design.gel.length_mm",
    "design.gel.width_mm",
    "design.gel.thickness_mm",
    "design.gel.corner_radius_mm",
    "design.gel.crown_height_mm",
    "guide.flat_width_mm",
    "stack.gel_bottom_z_mm",
    "design.light_guide.thickness_mm",
    "design.light_guide.leg_length_mm",
    "design.light_guide.end_support_mm",
    "led.count",
    "led.pitch_mm",
    "design.leds.package_mm",
    "design.leds.emission",
    "design.leds.dome_half_angle_deg",
    "design.leds.emission_angle_deg",
    "design.leds.emission_intensity",
    "design.leds.red_wavelength_nm",
    "design.leds.green_wavelength_nm",
    "design.leds.blue_wavelength_nm",
    "design.leds.white_wavelength_nm",
    "design.leds.light",
    "design.leds.tip",
    "design.leds.one_wavelength_nm",
    "design.housing.fit_clearance_mm",
    "design.housing.side_wall_mm",
    "design.envelope.max_width_mm",
    "material.gel.refractive_index",
    "material.gel.coat_reflectance",
    "material.acrylic.refractive_index",
    "material.acrylic.absorption_per_m",
)
"""What the light and the widest bend depend on."""


@dimension(
    "guide.bend_ratio",
    formula="given; auto: least R/t within 1 % of the most light that max_width_mm has room for",
    source="docs/physics.md#light",
    inputs=(GIVEN, *LIGHT_NAMES),
)
def guide_bend_ratio(values: Mapping[str, Any]) -> Real:
    """Inner bend radius over guide thickness, R/t."""
    if not chosen_here(values[GIVEN]):
        return values[GIVEN]
    # The guide's own extent follows from the fold, which needs the bends: take the gel's.
    end = values["design.gel.length_mm"] / 2 + 0.2 + values["design.light_guide.end_support_mm"]
    inputs = {name: values[name] for name in LIGHT_NAMES}
    rows = [
        brightest_ratio(row)
        for row in _rows(inputs | {"guide.proximal_end_x_mm": -end, "guide.distal_end_x_mm": end})
    ]
    return rows[0] if len(rows) == 1 else np.array(rows)


def chosen_here(value: Any) -> bool:
    """Whether the ratio is left to be found from the light: `auto`."""
    return isinstance(value, str) and value == "auto"


def _rows(inputs: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One mapping of plain values per design; arrays (n,) vary, the rest is shared."""
    count = max([1, *(v.size for v in inputs.values() if isinstance(v, np.ndarray))])
    return [{name: _at(value, i) for name, value in inputs.items()} for i in range(count)]


def _at(value: Any, row: int) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    return float(np.ravel(value)[row if value.size > 1 else 0])


def brightest_ratio(values: Mapping[str, Any]) -> float:
    """Least R/t whose light is within 1 % of the most.

    `values` holds what `light_scene` and `curved_guide` look up by dotted name, with side wall
    and envelope.max_width_mm; wider bends than that allows are not tried, but at least R/t = 0.5.
    """
    return _brightest(tuple(sorted(values.items())))


@lru_cache(maxsize=4096)
def _brightest(items: tuple[tuple[str, Any], ...]) -> float:
    from gelslim_cad.geometry.optics import curved_guide, gel_section
    from gelslim_cad.light.scene import light_scene
    from gelslim_optics.guide.shapes import curved_profile
    from gelslim_optics.light.trace import trace_light

    values = dict(items)
    own = curved_guide({**values, "guide.inner_radius_mm": LEAST})
    gel, ratios = gel_section(values), candidates(values)
    light = []
    for ratio in ratios:
        profile = curved_profile(replace(own, inner_radius_mm=ratio * own.thickness_mm), gel)
        scene = light_scene(values, profile, sides_only=True)
        light.append(trace_light(scene, RAYS).value("delivered"))
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
