"""Tools for the light guide: a former to bend it over, and a jig in which its legs are trimmed.

        former (across)                      trim jig (across)
        .-------------.                       _.-------------._
       /               \\   radius R         | /               \\ |
      |                 |                    ||                 ||
      |                 |                    ||   mandrel       ||   cheeks
      |                 |                    ||                 ||
   .--'-----------------'--.                 '|-----------------|'
   '-----------------------'   base           |  file here      |    legs stick out

Both are made from the guide's inner profile, upper side up. Legs of a millimetre cannot be gripped
while they are hot: they are cut longer, bent, and filed flush with the lower face of the jig.
"""

from __future__ import annotations

import math

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import PRINTED
from gelslim_cad.solids.shapes import Piece, box, closed_wire, pair, single, subtract, union

BASE_MM = 6.0
BASE_MARGIN_MM = 15.0
"""What the base reaches beyond the legs, for clamps."""
BELOW_LEGS_MM = 5.0
STOP_MM = 4.0
STOP_ABOVE_MM = 3.0
STOP_HALF_MM = 8.0
NOTCH_MM = 1.0
CHEEK_MM = 4.0
TOOL = (0.58, 0.46, 0.30, 1.0)


def _mandrel(d: Dimensions, x: tuple[float, float], low: float, inset: float) -> cq.Solid:
    """Body that fills the guide between its legs, from a height to the window's lower face at 0."""
    r = d["guide.inner_radius_mm"]
    flat = d["guide.flat_width_mm"] / 2 - inset
    side = flat + r
    turn = r * math.sqrt(0.5)

    def at(y: float, z: float) -> cq.Vector:
        return cq.Vector(x[0], y, z)

    wire = closed_wire(
        [
            Piece(at(-side, low)),
            Piece(at(side, low)),
            Piece(at(side, -r), at(flat + turn, turn - r)),
            Piece(at(flat, 0.0)),
            Piece(at(-flat, 0.0), at(-flat - turn, turn - r)),
            Piece(at(-side, -r)),
        ]
    )
    return cq.Solid.extrudeLinear(wire, [], cq.Vector(x[1] - x[0], 0, 0))


def bending_former(d: Dimensions) -> Part:
    """Block over which the hot blank is bent, on a base for clamps, with a stop at one end."""
    half, t = d["guide.length_mm"] / 2, d["design.light_guide.thickness_mm"]
    side = d["guide.flat_width_mm"] / 2 + d["guide.inner_radius_mm"]
    legs = d["guide.inner_radius_mm"] + d["design.light_guide.leg_length_mm"]
    floor = -(legs + d["manufacturing.leg_trim_mm"] + BELOW_LEGS_MM)
    reach = side + t + BASE_MARGIN_MM
    x = (-half - STOP_MM, half + STOP_MM)
    stop = box((x[0], -half), (-STOP_HALF_MM, STOP_HALF_MM), (floor, t + STOP_ABOVE_MM))
    notch = box((x[0] - 1, -half + 1), (-NOTCH_MM / 2, NOTCH_MM / 2), (0.2, t + STOP_ABOVE_MM + 1))
    solid = union(
        [
            _mandrel(d, x, floor, 0.0),
            box(x, (-reach, reach), (floor - BASE_MM, floor + 0.01)),
            stop,
        ]
    )
    return Part(
        name="bending_former",
        solid=single(subtract(solid, [notch]), "bending_former"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=TOOL,
        in_assembly=False,
        note="acrylic comes at 150 to 160 °C: print it in PA12 or high-temperature resin, or cover "
        "it with aluminium tape over felt; the notch marks the middle of the blank",
        tags=frozenset({"tooling"}),
    )


def trim_jig(d: Dimensions) -> Part:
    """Frame that holds the bent guide; legs are right when they are flush with its lower face."""
    t, fit = d["design.light_guide.thickness_mm"], d["design.housing.fit_clearance_mm"]
    side = d["guide.flat_width_mm"] / 2 + d["guide.inner_radius_mm"]
    low = -(d["guide.inner_radius_mm"] + d["design.light_guide.leg_length_mm"])
    half = d["guide.length_mm"] / 2 + fit
    x = (-half - CHEEK_MM, half + CHEEK_MM)
    outer = side + t + fit
    cheeks = pair(x, (outer, outer + CHEEK_MM), (low, 0.0))
    walls = (
        box((x[0], -half), (-outer - 0.1, outer + 0.1), (low, 0.0)),
        box((half, x[1]), (-outer - 0.1, outer + 0.1), (low, 0.0)),
    )
    solid = union([_mandrel(d, (-half - 0.1, half + 0.1), low, fit), *cheeks, *walls])
    leg = d["design.light_guide.leg_length_mm"]
    return Part(
        name="trim_jig",
        solid=single(solid, "trim_jig"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=TOOL,
        in_assembly=False,
        note=f"press the guide down on it and file its legs flush with the lower face: {leg:g} mm "
        "stay",
        tags=frozenset({"tooling"}),
    )
