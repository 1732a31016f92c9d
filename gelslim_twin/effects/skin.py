"""The skin of the gel, its coat of paint or a fabric, which resists stretching, as an effect."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact import dragged_mm, moved_mm
from gelslim_twin.effects.contact_estimate import RIDGES
from gelslim_twin.effects.effect import Bound, Effect, Rung

FLOW = 1.2
"""Excess of the force under a surface that cannot stretch, over the squared share of the
indentation that flows sideways; solved contacts reach 1.14 (wedge, ν 0.49)."""
JUMPS = 6.0
"""Factor on the share of the motion that is prevented: nodes at a rim may stick in place of
slipping, and solved contacts of flat punches reach 4.5."""


def held_share(c: Circumstances) -> float:
    """Share of the sideways motion that the skin prevents: N k / (N k + G), 1/k the half width."""
    t = c.contact
    half = min(t.radius_mm, 0.5 * c.footprint.width_mm(t.depth_mm))
    if c.sensor.skin_n_per_mm == 0 or t.area_mm2 == 0:
        return 0.0
    return c.sensor.skin_n_per_mm / (c.sensor.skin_n_per_mm + shear_modulus_mpa(c) * half)


def shear_modulus_mpa(c: Circumstances) -> float:
    """G of the gel."""
    return c.sensor.youngs_modulus_mpa / (2 * (1 + c.sensor.poissons_ratio))


def dragged_n(c: Circumstances) -> float:
    """Tangential force that the skin adds at most: that of a disc dragged in it, or of friction.

    The skin is held by the layer below it, G/h per area, and so reaches sqrt(N h/G) far.
    """
    t, n = c.contact, c.sensor.skin_n_per_mm
    if c.friction == 0 or n == 0 or t.area_mm2 == 0:
        return 0.0
    reach_mm = math.sqrt(n * c.sensor.thickness_mm / shear_modulus_mpa(c))
    per_mm = 2 * math.pi * n * (0.5 + t.radius_mm / reach_mm)
    return min(c.friction * RIDGES * t.stick_n, per_mm * dragged_mm(c))


def skin_bound(c: Circumstances) -> Bound:
    """The stiffer press, the tangential force, and the sideways motion that is prevented."""
    t, share = c.contact, held_share(c)
    if share == 0:
        return Bound()
    press_n = share * RIDGES * max(t.stick_n - t.normal_n, FLOW * t.squeezed**2 * t.normal_n)
    friction_n = dragged_n(c) + c.friction * press_n
    sideways_mm = t.sideways_mm + (moved_mm(c) if c.friction else 0.0)
    seen = min(1.0, JUMPS * share) * sideways_mm * c.sensor.px_per_mm
    # A node at a wall may be in contact with one surface and free with the other.
    walls = math.isinf(c.footprint.steepest(t.depth_mm))
    px = seen + (t.depth_mm * c.sensor.px_per_mm if walls else 0.0)
    force_n = (1 + t.nonlinear_excess) * math.hypot(press_n, friction_n)
    return Bound(force_n, px, seen, seen)


def skin_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One rung: the membranes are part of the stiffness, so that a pose costs no more."""
    return (Rung("in the stiffness", Bound(), 0.0),)


SKIN = Effect(
    name="skin",
    description="Membrane stiffness of the gel's coat and fabric, `material.coat` and "
    "`material.fabric` of the spec",
    parameters=EffectParameters,
    bound=skin_bound,
    formula="N/(N + G a) max(F_stick - F, 1.2 q² F), q the part that flows; with friction "
    "min(mu F, 2 pi N (1/2 + a/sqrt(N h/G)) s)",
    ladder=skin_ladder,
    does_nothing=lambda c: c.sensor.skin_n_per_mm == 0,
    implementation="ifem_export.elements.membrane",
    needs=("poses",),
    refines=("displacement", "force"),
)
