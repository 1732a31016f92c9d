"""Exposure: how bright the picture is, where it saturates, and its tone curve."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class ExposureParameters(EffectParameters):
    """A gain of 1 and a gamma of 1 leave the picture as it is."""

    gain: float = Field(default=1.0, gt=0, le=100, description="Brightness, 1 as drawn")
    gamma: float = Field(default=1.0, ge=0.2, le=5, description="Exponent of the tone curve")


def bound(c: Circumstances) -> Bound:
    """Grey share: |gain - 1|, at most all, and the tone curve's largest |v^g - v|."""
    p = c.given("exposure", ExposureParameters)
    tone = 0.0
    if p.gamma != 1:
        v = p.gamma ** (1 / (1 - p.gamma))
        tone = abs(v**p.gamma - v)
    return picture(c.edge_shift_px(min(1.0, abs(p.gain - 1)) + tone))


EFFECT = Effect(
    name="exposure",
    title="Exposure, saturation and tone curve",
    parameters=ExposureParameters,
    bound=bound,
    formula="(min(1, |gain - 1|) + largest |v^gamma - v|) of the grey range x width of an edge",
    ladder=lambda c: (Rung("per pixel", Bound(), 0.4 * c.sensor.frame_px / 307200),),
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.exposure",
    refines=("image",),
    after=("shading", "dirt", "defocus", "motion_blur"),
)
