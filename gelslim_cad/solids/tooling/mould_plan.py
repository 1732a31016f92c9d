"""Layout of the gel mould, seen from above, the lid towards the viewer.

      .-------------------------------------.
      | o                                 o |    o  clamp bolts
      |      .-----------------------.      |
      |      |                     · |      |    ·  vents at the far end
      | +    | G        gel        · |    + |    +  dowels, displaced: one way only
      |      |                     · |      |    G  pour gate
      |      '-----------------------'      |
      | o                                 o |
      '-------------------------------------'
                                          x to the tip

The mould's frame: origin at the centre of the gel's outer surface, which lies at the bottom;
x as in the finger, z up towards the lid, so y is that of the finger with the sign changed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.prism import Hole, rectangle

BORDER_MM = 14.0
"""Wall around the cavity; clamp bolts in its middle leave more than 5 mm on both sides."""
BOLT_MM = 3.4
DOWEL_MM = 3.0
DOWEL_OFFSET_MM = 2.0
VENT_MM = 1.0
HOLE_GAP_MM = 1.2
INSET_MM = 0.3
CORNER_MM = 3.0


@dataclass(frozen=True)
class MouldPlan:
    """The mould from above. Lengths in mm in the mould's frame."""

    cavity: GelShape
    """The gel enlarged for shrinkage."""
    block: Outline
    gate: Hole
    vents: tuple[Hole, ...]
    bolts: tuple[Hole, ...]
    dowels: tuple[Hole, ...]

    @property
    def depth_mm(self) -> float:
        """Depth of the cavity at its centre, the height of the parting plane."""
        return self.cavity.thickness_mm


def shrinkage_factor(d: Dimensions) -> float:
    """Cavity over gel, 1 / (1 - linear shrinkage)."""
    return 1.0 / (1.0 - float(d["manufacturing.gel_shrinkage_percent"]) / 100.0)


def plan_mould(d: Dimensions) -> MouldPlan:
    """Lay out gate, vents, bolts and dowels around the cavity."""
    cavity = GelShape.of(d).scaled(shrinkage_factor(d))
    half_x, half_y = cavity.length_mm / 2, cavity.width_mm / 2
    x, y = half_x + BORDER_MM / 2, half_y + BORDER_MM / 2
    outer_x, outer_y = half_x + BORDER_MM, half_y + BORDER_MM
    bolts = ((-x, -y, BOLT_MM), (x, -y, BOLT_MM), (x, y, BOLT_MM), (-x, y, BOLT_MM))
    gate_mm = min(6.0, 0.25 * min(cavity.length_mm, cavity.width_mm))
    gate = (-half_x + gate_mm / 2 + INSET_MM, 0.0, gate_mm)
    return MouldPlan(
        cavity=cavity,
        block=rectangle((-outer_x, outer_x), (-outer_y, outer_y), CORNER_MM),
        gate=gate,
        vents=_vents(cavity, gate),
        bolts=bolts,
        dowels=((x, 0.0, DOWEL_MM), (-x, DOWEL_OFFSET_MM, DOWEL_MM)),
    )


def _vents(cavity: GelShape, gate: Hole) -> tuple[Hole, ...]:
    """Vents where air collects: at the far corners first, then where there is room for more.

    The lid's underside is flat. With the gate's end lowered the far corners are the highest
    points; in a level mould the near corners and the far side may hold a bubble as well.
    """
    cx, cy = cavity.inset_corner_mm(VENT_MM / 2 + INSET_MM)
    far = cavity.length_mm / 2 - VENT_MM / 2 - INSET_MM
    kept: list[Hole] = []
    for x, y in ((cx, cy), (cx, -cy), (far, 0.0), (-cx, cy), (-cx, -cy)):
        taken = [gate, *kept]
        room = all(
            math.hypot(x - u, y - v) - (VENT_MM + diameter) / 2 >= HOLE_GAP_MM
            for u, v, diameter in taken
        )
        if room or len(kept) < 2:
            kept.append((x, y, VENT_MM))
    return tuple(kept)
