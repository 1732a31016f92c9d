"""What a change of grey is worth in pixels: against the contrast of the dots, where it is weakest.

A picture is read by its dots, on the sum of the colour channels. A change of grey by v shifts the
edge of a dot by at most v over the slope of the edge, contrast over width; and a dot that is
shifted by its own diameter is no longer that dot.
"""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.defocus import diameter_px
from gelslim_twin.effects.drawing import DrawingParameters
from gelslim_twin.effects.exposure import ExposureParameters, toned

LEAST_LIGHT = 0.35
"""Light on the darkest dots, over the mean of a lamp, summed over the channels: the traced guides
of the designs leave 0.48 to 0.64 to all but a hundredth of the pad, and the lens takes up to a
quarter at the corners of the picture."""


def edge_px(c: Circumstances) -> float:
    """Width over which the edge of a dot turns from dark to bright: blur, at least a pixel."""
    return math.hypot(1.0, diameter_px(c))


def dot_px(c: Circumstances) -> float:
    """Diameter of a dot where it is seen largest."""
    return c.sensor.marker_diameter_mm * c.sensor.px_per_mm


def least_light_dn(c: Circumstances) -> float:
    """Grey value of the bare gel in the least light at the usual exposure."""
    return LEAST_LIGHT * c.given("drawing", DrawingParameters).level_dn


def contrast(c: Circumstances) -> float:
    """Share of the light that the ink takes."""
    return c.given("drawing", DrawingParameters).contrast


def least_contrast_dn(c: Circumstances) -> float:
    """What a dot lacks in grey values in the least light, after exposure and response."""
    p = c.given("exposure", ExposureParameters)
    bare = least_light_dn(c) * p.time * p.gain / 255
    return 255 * (toned(bare, p.gamma) - toned(bare * (1 - contrast(c)), p.gamma))


def shift_px(c: Circumstances, light_share: float) -> float:
    """Shift of a dot's edge by a change of the light by `light_share` of itself."""
    return min(dot_px(c), edge_px(c) * light_share / contrast(c))


def grey_shift_px(c: Circumstances, grey_dn: float) -> float:
    """Shift of a dot's edge by grey values added to the finished picture."""
    least = least_contrast_dn(c)
    return min(dot_px(c), edge_px(c) * grey_dn / least) if least > 0 else dot_px(c)
