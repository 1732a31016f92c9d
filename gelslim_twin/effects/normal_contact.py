"""Normal contact of the tool with the gel, and the error that the solver's tolerance leaves.

The tolerance applies to the field of forces. Displacements err by more, because a node at the
border of the contact or under a ridge may change its contact status within the tolerance. In solved
contacts (eleven scenes of the gallery, with and without friction, tolerances from 1e-2 to 1e-5
against 1e-7, worst node of the worst pose) this error falls with the square root of the tolerance.

The estimate does not cover walls of a tool that slide over nodes: there the set of nodes in contact
is sensitive to differences smaller than any tolerance of the ladder.
"""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact_estimate import RIDGES
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry, never_null

RUNGS = (("coarse", 1e-2), ("medium", 1e-3), ("fine", 1e-4), ("finer", 1e-5), ("finest", 1e-6))
PLACES, MOST_PLACES = 0.14, 1.1
"""Error of displacements over depth and root of the tolerance: wide tools, ridges and tips."""
FORCE, MOST_FORCE = 0.07, 0.15
"""Error of the resultant over the normal force and the root of the tolerance, likewise."""
NARROW = 3.5
"""Nodes across a tool below which it counts as a tip: 3 nodes across a cone show the full error."""
FEW = 50.0
"""Nodes in contact above which the error of a tip decreases: many tips support each other."""


def left_over(c: Circumstances, tolerance: float) -> Bound:
    """Error of displacements and of the resultant at a tolerance of the solver."""
    if c.contact.area_mm2 == 0:
        return Bound()
    across = c.footprint.width_mm(c.contact.depth_mm) / c.sensor.node_pitch_mm
    tip = min(1.0, (NARROW / max(1.0, across)) ** 2) * min(1.0, FEW / max(1.0, c.contact_nodes))
    root = math.sqrt(tolerance)
    places = root * max(PLACES, MOST_PLACES * tip) * c.contact.depth_mm * c.sensor.px_per_mm
    return geometry(places, root * max(FORCE, MOST_FORCE * tip) * c.contact.normal_n)


class NormalContactParameters(EffectParameters):
    """Contact of rigid indenters with the gel."""


def bound(c: Circumstances) -> Bound:
    """The whole force, and the displacement of the surface, downwards and sideways."""
    px = math.hypot(c.contact.depth_mm, c.contact.sideways_mm) * c.sensor.px_per_mm
    return Bound(RIDGES * c.contact.normal_n, px, px, px)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Relative tolerance of the field of forces.

    The time grows with the square of the nodes in contact, whose compliance is dense.
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
