"""Adhesion of a tacky gel, as an effect."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.contact_estimate import RIDGES, ContactEstimate, contact_estimate
from gelslim_twin.effects.effect import Bound, Effect, Rung, geometry

STIFFER = 4.0
"""Factor on the mean pressure over the depth: two for the mean depth, and two for safety."""
NECK = 3.0
"""Length of the neck over sqrt(2 w/k): 2.4 for a ball on a half-space."""
LATTICE = 1.5
"""Error over the whole effect, times the nodes on the radius of the contact. Solved pull-offs of a
ball reach 1.4 of it."""
TURNS = 12
MORE_MS = 6.0
"""Time of the contacts with other bonds at a pose, on a pad of 43 x 43 x 4 nodes."""


class AdhesionParameters(EffectParameters):
    """Work of adhesion between tool and gel, which also holds a tool that is pulled off."""

    work_j_m2: float = Field(
        default=0.0, ge=0, le=1000, description="Work of adhesion in J/m²; 0 for a gel without"
    )


def work_n_mm(c: Circumstances) -> float:
    """Work of adhesion in N/mm."""
    return 1e-3 * c.given("adhesion", AdhesionParameters).work_j_m2


def held_contact(c: Circumstances) -> tuple[ContactEstimate, float]:
    """The deepest contact grown by its neck, and the length of the neck in mm.

    The stiffness k per area is that of the contact; bonds of an even layer of springs break at the
    pressure sqrt(2 w k) and the length sqrt(2 w/k).
    """
    s, neck = c.sensor, 0.0
    grown = c.contact
    for _ in range(TURNS):
        depth_mm = min(s.thickness_mm, max(0.0, c.motion.depth_mm) + neck)
        grown = contact_estimate(
            c.footprint, max(depth_mm, 1e-3), s.thickness_mm, s.youngs_modulus_mpa, s.poissons_ratio
        )
        if grown.area_mm2 == 0:
            return grown, 0.0
        neck = NECK * math.sqrt(2 * work_n_mm(c) / _stiffness(grown))
    return grown, min(neck, s.thickness_mm)


def _stiffness(t: ContactEstimate) -> float:
    """Pressure per depth in N/mm³, rather too large."""
    return STIFFER * t.normal_n / (t.area_mm2 * t.depth_mm)


def adhesion_bound(c: Circumstances) -> Bound:
    """The force with which the bonds pull, and the neck that they draw."""
    if work_n_mm(c) == 0 or c.contact.area_mm2 == 0:
        return Bound()
    grown, neck_mm = held_contact(c)
    pull_n = grown.area_mm2 * math.sqrt(2 * work_n_mm(c) * _stiffness(grown))
    # Friction holds what is pressed, and what is bonded as if it were pressed as much more.
    force_n = RIDGES * math.hypot(1.0, c.friction) * pull_n
    return geometry(neck_mm * c.sensor.px_per_mm, force_n)


def adhesion_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One rung: bonds break node by node, so that the nodes on the radius decide the error."""
    nodes = c.sensor.surface_nodes * c.sensor.layers / (43 * 43 * 4)
    whole = adhesion_bound(c)
    across = held_contact(c)[0].radius_mm / c.sensor.node_pitch_mm if whole != Bound() else 1.0
    share = min(1.0, LATTICE / max(across, 1e-9))
    return (Rung("node by node", whole.times(share), MORE_MS * nodes),)


ADHESION = Effect(
    name="adhesion",
    description="Adhesion of a tacky gel: bonds of a given work hold the tool until they break",
    parameters=AdhesionParameters,
    bound=adhesion_bound,
    formula="A sqrt(2 w k), k = 4 F/(A d) per area, grown by the neck 3 sqrt(2 w/k)",
    ladder=adhesion_ladder,
    does_nothing=lambda c: work_n_mm(c) == 0,
    implementation="gelslim_twin.contact.adhesive_contact",
    needs=("poses",),
    refines=("displacement", "force"),
    after=("friction",),
)
