"""The drawn dots, their blur and their brightness, and the shift that a change of grey stands for.

A picture is evaluated by its dots, on the sum of the colour channels. A change of grey by v shifts
the edge of a dot by at most v over the slope of the edge, which is contrast over width. The darkest
place of the picture counts, where the contrast is least. A dot that is shifted by its own diameter
is no longer that dot, so that the shift is at most this diameter.
"""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class DrawingParameters(EffectParameters):
    """The dots are drawn as exact areas of ink, lit by the light of the guide."""

    level_dn: float = Field(
        default=80.0, gt=0, le=10_000, description="Grey value of the bare gel in full light"
    )
    contrast: float = Field(default=0.8, gt=0, le=1, description="Share of light that ink absorbs")


def dot_px(c: Circumstances) -> float:
    """Diameter of a dot where it is seen largest."""
    return c.sensor.marker_diameter_mm * c.sensor.px_per_mm


DRAWING = Effect(
    name="drawing",
    description="The picture of the printed dots",
    parameters=DrawingParameters,
    bound=lambda c: picture(dot_px(c)),
    formula="diameter of a dot",
    ladder=lambda c: (Rung("exact area", Bound(), 5.0 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.frame_renderer",
    needs=("markers",),
    provides=("image",),
)


class DefocusParameters(EffectParameters):
    """Blur by defocus. Aperture and focus distance are those of the sensor."""

    still_px: float = Field(
        default=0.0,
        ge=0,
        le=8,
        description="Standard deviation of the blur in focus, from aberrations and diffraction",
    )


def diameter_px(c: Circumstances) -> float:
    """Diameter of the disc with the spread of both, four standard deviations."""
    return math.hypot(c.blur_px, 4 * c.given("defocus", DefocusParameters).still_px)


def edge_px(c: Circumstances) -> float:
    """Width over which the edge of a dot turns from dark to bright: blur, at least a pixel."""
    return math.hypot(1.0, diameter_px(c))


DEFOCUS = Effect(
    name="defocus",
    description="Blur of the parts of the gel that are out of focus",
    parameters=DefocusParameters,
    bound=lambda c: picture(diameter_px(c) / 4),
    formula="b/4: a disc of diameter b = f A |Z - s|/(Z s) spreads an edge over b",
    ladder=lambda c: (Rung("own blur per dot", Bound(), 0.5 + 1.0 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.defocus",
    refines=("image",),
    after=("shading", "dirt"),
    is_scattered=True,
)


class ExposureParameters(EffectParameters):
    """With all values at 1 the picture stays as it is."""

    time: float = Field(default=1.0, gt=0, le=1000, description="Exposure time over the normal one")
    gain: float = Field(default=1.0, gt=0, le=1000, description="Amplification of signal and noise")
    gamma: float = Field(
        default=1.0, ge=0.2, le=5, description="Inverse of the exponent of the response curve"
    )


def toned(share: float, gamma: float) -> float:
    """Grey over white of a light over what saturates."""
    return float(min(1.0, share) ** (1 / gamma))


def exposure_bound(c: Circumstances) -> Bound:
    """The whole width of an edge: brighter everywhere, edges stay between dark and bright.

    Exposure and response change the grey values of the two sides of an edge and of what lies
    between in the same order; of the width, the share by which they change them, at most all:
    |time gain - 1| and the largest |v^e - v| of the response.
    """
    p = c.given("exposure", ExposureParameters)
    tone, exponent = 0.0, 1 / p.gamma
    if exponent != 1:
        v = exponent ** (1 / (1 - exponent))
        tone = abs(v**exponent - v)
    changed = abs(p.time * p.gain - 1) + tone
    return picture(edge_px(c) * min(1.0, changed))


EXPOSURE = Effect(
    name="exposure",
    description="Exposure, saturation and response curve of the camera",
    parameters=ExposureParameters,
    bound=exposure_bound,
    formula="min(1, |time gain - 1| + largest |v^(1/gamma) - v|) x width of an edge",
    ladder=lambda c: (Rung("per pixel", Bound(), 0.4 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.image_sensor",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur"),
    is_scattered=True,
)


LEAST_LIGHT = 0.35
"""Light on the darkest dots, over the mean of a lamp, summed over the channels: the traced guides
of the designs leave 0.48 to 0.64 to all but a hundredth of the pad, and the lens takes up to a
quarter at the corners of the picture."""


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
