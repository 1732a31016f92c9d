"""Effects of the contact: normal contact, friction and relaxation of the gel."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact_estimate import RIDGES
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from ifem_export.compliance.table_size import has_room

# The tolerance applies to the field of forces. Displacements err by more, because a node at the
# border of the contact or under a ridge may change its contact status within the tolerance. In
# solved contacts (eleven scenes of the gallery, with and without friction, tolerances from 1e-2 to
# 1e-5 against 1e-7, worst node of the worst pose) this error falls with the square root of the
# tolerance. The estimate does not cover walls of a tool that slide over nodes: there the set of
# nodes in contact is sensitive to differences smaller than any tolerance of the ladder.
RUNGS = (("coarse", 1e-2), ("medium", 1e-3), ("fine", 1e-4), ("finer", 1e-5), ("finest", 1e-6))
PLACES, MOST_PLACES = 0.14, 1.1
"""Error of displacements over depth and root of the tolerance: wide tools, ridges and tips."""
FORCE, MOST_FORCE = 0.07, 0.15
"""Error of the resultant over the normal force and the root of the tolerance, likewise."""
NARROW = 3.5
"""Nodes across a tool below which it counts as a tip: 3 nodes across a cone show the full error."""
FEW = 50.0
"""Nodes in contact above which the error of a tip decreases: many tips support each other."""

FINE_MS = 15.0
"""Time of a pose on a fine pad over that of its nodes relative to 43 x 43 x 4."""


def solver_error(c: Circumstances, tolerance: float) -> Bound:
    """Error of displacements and of the resultant at a tolerance of the solver."""
    if c.contact.area_mm2 == 0:
        return Bound()
    across = c.footprint.width_mm(c.contact.depth_mm) / c.sensor.node_pitch_mm
    tip = (NARROW / max(NARROW, across)) ** 2 * FEW / max(FEW, c.contact_nodes)
    root = math.sqrt(tolerance)
    places = root * max(PLACES, MOST_PLACES * tip) * c.contact.depth_mm * c.sensor.px_per_mm
    return geometry(places, root * max(FORCE, MOST_FORCE * tip) * c.normal_n)


def normal_contact_bound(c: Circumstances) -> Bound:
    """The whole force, and the displacement of the surface, downwards and sideways."""
    px = math.hypot(c.contact.depth_mm, c.contact.sideways_mm) * c.sensor.px_per_mm
    return Bound(RIDGES * c.contact.normal_n, px, px, px)


def normal_contact_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Relative tolerance of the field of forces.

    The time grows with the square of the nodes in contact, whose compliance is dense. On pads too
    fine for that it grows with the nodes of the whole pad.
    """
    nodes = c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    is_dense = has_room(c.sensor.surface_nodes)
    more_ms = c.contact_nodes**2 / 1e4 if is_dense else FINE_MS * nodes
    return tuple(
        Rung(name, solver_error(c, tolerance), ms * nodes + more_ms, {"tolerance": tolerance})
        for (name, tolerance), ms in zip(RUNGS, (1.2, 1.3, 1.5, 1.8, 2.1), strict=True)
    )


NORMAL_CONTACT = Effect(
    name="normal_contact",
    description="Contact of the rigid indenters with the gel",
    parameters=EffectParameters,
    bound=normal_contact_bound,
    formula="1.25 F, F = 2.2 E* a V/A + bonded layer (M V/h in series with squeeze)); depth f/Z",
    ladder=normal_contact_ladder,
    implementation="gelslim_twin.contact.solver",
    needs=("poses",),
    provides=("displacement", "force"),
)


LOCAL = 4.0
"""Largest displacement of a node over the mean under a sticking tool: 3.6 for a sliding cone."""


