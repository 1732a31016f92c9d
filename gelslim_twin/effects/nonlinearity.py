"""Large deformation: a neo-Hookean gel with F-bar elements in place of the linear one."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from gelslim_twin.effects.friction import moved_mm


class NonlinearityParameters(EffectParameters):
    """Geometric and material nonlinearity of the gel."""


MARKERS = 2.0
"""Factor on the estimate of displacements; random scenes reach 0.86 of the bound with it."""


def bound(c: Circumstances) -> Bound:
    """The nonlinear excess of the force at this indentation, and of sideways displacements.

    Under the indenter the depth is prescribed. Sideways the surface moves by about half of the
    depth and with the tool; this displacement errs by the same share as the force, and by twice
    that at the edges of flat tools. A node at an edge may be in contact in one gel and free in the
    other, so that displacements differ by the whole depth; markers average over several nodes.
    Where the walls of a tool slide over nodes, the force of one node may be missing as well.
    """
    excess = c.contact.nonlinear_excess
    sideways = excess * (c.contact.depth_mm / 2 + moved_mm(c)) * c.sensor.px_per_mm
    px = c.contact.depth_mm * c.sensor.px_per_mm if excess > 0 else 0.0
    seen = MARKERS * sideways
    return Bound((excess + _one_node(c)) * c.force_n, px + seen, seen, seen)


def _one_node(c: Circumstances) -> float:
    """Share of the force on one node for a tool with walls that moves sideways, otherwise 0."""
    t = c.contact
    if t.area_mm2 == 0 or c.motion.lateral_mm + c.motion.twist_deg + c.motion.tilt_deg == 0:
        return 0.0
    walls = math.isinf(c.footprint.steepest(t.depth_mm))
    return min(1.0, c.sensor.node_pitch_mm**2 / t.area_mm2) if walls else 0.0


PLACES, FORCE = 0.2, 0.1
"""Errors over depth and over bound per unit of tolerance; solved contacts reach 0.12 and 0.02."""
MILLISECONDS = (("coarse", 1e-2, 250.0), ("medium", 1e-3, 350.0), ("fine", 1e-4, 450.0))
"""Rungs with their times on the gallery's paths; distant poses or sliding walls take twice that."""


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Relative tolerance of the residual in Newton's method."""
    whole, nodes = bound(c), c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    places = PLACES * c.contact.depth_mm * c.sensor.px_per_mm
    return tuple(
        Rung(
            name,
            geometry(t * places, t * FORCE * whole.force_n).at_most(whole),
            ms * nodes,
            {"tolerance": t},
        )
        for name, t, ms in MILLISECONDS
    )


EFFECT = Effect(
    name="nonlinearity",
    title="Large deformation, neo-Hookean F-bar",
    parameters=NonlinearityParameters,
    bound=bound,
    formula="F x (2 % at 5 % strain, 8 % at 15 %, 21 % at 30 %, 47 % at 50 %; more if squeezed)",
    ladder=ladder,
    is_null=lambda c: c.contact.indentation == 0,
    implementation="gelslim_twin.contact.nonlinear",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
