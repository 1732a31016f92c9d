"""Defocus: a slim finger is never sharp everywhere."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class DefocusParameters(EffectParameters):
    """Blur by defocus; aperture and focus stand in the sensor."""

    still_px: float = Field(
        default=0.0,
        ge=0,
        le=8,
        description="Blur in focus too, a standard deviation: aberrations, diffraction",
    )


def diameter_px(c: Circumstances) -> float:
    """Diameter of the disc with the spread of both, four standard deviations."""
    return math.hypot(c.blur_px, 4 * c.given("defocus", DefocusParameters).still_px)


EFFECT = Effect(
    name="defocus",
    title="Defocus",
    parameters=DefocusParameters,
    bound=lambda c: picture(diameter_px(c) / 4),
    formula="b/4: a disc of diameter b = f A |Z - s|/(Z s) spreads an edge over b",
    ladder=lambda c: (Rung("own blur per dot", Bound(), 0.5 + 1.0 * c.sensor.frame_px / 307200),),
    is_null=lambda c: diameter_px(c) == 0,
    implementation="gelslim_twin.render.defocus",
    refines=("image",),
    after=("shading", "dirt"),
)
