"""Mirror images of the lamps in the window."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class SpecularParameters(EffectParameters):
    """None unless spots are given."""

    spots: int = Field(default=0, ge=0, le=10_000, description="Bright spots")
    brightness_percent: float = Field(
        default=80.0, ge=0, le=1000, description="Of white, at the middle of the brightest"
    )
    radius_px: float = Field(default=2.0, gt=0, le=200, description="Radius of a usual spot")


def bound(c: Circumstances) -> Bound:
    """Brightness over the grey range times the width of an edge, at most the spot's width."""
    p = c.given("specular", SpecularParameters)
    if p.spots == 0:
        return Bound()
    return picture(min(c.edge_shift_px(p.brightness_percent / 100), 3 * p.radius_px))


EFFECT = Effect(
    name="specular",
    title="Specular reflections",
    parameters=SpecularParameters,
    bound=bound,
    formula="brightness of a spot x width of an edge, at most the spot's width",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.3 * c.sensor.frame_px / 307200),),
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.specular",
    refines=("image",),
    after=("shading", "dirt", "defocus"),
)
