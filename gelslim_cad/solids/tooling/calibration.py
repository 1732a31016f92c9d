"""Tooling for calibration: a target for the camera, a sphere for forces.

The target is a cap with a lattice of holes at a known pitch, hooked over the finger:

      from above                         across (looking to the tip)
      .--------------------.             .------------------------.
      |  ················  |]            |      plate, holes      |
      |  ·······O·O······  |] tip        |~~~.________________.~~~|    z = 0: gel's outer surface
      |  ················  |]  hook      | |_|      gel       |_| |    rests (~) on the bezel
      '--------------------'             |  |     finger     |  |      side hooks

The middle hole and its neighbour towards the tip are larger: they mark origin and x axis. Rests
on the bezel keep the lattice in the plane z = 0, where it touches the gel without pressing it.

The indenter is a spherical cap of known radius on a flange:

     .-""-.         spherical cap, radius R
     |    |         stem, as thick as the cap
.----'    '----.
|  o        o  |    flange with two holes for M3, onto a force gauge
'--------------'
"""

from __future__ import annotations

import math

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.materials import PRINTED
from gelslim_cad.solids.shapes import (
    Hole,
    Piece,
    Point2,
    closed_wire,
    prism,
    rectangle,
    rounded_polygon,
    single,
    union,
)

PLATE_MM = 3.0
HOOK_MM = 2.5
HOOK_REACH_MM = 4.0
LIP_MM = 0.6
REST_GAP_MM = 1.0
"""Distance between the gel and the rests."""
LEAST_REST_MM = 0.05
PITCHES_MM = (1.0, 2.0, 2.5, 5.0, 10.0)
MOST_ACROSS = 11
MARK_RATIO = 1.6
TARGET = (0.12, 0.12, 0.13, 1.0)
RADIUS_MM = 5.0
FLANGE_MM = 24.0
FLANGE_WIDTH_MM = 14.0
FLANGE_THICKNESS_MM = 5.0
STEM_MM = 8.0
STEM_RATIO = 0.8
"""Radius of the stem over that of its cap."""
BOLT_MM = 3.4
BOLT_SPACING_MM = 16.0
INDENTER = (0.85, 0.86, 0.88, 1.0)


def target_pitch_mm(length_mm: float, width_mm: float) -> float:
    """Smallest pitch of PITCHES_MM with at most 11 holes along the longer side."""
    longest = max(length_mm, width_mm)
    return next((p for p in PITCHES_MM if longest / p <= MOST_ACROSS), PITCHES_MM[-1])


def target_holes(shape: GelShape) -> tuple[Hole, ...]:
    """Lattice of holes through the origin, all those that lie within the gel's outline."""
    pitch = target_pitch_mm(shape.length_mm, shape.width_mm)
    plain = 0.4 * pitch
    marked = {(0, 0), (1, 0)}
    reach_x = math.floor(shape.length_mm / 2 / pitch)
    reach_y = math.floor(shape.width_mm / 2 / pitch)
    holes: list[Hole] = []
    for i in range(-reach_x, reach_x + 1):
        for j in range(-reach_y, reach_y + 1):
            diameter = plain * (MARK_RATIO if (i, j) in marked else 1.0)
            if _inside(shape, i * pitch, j * pitch, diameter / 2 + 0.1):
                holes.append((i * pitch, j * pitch, diameter))
    return tuple(holes)


def _inside(shape: GelShape, x: float, y: float, inset: float) -> bool:
    """Whether a disc of radius `inset` lies within the outline."""
    r = max(shape.corner_radius_mm, inset)
    dx = max(abs(x) - (shape.length_mm / 2 - r), 0.0)
    dy = max(abs(y) - (shape.width_mm / 2 - r), 0.0)
    return math.hypot(dx, dy) <= r - inset + 1e-9


