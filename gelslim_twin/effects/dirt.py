"""Specks and hairs between gel and camera."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import contrast, dot_px
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class DirtParameters(EffectParameters):
    """None unless specks or hairs are given."""

    specks: int = Field(default=0, ge=0, le=10_000, description="Dark specks")
    hairs: int = Field(default=0, ge=0, le=10_000, description="Dark hairs")
    speck_mm: float = Field(default=0.25, gt=0, le=5, description="Largest diameter of a speck")
    hair_mm: float = Field(default=2.5, gt=0, le=50, description="Length of a hair")
    opacity: float = Field(default=0.6, ge=0, le=1, description="Share of the light they take")


def bound(c: Circumstances) -> Bound:
    """What a speck hides, its diameter; a hair is at most a fifth of a speck wide.

    It counts by how dark it is against the ink. At most half of a dot and half of the speck, the
    distance of their middles.
    """
    p = c.given("dirt", DirtParameters)
    wide = p.speck_mm if p.specks else p.speck_mm / 5 if p.hairs else 0.0
    seen = wide * c.sensor.px_per_mm
    return picture(min(p.opacity / contrast(c) * seen, (dot_px(c) + seen) / 2) if seen else 0.0)


def is_null(c: Circumstances) -> bool:
    """Whether the picture stays clean."""
    p = c.given("dirt", DirtParameters)
    return p.specks + p.hairs == 0 or p.opacity == 0


EFFECT = Effect(
    name="dirt",
    title="Dirt",
    parameters=DirtParameters,
    bound=bound,
    formula="opacity over the ink's contrast x diameter of a speck x f/Z",
    ladder=lambda c: (Rung("drawn once", Bound(), 0.01),),
    is_null=is_null,
    implementation="gelslim_twin.render.dirt",
    refines=("image",),
    after=("shading",),
)
