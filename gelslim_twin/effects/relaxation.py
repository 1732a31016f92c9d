"""Viscoelastic relaxation: the force decays while the gel is held."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung


class PronyTerm(Block):
    """One term of the series."""

    fraction: Annotated[float, Field(ge=0, lt=1)] = Field(
        description="Share of the instantaneous stiffness that decays"
    )
    time_s: Annotated[float, Field(gt=0, le=1e7)] = Field(description="Time constant of the decay")


class RelaxationParameters(EffectParameters):
    """Prony series g(t) = 1 - sum of fraction (1 - exp(-t / time)); no terms, no relaxation."""

    terms: tuple[PronyTerm, ...] = Field(
        default=(), max_length=20, description="Terms of the Prony series"
    )

    @model_validator(mode="after")
    def _solid(self) -> RelaxationParameters:
        total = sum(term.fraction for term in self.terms)
        if total >= 1:
            raise FieldError(
                "terms", f"have fractions that sum to {total:g}, must be below 1", "lower them"
            )
        return self


def bound(c: Circumstances) -> Bound:
    """What decays from the first contact to the end of the motion, of the whole force.

    The force lost is a mean of past elastic forces, so no more than the largest. Where the depth
    is prescribed the surface stays as it is: stress alone relaxes.
    """
    terms = c.given("relaxation", RelaxationParameters).terms
    lost = sum(t.fraction * -math.expm1(-c.motion.contact_s / t.time_s) for t in terms)
    return Bound(force_n=lost * c.force_n * (1 + c.contact.nonlinear_excess))


EFFECT = Effect(
    name="relaxation",
    title="Viscoelastic relaxation, Prony series",
    parameters=RelaxationParameters,
    bound=bound,
    formula="F x sum of g (1 - exp(-T/tau)), T from first contact to the end",
    ladder=lambda c: (Rung("recursive", Bound(), 0.01 + 8e-5 * c.sensor.surface_nodes),),
    is_null=lambda c: all(
        t.fraction == 0 for t in c.given("relaxation", RelaxationParameters).terms
    ),
    implementation="gelslim_twin.contact.relaxation",
    needs=("poses",),
    refines=("force",),
    after=("friction", "nonlinearity"),
)
