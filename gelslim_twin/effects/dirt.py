"""Dirt on the gel and bright reflections of the LEDs."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class DirtParameters(EffectParameters):
    """Specks and glints; none by default."""

    specks: int = Field(default=0, ge=0, le=10_000, description="Dark specks on the gel")
    speck_mm: float = Field(default=0.15, gt=0, le=5, description="Mean diameter of a speck")
    glint_percent: float = Field(
        default=0.0, ge=0, le=100, description="Brightness of the LEDs' reflections"
    )


def bound(c: Circumstances) -> Bound:
    """A speck hides as much as a dot's edge of its own diameter; a glint adds its brightness."""
    p = c.given("dirt", DirtParameters)
    speck = p.speck_mm * c.sensor.px_per_mm if p.specks else 0.0
    return picture(max(speck, c.edge_shift_px(p.glint_percent / 100)))


EFFECT = Effect(
    name="dirt",
    title="Dirt and specular reflections",
    parameters=DirtParameters,
    bound=bound,
    formula="diameter of a speck, or brightness of a glint x width of an edge",
    ladder=lambda c: (Rung("drawn", Bound(), 0.8 * c.sensor.frame_px / 307200),),
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.dirt",
    refines=("image",),
    after=("shading",),
)
