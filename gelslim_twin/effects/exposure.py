"""Exposure: how bright the picture is, where it saturates, and the camera's response."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.defocus import diameter_px
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class ExposureParameters(EffectParameters):
    """All of them 1 leave the picture as it is."""

    time: float = Field(default=1.0, gt=0, le=1000, description="Exposure time over the usual one")
    gain: float = Field(default=1.0, gt=0, le=1000, description="Amplification, of noise as well")
    gamma: float = Field(
        default=1.0, ge=0.2, le=5, description="The response has the exponent 1/gamma"
    )


def toned(share: float, gamma: float) -> float:
    """Grey over white of a light over what saturates."""
    return float(min(1.0, share) ** (1 / gamma))


def bound(c: Circumstances) -> Bound:
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
    width = math.hypot(1.0, diameter_px(c))
    return picture(width * min(1.0, changed))


EFFECT = Effect(
    name="exposure",
    title="Exposure, saturation and response",
    parameters=ExposureParameters,
    bound=bound,
    formula="min(1, |time gain - 1| + largest |v^(1/gamma) - v|) x width of an edge",
    ladder=lambda c: (Rung("per pixel", Bound(), 0.4 * c.sensor.frame_px / 307200),),
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.exposure",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur"),
)
