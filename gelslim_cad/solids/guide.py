"""The curved acrylic light guide: flat window, two 90° bends of constant thickness, two legs.

    ____________________   gel side
   /  ________________  \\
  |  /                \\  |
  |_|                  |_|   LEDs shine up into the legs
"""

from __future__ import annotations

import math

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.part import Part
from gelslim_cad.solids.materials import ACRYLIC
from gelslim_cad.solids.shapes import single


def profile_wire(d: Dimensions, x_mm: float) -> cq.Wire:
    """Cross-section of the guide in the plane x = x_mm, arcs exact."""
    top, bottom = d["stack.gel_bottom_z_mm"], d["stack.window_bottom_z_mm"]
    flat, foot = d["guide.flat_width_mm"] / 2, d["guide.leg_end_z_mm"]
    inner, outer = d["guide.inner_radius_mm"], d["guide.outer_radius_mm"]
    centre = bottom - inner

    def at(y: float, z: float) -> cq.Vector:
        return cq.Vector(x_mm, y, z)

    def bend(side: int, radius: float) -> tuple[cq.Vector, cq.Vector, cq.Vector]:
        """Flat end, middle and leg end of a bend."""
        half = radius * math.sqrt(0.5)
        return (
            at(side * flat, centre + radius),
            at(side * (flat + half), centre + half),
            at(side * (flat + radius), centre),
        )

    arc, line = cq.Edge.makeThreePointArc, cq.Edge.makeLine
    right_out, right_in, left_out, left_in = (
        bend(side, radius) for side in (1, -1) for radius in (outer, inner)
    )
    feet = [at(y, foot) for y in (flat + outer, flat + inner, -flat - outer, -flat - inner)]
    edges = [
        line(at(-flat, top), at(flat, top)),
        arc(*right_out),
        line(right_out[2], feet[0]),
        line(feet[0], feet[1]),
        line(feet[1], right_in[2]),
        arc(*reversed(right_in)),
        line(at(flat, bottom), at(-flat, bottom)),
        arc(*left_in),
        line(left_in[2], feet[3]),
        line(feet[3], feet[2]),
        line(feet[2], left_out[2]),
        arc(*reversed(left_out)),
    ]
    return cq.Wire.assembleEdges(edges)


def light_guide(d: Dimensions) -> Part:
    """The guide over its whole length."""
    wire = profile_wire(d, d["guide.proximal_end_x_mm"])
    solid = cq.Solid.extrudeLinear(wire, [], cq.Vector(d["guide.length_mm"], 0, 0))
    return Part(
        name="light_guide",
        solid=single(solid, "light_guide"),
        material=f"cast acrylic, {d['design.light_guide.thickness_mm']:g} mm",
        process="bend",
        colour=ACRYLIC,
        explode_mm=(0, 0, 14),
        note="laser-cut blank, anneal, bend hot over a former, polish the leg ends",
        print_rotation_deg=(180, 0, 0),
    )


def guide_blank(d: Dimensions) -> Part:
    """Flat blank of the guide before bending, lying on z = 0."""
    width, t = d["guide.blank_width_mm"], d["design.light_guide.thickness_mm"]
    start = cq.Vector(d["guide.proximal_end_x_mm"], -width / 2, 0)
    return Part(
        name="light_guide_blank",
        solid=cq.Solid.makeBox(d["guide.length_mm"], width, t, start),
        material=f"cast acrylic, {t:g} mm",
        process="laser",
        colour=ACRYLIC,
        quantity=0,
        in_assembly=False,
        note="anneal after cutting, then bend",
    )