def calibration_target(d: Dimensions) -> Part:
    """The target in the sensor frame, its lattice plane at z = 0 on the gel."""
    shape = GelShape.of(d)
    fit = float(d["design.housing.fit_clearance_mm"])
    inner_x = float(d["finger.tip_x_mm"]) + fit
    inner_y = float(d["finger.width_mm"]) / 2 + fit
    start = -shape.length_mm / 2 - 4.0
    outer_x, outer_y = inner_x + HOOK_MM, inner_y + HOOK_MM
    plate_bounds = (start, outer_x + LIP_MM), (-outer_y - LIP_MM, outer_y + LIP_MM)
    plate = prism(rectangle(*plate_bounds, 2.0), (0.0, PLATE_MM), target_holes(shape))
    down = float(d["design.housing.gel_proud_mm"]) + HOOK_REACH_MM
    down = min(down, float(d["finger.thickness_mm"]) - 1.0)
    # Hooks and rests begin inside the plate, which overhangs them, so that no faces coincide.
    first = start + LIP_MM
    hooks = _u_shape(first, (outer_x, outer_y), (inner_x, inner_y))
    solids = [plate, prism(hooks, (-down, PLATE_MM / 2))]
    proud = float(d["design.housing.gel_proud_mm"])
    gel_end = shape.length_mm / 2 + REST_GAP_MM, shape.width_mm / 2 + REST_GAP_MM
    if proud >= LEAST_REST_MM and gel_end[0] < inner_x - 0.5 and gel_end[1] < inner_y - 0.5:
        middle = (inner_x + HOOK_MM / 2, inner_y + HOOK_MM / 2)
        rests = _u_shape(first + LIP_MM, middle, gel_end)
        solids.append(prism(rests, (-proud, 0.4 * PLATE_MM)))
    solid = union(solids)
    pitch = target_pitch_mm(shape.length_mm, shape.width_mm)
    return Part(
        name="calibration_target",
        solid=single(solid, "calibration_target"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=TARGET,
        in_assembly=False,
        print_rotation_deg=(180.0, 0.0, 0.0),
        note=f"holes at {pitch:g} mm pitch; print in matt black, fill the holes with white paste "
        "and set it on the finger, rests on the bezel, tip against its hook"
        + ("; touches only the crown's apex" if shape.crown_mm else ""),
        tags=frozenset({"tooling"}),
    )


def _u_shape(start_x: float, outer: Point2, inner: Point2) -> Outline:
    """U, open at `start_x` and closed at the tip, from its outer and inner corners (x, y)."""
    return rounded_polygon(
        [
            (start_x, -outer[1]),
            (outer[0], -outer[1]),
            (outer[0], outer[1]),
            (start_x, outer[1]),
            (start_x, inner[1]),
            (inner[0], inner[1]),
            (inner[0], -inner[1]),
            (start_x, -inner[1]),
        ],
        0.5,
    )


def indenter_radius_mm(shape: GelShape) -> float:
    """Radius of the sphere: 5 mm, or less for a gel that is too small for it."""
    return min(RADIUS_MM, 0.4 * min(shape.length_mm, shape.width_mm))


def sphere_indenter(d: Dimensions) -> Part:
    """The indenter, flange at z = 0, cap upwards."""
    radius = indenter_radius_mm(GelShape.of(d))
    apex = FLANGE_THICKNESS_MM + STEM_MM
    half = BOLT_SPACING_MM / 2
    flange = prism(
        rectangle(
            (-FLANGE_MM / 2, FLANGE_MM / 2), (-FLANGE_WIDTH_MM / 2, FLANGE_WIDTH_MM / 2), 3.0
        ),
        (0.0, FLANGE_THICKNESS_MM),
        [(-half, 0.0, BOLT_MM), (half, 0.0, BOLT_MM)],
    )
    solid = union([flange, _capped_stem(radius, apex)])
    return Part(
        name="sphere_indenter",
        solid=single(solid, "sphere_indenter"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=INDENTER,
        in_assembly=False,
        note=f"spherical cap of radius {radius:g} mm; polish it, screw it to a force gauge or "
        "load it with weights and press it on the gel",
        tags=frozenset({"tooling"}),
    )


def _capped_stem(radius: float, apex: float) -> cq.Solid:
    """Stem from z = 1 with a spherical cap, as one body of revolution.

    A sphere that is cut by a cylinder has edges whose curves leave its surface once they have been
    written to STEP; those of a body of revolution are circles of latitude.
    """
    side = STEM_RATIO * radius
    middle = apex - radius
    rim = middle + math.sqrt(radius**2 - side**2)
    halfway = (math.pi / 2 + math.acos(STEM_RATIO)) / 2
    between = (radius * math.cos(halfway), middle + radius * math.sin(halfway))
    pieces = [
        Piece(cq.Vector(0, 0, 1)),
        Piece(cq.Vector(side, 0, 1)),
        Piece(cq.Vector(side, 0, rim), cq.Vector(between[0], 0, between[1])),
        Piece(cq.Vector(0, 0, apex)),
    ]
    return cq.Solid.revolve(closed_wire(pieces), [], 360.0, cq.Vector(0, 0, 0), cq.Vector(0, 0, 1))
