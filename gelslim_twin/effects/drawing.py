"""The dots drawn: the picture itself."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, never_null, picture


class DrawingParameters(EffectParameters):
    """The dots as area of ink in each pixel, on the light of the guide."""

    level_dn: float = Field(
        default=80.0, gt=0, le=10_000, description="Grey value of the bare gel in full light"
    )
    contrast: float = Field(default=0.8, gt=0, le=1, description="Share of light the ink takes")


def bound(c: Circumstances) -> Bound:
    """Without it there is no picture."""
    return picture(c.sensor.marker_diameter_mm * c.sensor.px_per_mm)


EFFECT = Effect(
    name="drawing",
    title="Dots drawn",
    parameters=DrawingParameters,
    bound=bound,
    formula="diameter of a dot",
    ladder=lambda c: (Rung("exact area", Bound(), 5.0 * c.sensor.frame_px / 307200),),
    is_null=never_null,
    implementation="gelslim_twin.render.frame_renderer",
    needs=("markers",),
    provides=("image",),
)
