"""Friction that changes with the speed of slip, as an effect."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact import LOCAL, dragged_mm
from gelslim_twin.effects.contact_estimate import RIDGES
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry

SUDDEN = 3.0
"""Speed of slip over that of the tool: parts of the contact that were held slip faster."""
HELD = 4.0
"""Pressure over the stiffness that holds a part of the contact, over that of the whole."""
STEPS = (("coarse", 0.5), ("medium", 0.125), ("fine", 1 / 32))
"""Longest way of the tool in one step over the memory length."""
COURSE = 2.5
"""Error over the whole effect, per way of a step over the memory length. Solved contacts (a ball
that starts, slides, rests and starts again) reach 2.0 where sliding is steady."""
STEP_MS = 1.6
"""Time of one more contact with friction, on a pad of 43 x 43 x 4 nodes."""


class SlidingFrictionParameters(EffectParameters):
    """Friction falls from `contact.friction` at rest to `kinetic` at large speeds of slip.

    At the slip speed v, averaged over a length of slip, the coefficient is
    kinetic + (friction - kinetic) exp(-v / speed). Without `kinetic` it does not depend on v.
    """

    kinetic: float | None = Field(
        default=None, ge=0, le=10, description="Coefficient of friction at large speeds of slip"
    )
    speed_mm_s: float = Field(
        default=5.0, gt=0, le=1e4, description="Stribeck speed: 1/e of the difference is left"
    )
    memory_mm: float = Field(
        default=0.3,
        ge=0.01,
        le=10,
        description="Length of slip over which the speed is averaged; at rest the contact forgets "
        "it in memory_mm / speed_mm_s",
    )


def _given(c: Circumstances) -> SlidingFrictionParameters:
    return c.given("sliding_friction", SlidingFrictionParameters)


def change(c: Circumstances) -> float:
    """Largest change of the coefficient at the speeds of the tool in contact."""
    given = _given(c)
    if given.kinetic is None or c.friction == 0:
        return 0.0
    reached = -math.expm1(-SUDDEN * c.motion.speed_mm_s / given.speed_mm_s)
    return abs(c.friction - given.kinetic) * reached


def is_jerky(c: Circumstances) -> bool:
    """Whether the gel is too soft to hold the tool as friction falls, so that it sticks and slips.

    Friction falls by up to (mu_s - mu_k) / e per memory length of slip (at the speed v_s, where
    the law is steepest relative to the speed), the elastic force by the shear stiffness.
    """
    given = _given(c)
    if given.kinetic is None or c.contact.shear_n_per_mm == 0:
        return False
    falls = max(0.0, c.friction - given.kinetic) / math.e * c.contact.stick_n / given.memory_mm
    return HELD * falls > c.contact.shear_n_per_mm


def sliding_friction_bound(c: Circumstances) -> Bound:
    """The tangential force that changes, and how far it moves the surface."""
    t = c.contact
    force_n = (1 + t.nonlinear_excess) * change(c) * RIDGES * t.stick_n
    if force_n == 0 or t.shear_n_per_mm == 0:
        return Bound()
    moved_mm = min(dragged_mm(c), LOCAL * force_n / t.shear_n_per_mm)
    return geometry(moved_mm * c.sensor.px_per_mm, force_n)


def sliding_friction_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Ways of the tool in one step.

    Where the tool sticks and slips, no step tells when it slips, and at a wall that slides no step
    tells when it lets go of a row of nodes. In solved contacts of a flat punch, steps half as long
    let go a pose earlier or later, and the tangential force of that pose differs by a sixth.
    """
    is_open = is_jerky(c) or c.has_sliding_walls
    whole, nodes = sliding_friction_bound(c), c.sensor.surface_nodes * c.sensor.layers / (43**2 * 4)
    length_mm = _given(c).memory_mm
    return tuple(
        Rung(
            name,
            whole if is_open else whole.times(min(1.0, COURSE * share)),
            0.1 + STEP_MS * nodes * max(0.0, c.motion.step_aside_mm / (share * length_mm) - 1),
            {"step_share": share},
        )
        for name, share in STEPS
    )


SLIDING_FRICTION = Effect(
    name="sliding_friction",
    description="Friction that falls from static to kinetic with the speed of slip",
    parameters=SlidingFrictionParameters,
    bound=sliding_friction_bound,
    formula="1.25 |mu_s - mu_k| (1 - exp(-3 v/v_s)) F_stick; that over G A/h + 8 G a/(2-nu)",
    ladder=sliding_friction_ladder,
    does_nothing=lambda c: _given(c).kinetic in (None, c.friction) or c.friction == 0,
    implementation="gelslim_twin.contact.sliding_friction",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