def dragged_mm(c: Circumstances) -> float:
    """Largest displacement that the tool can impose: its path, its rotation, and the depth.

    The depth counts because a frictionless press displaces the surface sideways, which friction
    prevents.
    """
    turn = math.radians(c.motion.twist_deg) * c.footprint.reach_mm(c.contact.depth_mm)
    tilt = math.radians(c.motion.tilt_deg) * c.contact.depth_mm
    return c.motion.lateral_mm + turn + tilt + math.hypot(c.contact.depth_mm, c.contact.sideways_mm)


def tangential_n(c: Circumstances) -> float:
    """Tangential force at the friction limit or at full stick, whichever is smaller."""
    t = c.contact
    return min(c.friction * RIDGES * t.stick_n, t.shear_n_per_mm * dragged_mm(c))


def moved_mm(c: Circumstances) -> float:
    """Sideways displacement by friction, limited by the tool's path and by the tangential force."""
    t = c.contact
    if t.shear_n_per_mm == 0:
        return 0.0
    return min(dragged_mm(c), LOCAL * tangential_n(c) / t.shear_n_per_mm)


def friction_bound(c: Circumstances) -> Bound:
    """Tangential force and the stiffer layer. On a gel at large strain all forces are larger."""
    t = c.contact
    stiffer = RIDGES * min(c.friction, 1.0) * (t.stick_n - t.normal_n)
    force_n = (1 + t.nonlinear_excess) * math.hypot(tangential_n(c), stiffer)
    return geometry(moved_mm(c) * c.sensor.px_per_mm, force_n)


def friction_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One rung: the error is that of the contact's own tolerance, which covers friction too.

    The solver takes the smaller of the two tolerances, so this one is the largest of all.
    """
    nodes = c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    return (Rung("as contact", Bound(), 0.4 * nodes, {"tolerance": RUNGS[0][1]}),)


FRICTION = Effect(
    name="friction",
    description="Coulomb friction with stick and slip; its coefficient is `contact.friction`",
    parameters=EffectParameters,
    bound=friction_bound,
    formula="hypot(min(mu F, (G A/h + 8 G a/(2-nu)) s), min(mu, 1) (F_stick - F)); s + depth",
    ladder=friction_ladder,
    does_nothing=lambda c: c.friction == 0,
    implementation="gelslim_twin.contact.coulomb_contact",
    needs=("poses",),
    refines=("displacement", "force"),
)


class PronyTerm(Block):
    """One term of the Prony series."""

    fraction: Annotated[float, Field(ge=0, lt=1)] = Field(
        description="Share of the instantaneous stiffness that decays with this time constant"
    )
    time_s: Annotated[float, Field(gt=0, le=1e7)] = Field(description="Time constant of the decay")


class RelaxationParameters(EffectParameters):
    """The Prony series g(t) = 1 - sum of fraction (1 - exp(-t / time)).

    Without terms the gel does not relax.
    """

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


def relaxation_bound(c: Circumstances) -> Bound:
    """What decays from the first contact to the end of the motion, of the whole force.

    The force lost is a mean of past elastic forces, so no more than the largest. Where the depth
    is prescribed the surface stays as it is: stress alone relaxes.
    """
    terms = c.given("relaxation", RelaxationParameters).terms
    lost = sum(t.fraction * -math.expm1(-c.motion.contact_s / t.time_s) for t in terms)
    return Bound(force_n=lost * c.force_n * (1 + c.contact.nonlinear_excess))


RELAXATION = Effect(
    name="relaxation",
    description="Viscoelastic relaxation: the forces decay while the gel is held",
    parameters=RelaxationParameters,
    bound=relaxation_bound,
    formula="F x sum of g (1 - exp(-T/tau)), T from first contact to the end",
    ladder=lambda c: (Rung("recursive", Bound(), 0.01 + 8e-5 * c.sensor.surface_nodes),),
    does_nothing=lambda c: all(
        t.fraction == 0 for t in c.given("relaxation", RelaxationParameters).terms
    ),
    implementation="gelslim_twin.contact.relaxation",
    needs=("poses",),
    refines=("force",),
    after=("friction", "nonlinearity"),
)
