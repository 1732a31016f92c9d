"""By how much the slopes of a state change the light, without a picture of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gelslim_twin.render.surroundings import Sight

if TYPE_CHECKING:
    from gelslim_twin.render.frame_renderer import FrameRenderer
    from gelslim_twin.render.surface_state import SurfaceState

LIT = 0.05
"""Share of the usual light below which a change of it does not count."""


def changed_share(renderer: FrameRenderer, surface: SurfaceState, pixel_step: int) -> float:
    """Largest change of the light on the gel, as a share of the light at rest.

    It is that of the sum of the channels, at every `pixel_step`-th pixel that is lit.

    Args:
        renderer: Draws the sensor with shading, without dirt and defocus, which would soften it.
        surface: The state.
        pixel_step: Pixels from one value to the next.
    """
    surface = surface if renderer.top is None else renderer.top.carrying(surface)
    every = slice(None, None, pixel_step)
    rays = renderer.sight.rest_mm, renderer.sight.slope
    rest_mm, slope = (np.ascontiguousarray(a[every, every]) for a in rays)
    gain = renderer.gain(Sight(rest_mm, slope, pixel_step), surface)
    light = renderer.still[every, every] * renderer.colour.sum(axis=1)
    whole, change = light.sum(axis=2), (light * (gain - 1)).sum(axis=2)
    lit = whole > LIT * np.median(whole)
    return float((np.abs(change[lit]) / whole[lit]).max(initial=0.0))
