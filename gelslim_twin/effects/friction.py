"""Coulomb friction: stick and slip between indenter and gel."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact_estimate import RIDGES
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from gelslim_twin.effects.normal_contact import RUNGS


class FrictionParameters(EffectParameters):
    """Stick and slip; the coefficient stands under contact."""


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


def moved_mm(c: Circumstances) -> float:
    """Sideways displacement by friction, limited by the tool's path and by the tangential force."""
    t = c.contact
    if c.friction == 0 or t.normal_n == 0:
        return 0.0
    tangential = min(c.friction * RIDGES * t.stick_n, t.shear_n_per_mm * dragged_mm(c))
    return min(dragged_mm(c), LOCAL * tangential / t.shear_n_per_mm)


def bound(c: Circumstances) -> Bound:
    """Tangential force at the friction limit or at full stick, and the stiffer layer.

    The smaller of the two limits counts. On a gel at large strain all forces are larger.
    """
    t, mu = c.contact, c.friction
    if mu == 0 or t.normal_n == 0:
        return Bound()
    tangential = min(mu * RIDGES * t.stick_n, t.shear_n_per_mm * dragged_mm(c))
    stiffer = RIDGES * min(mu, 1.0) * (t.stick_n - t.normal_n)
    larger = 1 + t.nonlinear_excess
    return geometry(moved_mm(c) * c.sensor.px_per_mm, larger * math.hypot(tangential, stiffer))


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One rung: the error is that of the contact's own tolerance, which covers friction too.

    The solver takes the smaller of the two tolerances, so this one is the largest of all.
    """
    nodes = c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    return (Rung("as contact", Bound(), 0.4 * nodes, {"tolerance": RUNGS[0][1]}),)


EFFECT = Effect(
    name="friction",
    title="Coulomb friction, stick and slip",
    parameters=FrictionParameters,
    bound=bound,
    formula="hypot(min(mu F, (G A/h + 8 G a/(2-nu)) s), min(mu, 1) (F_stick - F)); s + depth",
    ladder=ladder,
    is_null=lambda c: c.friction == 0,
    implementation="gelslim_twin.contact.coulomb_kernel",
    needs=("poses",),
    refines=("displacement", "force"),
)
