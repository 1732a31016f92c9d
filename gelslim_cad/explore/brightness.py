"""Light of a design: the share that reaches the coat, its irradiance, and the frame rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gelslim_cad.geometry.led_strips import strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.light.exposure import exposure_at
from gelslim_cad.light.scene import NAMES

EXPOSED = (
    "camera.f_number",
    "camera.frame_rate_hz",
    "camera.full_well_e_um2",
    "camera.lens_transmission",
    "camera.quantum_efficiency",
    "design.leds.radiant_flux_mw",
)
"""What sets the exposure but not where the light goes."""
TRACED = tuple(n for n in NAMES if n not in EXPOSED)
RAYS = 1 << 13


@dataclass(frozen=True)
class Traced:
    """What one trace tells: share on the coat, W/mm² per W of the LEDs of each strip.

    `tip_per_w` is None without a strip at the tip.
    """

    on_coat: float
    left_per_w: float
    right_per_w: float
    tip_per_w: float | None = None


def trace(values: Mapping[str, Any], rays: int) -> Traced:
    """Trace the guide of a design given by `TRACED`; a fixed seed, so the same rays for all."""
    from gelslim_cad.geometry.optics import guide_profile
    from gelslim_cad.light.scene import light_scene
    from gelslim_optics.light.trace import trace_light

    light = trace_light(light_scene(values, guide_profile(values)), rays, threads=1)
    per_w = (float(light.irradiance(c).mean()) for c in strip_wavelengths_nm(values))
    return Traced(light.value("delivered"), *per_w)


def light_columns(d: Lookup, traced: Traced) -> dict[str, float]:
    """Share on the coat, µW/mm² on it (darkest colour), exposure and frame rate (slowest)."""
    tip = () if traced.tip_per_w is None else (traced.tip_per_w,)
    per_w = (traced.left_per_w, traced.right_per_w, *tip)
    found = [exposure_at(d, w, c) for c, w in zip(strip_wavelengths_nm(d), per_w, strict=True)]
    return {
        "light.on_coat": traced.on_coat,
        "light.irradiance_uw_mm2": min(e.irradiance_uw_mm2 for e in found),
        "light.exposure_ms": max(e.exposure_ms for e in found),
        "light.frame_rate_hz": min(e.frame_rate_hz for e in found),
    }
