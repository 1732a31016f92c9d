"""Normal contact: without it nothing moves and nothing presses."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.contact_rungs import RUNGS, left_over
from gelslim_twin.effects.effect import Bound, Effect, Rung, never_null
from gelslim_twin.effects.parameters import EffectParameters
from gelslim_twin.effects.touch import RIDGES


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
