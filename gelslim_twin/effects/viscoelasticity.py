"""A viscoelastic gel in contact, whose forces and shape depend on their history, as an effect."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from gelslim_core.yaml.errors import FieldError
from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact import PronyTerm
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry

STEPS = (1, 2, 4, 8, 16)
"""Steps to each pose."""
COURSE = 0.5
"""Error of a step over the viscoelastic part of force or depth, and over the squared share of the
indentation or of the contact's radius that one step covers. Solved contacts (a ball pressed,
raised and slid; time constants from 0.03 to 30 times the duration) reach 0.16."""
STEP_MS = 1.4
"""Time of one more contact, on a pad of 43 x 43 x 4 nodes."""


class ViscoelasticityParameters(EffectParameters):
    """The Prony series g(t) = 1 - sum of fraction (1 - exp(-t / time)) of all moduli.

    The modulus of the sensor's gel is that of a sudden load. Without terms the gel is elastic.
    """

    terms: tuple[PronyTerm, ...] = Field(
        default=(), max_length=20, description="Terms of the Prony series"
    )

    @model_validator(mode="after")
    def _solid(self) -> ViscoelasticityParameters:
        total = sum(term.fraction for term in self.terms)
        if total >= 1:
            raise FieldError(
                "terms", f"have fractions that sum to {total:g}, must be below 1", "lower them"
            )
        return self


def _terms(c: Circumstances) -> tuple[PronyTerm, ...]:
    return c.given("viscoelasticity", ViscoelasticityParameters).terms


def lost_share(c: Circumstances) -> float:
    """Share of the stiffness that decays from the first contact to the end of the motion.

    It is also the largest share of the indentation that a tool leaves behind: a gel that has
    relaxed by that share springs back by the rest at once.
    """
    return sum(t.fraction * -math.expm1(-c.motion.contact_s / t.time_s) for t in _terms(c))


def viscoelasticity_bound(c: Circumstances) -> Bound:
    """The force that decays, and the dent that is left where the tool has been.

    Where the contact only grows without friction, the surface is that of an elastic gel (Lee and
    Radok 1960).
    """
    lost = lost_share(c)
    force_n = lost * c.force_n * (1 + c.contact.nonlinear_excess)
    grows = c.motion.is_straight and not c.motion.recedes and c.friction == 0
    if grows or c.contact.area_mm2 == 0:
        return Bound(force_n)
    dent_mm = math.hypot(c.contact.depth_mm, c.contact.sideways_mm)
    return geometry(lost * dent_mm * c.sensor.px_per_mm, force_n)


def viscoelasticity_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Steps to each pose: over a step the forces of the elastic gel run straight."""
    whole, nodes = viscoelasticity_bound(c), c.sensor.surface_nodes * c.sensor.layers / (43**2 * 4)
    memory_ms = 0.02 + 1e-5 * len(_terms(c)) * c.sensor.surface_nodes
    covered = 0.0
    if c.contact.area_mm2 > 0:
        covered = c.motion.step_mm / c.contact.depth_mm + c.motion.step_aside_mm / (
            c.contact.radius_mm
        )
    return tuple(
        Rung(
            "1 step per pose" if count == 1 else f"{count} steps per pose",
            whole.times(min(1.0, COURSE * (covered / count) ** 2)),
            count * memory_ms + (count - 1) * STEP_MS * nodes,
            {"steps": count},
        )
        for count in STEPS
    )


VISCOELASTICITY = Effect(
    name="viscoelasticity",
    description="Linear viscoelastic gel: force and shape of the contact depend on its history, "
    "and a dent recovers after the release",
    parameters=ViscoelasticityParameters,
    bound=viscoelasticity_bound,
    formula="sum of g (1 - exp(-T/tau)) of the force and, where the contact recedes, of the depth",
    ladder=viscoelasticity_ladder,
    does_nothing=lambda c: all(term.fraction == 0 for term in _terms(c)),
    implementation="gelslim_twin.contact.viscoelastic_contact",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
