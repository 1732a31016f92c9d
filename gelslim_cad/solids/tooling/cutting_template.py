"""Cutting template: a frame whose opening is the gel's outline, to guide a scalpel.

      .----.
.-----'  o '-----.      tabs to hold it down, with a hole to hang it up
| +  .------. +  |
|    |      |  > |      > points to the tip
| +  '------'  + |      + alignment holes, where the stencil has them
'-----.  o .-----'
      '----'
"""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.stencil import StencilSheet
from gelslim_cad.solids.prism import prism, rounded_polygon
from gelslim_cad.solids.shapes import single
from gelslim_cad.solids.tooling.stock import plate_stock

LEAST_MM = 2.0
TAB_WIDTH_MM = 24.0
TAB_LENGTH_MM = 16.0
TAB_HOLE_MM = 5.0
ROUND_MM = 3.0
ARROW_MM = 4.0
ACRYLIC = (0.95, 0.70, 0.20, 0.75)


def cutting_template(d: Dimensions, sheet: StencilSheet) -> Part:
    """The template, on the alignment pins of the marker stencil `sheet`.

    Cut and markers are then aligned, because both use the same dowel pins.
    """
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
    pins = [(x, y, sheet.alignment_diameter_mm) for x, y in sheet.alignment_mm.tolist()]
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
        note="cut the gel along the opening with a new scalpel, blade flat against the wall; the "
        f"{sheet.alignment_diameter_mm:g} mm pins register it with the marker stencil",
        tags=frozenset({"tooling"}),
    )
