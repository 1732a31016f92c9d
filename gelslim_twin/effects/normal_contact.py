"""Normal contact: without it nothing moves and nothing presses."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry, never_null
from gelslim_twin.effects.touch import RIDGES

RUNGS = (("coarse", 1e-2), ("medium", 1e-3), ("fine", 1e-4), ("finer", 1e-5), ("finest", 1e-6))
PLACES, MOST_PLACES = 0.14, 1.1
"""Of the depth, over the root of the tolerance: under wide tools, and under a ridge or a tip."""
FORCE, MOST_FORCE = 0.07, 0.15
"""The same of the resultant force."""
NARROW = 3.5
"""Nodes across a tool under which its tip is: 3 across a cone have all of the error."""
FEW = 50.0
"""Nodes that carry such a tool: many tips side by side hold each other."""


def left_over(c: Circumstances, tolerance: float) -> Bound:
    """Error of places and of the resultant at a tolerance of the solver."""
    if c.touch.area_mm2 == 0:
        return Bound()
    across = c.footprint.width_mm(c.touch.depth_mm) / c.sensor.node_pitch_mm
    tip = min(1.0, (NARROW / max(1.0, across)) ** 2) * min(1.0, FEW / max(1.0, c.contact_nodes))
    root = math.sqrt(tolerance)
    places = root * max(PLACES, MOST_PLACES * tip) * c.touch.depth_mm * c.sensor.px_per_mm
    return geometry(places, root * max(FORCE, MOST_FORCE * tip) * c.touch.normal_n)


class NormalContactParameters(EffectParameters):
    """Contact of rigid indenters with the gel."""


def bound(c: Circumstances) -> Bound:
    """All the force, and a surface pushed in by the whole depth and aside."""
    px = math.hypot(c.touch.depth_mm, c.touch.sideways_mm) * c.sensor.px_per_mm
    return Bound(RIDGES * c.touch.normal_n, px, px, px)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Tolerance of the active set, relative to the force.

    Time grows with the square of the nodes in contact, whose compliance is dense (measured).
    """
    nodes = c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    dense_ms = c.contact_nodes**2 / 1e4
    return tuple(
        Rung(name, left_over(c, tolerance), ms * nodes + dense_ms, {"tolerance": tolerance})
        for (name, tolerance), ms in zip(RUNGS, (1.2, 1.3, 1.5, 1.8, 2.1), strict=True)
    )


EFFECT = Effect(
    name="normal_contact",
    title="Normal contact",
    parameters=NormalContactParameters,
    bound=bound,
    formula="1.25 F, F = 2.2 E* a V/A + bonded layer (M V/h in series with squeeze)); depth f/Z",
    ladder=ladder,
    is_null=never_null,
    implementation="gelslim_twin.contact.solver",
    needs=("poses",),
    provides=("displacement", "force"),
)
