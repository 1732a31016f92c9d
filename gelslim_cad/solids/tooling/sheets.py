"""Flat tooling that is cut from sheet: cutting template, marker stencil, fabric skin.

cutting template                marker stencil       fabric skin
      .----.                    .---------------.    .-----------------.
.-----'  o '-----.              | o           o |    |   side flap     |
| +  .------. +  |              |   · · · · ·   |    |- - - - - - - - -'-.
|    |      |  > |              |   · · · · ·   |    |       top       | .'.
| +  '------'  + |              | o         o   |    |      o gel      | |  | tip flap
'-----.  o .-----'              '---------------'    |                 | '.'
      '----'                                         |- - - - - - - - -.-'
o hole to hang it up            o alignment hole,    |   side flap     |
> points to the tip               one displaced      '-----------------'
+ alignment hole of the stencil                      - - fold line along an edge of the finger
"""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape, has_markers
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.stencil import PIN_MM, StencilSheet
from gelslim_cad.solids.shapes import SolidError, prism, rounded_polygon, single
from gelslim_cad.solids.tooling.mould import plate_stock
from ifem_export.markers.grid import MarkerGrid

LEAST_MM = 2.0
TAB_WIDTH_MM = 24.0
TAB_LENGTH_MM = 16.0
TAB_HOLE_MM = 5.0
ROUND_MM = 3.0
ARROW_MM = 4.0
ACRYLIC = (0.95, 0.70, 0.20, 0.75)
STENCIL_MM = 0.1
LEAST_WEB_MM = 0.05
MOST_HOLES = 2000
"""With more holes the check of the solid takes minutes, as it compares every pair of holes."""
FILM = (0.75, 0.75, 0.80, 0.9)
FABRIC_MM = 0.3
FABRIC_ROUND_MM = 1.0
SIDE_FRACTION = 0.6
LEAST_CORNER_MM = 2.0
FABRIC = (0.20, 0.22, 0.30, 1.0)


def cutting_template(d: Dimensions, sheet: StencilSheet) -> Part:
    """Frame whose opening is the gel's outline, on the alignment pins of the stencil `sheet`.

    Cut and markers are then aligned, because both use the same dowel pins. Without markers there
    are none to align, and no holes for pins.
    """
    pinned = has_markers(d)
    shape = GelShape.of(d)
    thickness, _ = plate_stock(d["manufacturing.acrylic_stock_mm"], LEAST_MM)
    x0, y0, x1, y1 = sheet.sheet.bounds_mm
    tab = min(TAB_WIDTH_MM, x1 - x0 - 2 * ROUND_MM) / 2
    far = TAB_LENGTH_MM
    frame = rounded_polygon(
        [
            (x0, y0),
            *((-tab, y0), (-tab, y0 - far), (tab, y0 - far), (tab, y0)),
            (x1, y0),
            (x1, y1),
            *((tab, y1), (tab, y1 + far), (-tab, y1 + far), (-tab, y1)),
            (x0, y1),
        ],
        ROUND_MM,
    )
    pins = [(x, y, PIN_MM) for x, y in sheet.alignment_mm.tolist() if pinned]
    middle = far - TAB_HOLE_MM / 2 - 4.0
    hang = [(0.0, y0 - middle, TAB_HOLE_MM), (0.0, y1 + middle, TAB_HOLE_MM)]
    tip = (shape.length_mm / 2 + x1) / 2 + ARROW_MM / 2
    arrow = Outline.polygon(
        [(tip, 0.0), (tip - ARROW_MM, ARROW_MM / 2), (tip - ARROW_MM, -ARROW_MM / 2)]
    )
    solid = prism(frame, (0.0, thickness), [*pins, *hang], [shape.outline, arrow])
    return Part(
        name="cutting_template",
        solid=single(solid, "cutting_template"),
        material="cast acrylic",
        process="laser",
        colour=ACRYLIC,
        in_assembly=False,
        note="cut the gel along the opening with a new scalpel, blade flat against the wall"
        + (f"; the {PIN_MM:g} mm pins register it with the marker stencil" if pinned else ""),
        tags=frozenset({"tooling"}),
    )


def stencil_problem(grid: MarkerGrid) -> str:
    """Reason why no stencil can be cut for the grid; empty when one can."""
    if grid.smallest_gap_mm < LEAST_WEB_MM:
        return (
            f"only {grid.smallest_gap_mm:.3f} mm of film would stay between two dots, at least "
            f"{LEAST_WEB_MM:g} mm are needed; use a larger markers.pitch_mm or smaller dots"
        )
    if len(grid) > MOST_HOLES:
        return (
            f"{len(grid)} holes are more than a stencil of {MOST_HOLES} takes; "
            "use a larger markers.pitch_mm, or print the dots"
        )
    return ""


def stencil(sheet: StencilSheet, grid: MarkerGrid) -> Part:
    """The stencil of the layout that the DXF is drawn from; see `markers.lay_out_stencil`.

    Raises SolidError where `stencil_problem` names a reason.
    """
    problem = stencil_problem(grid)
    if problem:
        raise SolidError(f"marker_stencil: {problem}")
    pins = [(x, y, PIN_MM) for x, y in sheet.alignment_mm.tolist()]
    dots = zip(*sheet.holes_mm.T.tolist(), sheet.hole_diameter_mm.tolist(), strict=True)
    return Part(
        name="marker_stencil",
        # The solid is not checked: that takes a second, and separate circles are always valid.
        solid=prism(sheet.sheet, (0.0, STENCIL_MM), [*pins, *dots]),
        material="polyester film",
        process="laser",
        colour=FILM,
        in_assembly=False,
        note=f"{len(grid)} holes in {STENCIL_MM:g} mm film; seen from outside the gel",
        tags=frozenset({"tooling"}),
    )


def skin_flap_mm(d: Dimensions) -> float:
    """Length of the side flaps: the gel's height above the body, and 60 % of the body."""
    proud = float(d["design.housing.gel_proud_mm"])
    return proud + SIDE_FRACTION * max(float(d["finger.thickness_mm"]) - proud, 5.0)


def skin_outline(d: Dimensions) -> Outline:
    """The pattern in the sensor frame, unfolded into the plane of the top.

    The flaps end before the finger's rounded corners. The concave corners between flap and top are
    rounded, so that the fabric does not tear there.
    """
    half = float(d["finger.width_mm"]) / 2
    start, tip = float(d["bezel.proximal_x_mm"]), float(d["finger.tip_x_mm"])
    flap = skin_flap_mm(d)
    corner = max(float(d["design.housing.corner_radius_mm"]), LEAST_CORNER_MM)
    corner = min(corner, 0.8 * half, 0.4 * (tip - start))
    right = [
        (start, -half - flap),
        (tip - corner, -half - flap),
        (tip - corner, -half),
        (tip, -half + corner),
        (tip + flap, -half + corner),
    ]
    return rounded_polygon([*right, *((x, -y) for x, y in reversed(right))], FABRIC_ROUND_MM)


def fabric_skin(d: Dimensions) -> Part:
    """Pattern that covers bezel and gel and folds over sides and tip."""
    return Part(
        name="fabric_skin",
        solid=single(prism(skin_outline(d), (0.0, FABRIC_MM)), "fabric_skin"),
        material="thin stretch fabric",
        process="cut",
        colour=FABRIC,
        in_assembly=False,
        note=f"glue the side flaps ({skin_flap_mm(d):.1f} mm) and the tip flap to the body, "
        "stretched smoothly over the gel; fit it last, it covers the bezel's screws",
        tags=frozenset({"tooling"}),
    )
