"""The light of a finger's guide on its untouched gel, as bundle and twin know it."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.guide_section import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_optics.light.light_map import LED_COLOURS, LightMap

RAYS = 1 << 16
RED_SHARE = 0.45
"""Red is seen weaker than green on published pictures of this finger."""
ELEVATION_DEG = 25.0
"""Mean angle at which the light rises through the gel; the tracer does not record directions."""
SMOOTHING_MM = 0.6


def pad_light(d: Dimensions) -> LightMap:
    """Trace the light of the guide on the untouched gel.

    Args:
        d: The dimensions of the finger.

    Returns:
        Irradiance and direction of the red and the green light over the pad.
    """
    from gelslim_optics.light.trace import trace_light

    traced = trace_light(light_scene(d, guide_profile(d)), RAYS, seed=0)
    return LightMap.from_bins(
        np.stack([RED_SHARE * traced.irradiance("red"), traced.irradiance("green")]),
        float(d["design.gel.length_mm"]),
        float(d["design.gel.width_mm"]),
        azimuth_deg=np.array([90.0, -90.0]),
        elevation_deg=np.full(2, ELEVATION_DEG),
        colour=LED_COLOURS,
        smooth_mm=SMOOTHING_MM,
    )
