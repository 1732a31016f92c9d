"""Specks and hairs between gel and camera."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class DirtParameters(EffectParameters):
    """None unless specks or hairs are given."""

    specks: int = Field(default=0, ge=0, le=10_000, description="Dark specks")
    hairs: int = Field(default=0, ge=0, le=10_000, description="Dark hairs")
    speck_mm: float = Field(default=0.25, gt=0, le=5, description="Largest diameter of a speck")
    hair_mm: float = Field(default=2.5, gt=0, le=50, description="Length of a hair")
    opacity: float = Field(default=0.6, ge=0, le=1, description="Share of the light they take")


def bound(c: Circumstances) -> Bound:
    """What a speck hides, its diameter; a hair is a tenth of a speck wide."""
    p = c.given("dirt", DirtParameters)
    wide = p.speck_mm if p.specks else p.speck_mm / 10 if p.hairs else 0.0
    return picture(p.opacity * wide * c.sensor.px_per_mm)


EFFECT = Effect(
    name="dirt",
    title="Dirt",
    parameters=DirtParameters,
    bound=bound,
    formula="opacity x diameter of a speck x f/Z",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.01),),
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.dirt",
    refines=("image",),
    after=("shading",),
)
