"""Mirror images of the lamps in the window."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import contrast, dot_px, edge_px, least_light_dn
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class SpecularParameters(EffectParameters):
    """None unless spots are given."""

    spots: int = Field(default=0, ge=0, le=10_000, description="Bright spots")
    brightness_percent: float = Field(
        default=80.0, ge=0, le=1000, description="Of white, at the middle of the brightest"
    )
    radius_px: float = Field(default=2.0, gt=0, le=200, description="Radius of a usual spot")


def is_null(c: Circumstances) -> bool:
    """Whether there is no spot to see."""
    p = c.given("specular", SpecularParameters)
    return p.spots == 0 or p.brightness_percent == 0


def bound(c: Circumstances) -> Bound:
    """Brightness over the least contrast of a dot times the width of an edge.

    A spot in a lamp's tint has that brightness in one channel and half in the others, twice in all.
    At most the largest spot's width.
    """
    p = c.given("specular", SpecularParameters)
    if is_null(c):
        return Bound()
    added = 2 * p.brightness_percent / 100 * 255
    light = contrast(c) * least_light_dn(c)
    return picture(min(edge_px(c) * added / light, dot_px(c), 3 * p.radius_px))


EFFECT = Effect(
    name="specular",
    title="Specular reflections",
    parameters=SpecularParameters,
    bound=bound,
    formula="2 x brightness of a spot over the least contrast x width of an edge, at most the spot",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.3 * c.sensor.frame_px / 307200),),
    is_null=is_null,
    implementation="gelslim_twin.render.specular",
    refines=("image",),
    after=("shading", "dirt", "defocus"),
)
