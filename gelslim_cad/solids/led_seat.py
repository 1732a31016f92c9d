"""What locates an LED board: edges and ribs in the body's channel, a stop on the cover.

The channel also holds the leg, so that board and leg share their reference. Across the finger the
board lies against two edges of the outer wall; two ribs of the baffle press it there and are
crushed. Along the finger it lies against a stop at the tip end of its pedestal.

      wall |[  board  ]> baffle
      edge ^           ^ rib
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.solids.shapes import Point2, pair

LEAST_EDGE_MM = 0.02
EDGE_LENGTH_MM = 1.5
RIB_LENGTH_MM = 0.5
SPREAD = 0.3
"""Place of edges and ribs from the board's middle, as a part of its length."""
LEAD_MM = 0.6
"""Of edges and ribs below the board, for it to slide in."""
SQUEEZE_RATIO = 2.0
"""How far the ribs stand into the board as printed, over the error of a printed face."""
STOP_MM = 0.5
OVERLAP_MM = 0.05


def board_middle_mm(d: Dimensions) -> float:
    """Middle of the LED boards along the finger."""
    return float(d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2


def locating_edges(d: Dimensions) -> list[cq.Shape]:
    """Edges and ribs as they are with the boards in place."""
    if d["led.datum_mm"] < LEAST_EDGE_MM:
        return []
    half = d["led.board_width_mm"] / 2
    wall, edge = d["channel.outer_y_mm"] + OVERLAP_MM, d["led.y_mm"] + half
    edges = [
        bar
        for x in _places_mm(d)
        for bar in _bars(d, (x - EDGE_LENGTH_MM / 2, x + EDGE_LENGTH_MM / 2), wall, edge)
    ]
    return [*edges, *_ribs(d, d["led.y_mm"] - half)]


def uncrushed_ribs(d: Dimensions) -> list[cq.Shape]:
    """The ribs as they are printed, before a board crushes them."""
    if d["led.datum_mm"] < LEAST_EDGE_MM:
        return []
    squeeze = SQUEEZE_RATIO * d["clamp.point_error_mm"]
    return _ribs(d, d["led.y_mm"] - d["led.board_width_mm"] / 2 + squeeze)


def _ribs(d: Dimensions, face_mm: float) -> list[cq.Shape]:
    wall = d["channel.inner_y_mm"] - OVERLAP_MM
    return [
        bar
        for x in _places_mm(d)
        for bar in _bars(d, (x - RIB_LENGTH_MM / 2, x + RIB_LENGTH_MM / 2), wall, face_mm)
    ]


def _bars(d: Dimensions, x: Point2, wall_mm: float, face_mm: float) -> list[cq.Shape]:
    """Upright bars on both sides from a wall to a face, sloped below the board."""
    bottom = d["led.board_bottom_z_mm"]
    low = max(bottom - LEAD_MM, d["cover.top_z_mm"])
    top = bottom + d["design.leds.board_thickness_mm"]
    outline = [(wall_mm, low), (face_mm, bottom), (face_mm, top), (wall_mm, top)]
    bars: list[cq.Shape] = []
    for side in (-1, 1):
        points = [cq.Vector(x[0], side * y, z) for y, z in [*outline, outline[0]]]
        wire = cq.Wire.makePolygon(points)
        bars.append(cq.Solid.extrudeLinear(wire, [], cq.Vector(x[1] - x[0], 0, 0)))
    return bars


def stops(d: Dimensions) -> list[cq.Shape]:
    """Stops at the tip ends of the boards, up from the cover."""
    end = board_middle_mm(d) + d["led.board_length_mm"] / 2
    half = d["led.board_width_mm"] / 2 - 0.1
    bottom = d["led.board_bottom_z_mm"]
    top = bottom + 0.75 * d["design.leds.board_thickness_mm"]
    across = (d["led.y_mm"] - half, d["led.y_mm"] + half)
    return [*pair((end, end + STOP_MM), across, (d["cover.top_z_mm"] - OVERLAP_MM, top))]


def _places_mm(d: Dimensions) -> tuple[float, float]:
    aside = SPREAD * d["led.board_length_mm"]
    return board_middle_mm(d) - aside, board_middle_mm(d) + aside
