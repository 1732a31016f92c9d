"""Coulomb friction: stick and slip between indenter and gel."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from gelslim_twin.effects.normal_contact import RUNGS
from gelslim_twin.effects.touch import RIDGES


class FrictionParameters(EffectParameters):
    """Stick and slip; the coefficient stands under contact."""


LOCAL = 4.0
"""Most that a node moves over the mean of a pad stuck to the tool: 3.6 for a sliding cone."""


def dragged_mm(c: Circumstances) -> float:
    """How far the surface is dragged at most: the tool's way, its turn, and the depth.

    A frictionless press moves the surface aside, which friction hinders.
    """
    turn = math.radians(c.motion.twist_deg) * c.footprint.reach_mm(c.touch.depth_mm)
    tilt = math.radians(c.motion.tilt_deg) * c.touch.depth_mm
    return c.motion.lateral_mm + turn + tilt + math.hypot(c.touch.depth_mm, c.touch.sideways_mm)


def moved_mm(c: Circumstances) -> float:
    """How far the surface moves sideways by friction: with the tool, or as its force can."""
    t = c.touch
    if c.friction == 0 or t.normal_n == 0:
        return 0.0
    tangential = min(c.friction * RIDGES * t.stick_n, t.shear_n_per_mm * dragged_mm(c))
    return min(dragged_mm(c), LOCAL * tangential / t.shear_n_per_mm)


def bound(c: Circumstances) -> Bound:
    """Tangential force: the friction limit, or full stick if that is less; stiffer layer too.

    On a gel at large strain all forces are larger.
    """
    t, mu = c.touch, c.friction
    if mu == 0 or t.normal_n == 0:
        return Bound()
    tangential = min(mu * RIDGES * t.stick_n, t.shear_n_per_mm * dragged_mm(c))
    stiffer = RIDGES * min(mu, 1.0) * (t.stick_n - t.normal_n)
    larger = 1 + t.nonlinear_excess
    return geometry(moved_mm(c) * c.sensor.px_per_mm, larger * math.hypot(tangential, stiffer))


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Coulomb's cone in the contact's solver: its tolerance is the contact's, which errs for both.

    The solver takes the tighter of the two tolerances, so the loosest of all asks for nothing.
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
