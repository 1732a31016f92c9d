"""Large deformation: a neo-Hookean gel with F-bar elements in place of the linear one."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry
from gelslim_twin.effects.friction import moved_mm


class NonlinearityParameters(EffectParameters):
    """Geometric and material nonlinearity of the gel."""


MARKERS = 2.0
"""Over the estimate; random scenes reach 0.86 of the bound with it."""


def bound(c: Circumstances) -> Bound:
    """The excess of the neo-Hookean force at this indentation, of the whole force.

    Under the indenter the depth is prescribed; sideways, where it is not, the surface moves by
    about half of the depth and with the tool, which errs by the same share, twice that at the
    edges of flat tools. A node there may be held by one gel and free in the other, a whole depth
    apart; dots are carried by several nodes. Its force is then one node's share of the whole where
    walls slide over nodes, which a small tool's few nodes show.
    """
    excess = c.touch.nonlinear_excess
    sideways = excess * (c.touch.depth_mm / 2 + moved_mm(c)) * c.sensor.px_per_mm
    px = c.touch.depth_mm * c.sensor.px_per_mm if excess > 0 else 0.0
    seen = MARKERS * sideways
    return Bound((excess + _one_node(c)) * c.force_n, px + seen, seen, seen)


def _one_node(c: Circumstances) -> float:
    """Share of the force on one node, for a tool with walls that drags the gel; else 0."""
    t = c.touch
    if t.area_mm2 == 0 or c.motion.lateral_mm + c.motion.twist_deg + c.motion.tilt_deg == 0:
        return 0.0
    walls = math.isinf(c.footprint.steepest(t.depth_mm))
    return min(1.0, c.sensor.node_pitch_mm**2 / t.area_mm2) if walls else 0.0


PLACES, FORCE = 0.2, 0.1
"""Of the depth and of the bound, over the tolerance: measured up to 0.12 and 0.02."""
MILLISECONDS = (("coarse", 1e-2, 250.0), ("medium", 1e-3, 350.0), ("fine", 1e-4, 450.0))
"""Measured along the gallery's paths; twice that where poses are far apart or walls slide."""


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Newton's tolerance on the residual; steps halve by themselves."""
    whole, nodes = bound(c), c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    places = PLACES * c.touch.depth_mm * c.sensor.px_per_mm
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
    is_null=lambda c: c.touch.indentation == 0,
    implementation="gelslim_twin.contact.nonlinear",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
