"""A sheet with the dot holes, for laser cutting: spray or wipe ink through it onto the gel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_cad.markers.dxf import Drawing
from gelslim_cad.markers.layout import check_inside, tip_arrow
from gelslim_cad.markers.outline import Outline, as_outline
from ifem_export.markers.grid import MarkerGrid

_CORNER_MM = 2.0
_WALL_MM = 2.0


@dataclass(frozen=True, eq=False)
class StencilSheet:
    """A flat sheet in the sensor frame, seen from outside the gel, with its nominal sizes."""

    sheet: Outline
    gel: Outline
    holes_mm: NDArray[np.float64]
    """(m, 2) centres of the dot holes."""
    hole_diameter_mm: NDArray[np.float64]
    """(m,) diameters of the dot holes."""
    alignment_mm: NDArray[np.float64]
    """(4, 2) centres of the alignment holes; no turn or flip maps the four onto themselves."""
    alignment_diameter_mm: float
    arrow_mm: NDArray[np.float64]
    """(7, 2) arrow that points to the tip."""


def lay_out_stencil(
    grid: MarkerGrid,
    gel_outline: Outline | ArrayLike,
    *,
    border_mm: float = 12.0,
    alignment_diameter_mm: float = 3.0,
) -> StencilSheet:
    """Return the stencil sheet: the gel's bounding box and `border_mm` on each side.

    The alignment holes take dowel pins; one is displaced so that the sheet fits the pins in one
    way only. Raises ValueError when a dot crosses the gel's outline or the border has no room
    for the alignment holes with 2 mm of wall on each side.
    """
    gel = as_outline(gel_outline)
    check_inside(grid, gel)
    needed_mm = alignment_diameter_mm + 2 * _WALL_MM
    if not (alignment_diameter_mm > 0 and border_mm >= needed_mm):
        raise ValueError(
            f"stencil border {border_mm:g} mm is too narrow for alignment holes of "
            f"{alignment_diameter_mm:g} mm: at least {needed_mm:g} mm are needed"
        )
    x0, y0, x1, y1 = gel.bounds_mm
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    frame = Outline.rounded_rectangle(x1 - x0 + 2 * border_mm, y1 - y0 + 2 * border_mm, _CORNER_MM)
    reach = border_mm / 2
    pins = np.array(
        [
            (x0 - reach, y0 - reach),
            (x1 + reach, y0 - reach),
            (x1 + reach - 2 * alignment_diameter_mm, y1 + reach),
            (x0 - reach, y1 + reach),
        ]
    )
    length = min(6.0, border_mm - 2 * _WALL_MM)
    return StencilSheet(
        sheet=Outline(frame.points_mm + middle, frame.bulges),
        gel=gel,
        holes_mm=grid.positions_mm,
        hole_diameter_mm=grid.diameter_mm,
        alignment_mm=pins,
        alignment_diameter_mm=alignment_diameter_mm,
        arrow_mm=tip_arrow((x1 + _WALL_MM, float(middle[1])), length, 0.45 * length),
    )


def render_stencil(sheet: StencilSheet, *, kerf_mm: float = 0.0) -> bytes:
    """Return the stencil as DXF R2010 in mm with layers HOLES, ALIGNMENT, SHEET and ENGRAVE.

    `kerf_mm` is the width the beam removes: holes are drawn smaller and the sheet larger by it,
    so that the cut part has the sizes wanted. ENGRAVE (gel outline, tip arrow) is to be marked
    and not cut. Raises ValueError when the kerf is negative or not smaller than a hole.
    """
    if not 0 <= kerf_mm < sheet.hole_diameter_mm.min():
        raise ValueError(
            f"stencil kerf_mm = {kerf_mm:g}: must be at least 0 and smaller than the smallest "
            f"hole, {sheet.hole_diameter_mm.min():g} mm; use a finer beam or larger dots"
        )
    drawing = Drawing()
    for layer in ("HOLES", "ALIGNMENT", "SHEET", "ENGRAVE"):
        drawing.add_layer(layer)
    drawing.add_circles("HOLES", sheet.holes_mm, sheet.hole_diameter_mm - kerf_mm)
    pins = np.full(len(sheet.alignment_mm), sheet.alignment_diameter_mm - kerf_mm)
    drawing.add_circles("ALIGNMENT", sheet.alignment_mm, pins)
    drawing.add_outline("SHEET", _grown(sheet.sheet, kerf_mm))
    drawing.add_outline("ENGRAVE", sheet.gel)
    drawing.add_outline("ENGRAVE", Outline.polygon(sheet.arrow_mm))
    return drawing.to_bytes()


def _grown(sheet: Outline, kerf_mm: float) -> Outline:
    x0, y0, x1, y1 = sheet.bounds_mm
    grown = Outline.rounded_rectangle(
        x1 - x0 + kerf_mm, y1 - y0 + kerf_mm, _CORNER_MM + kerf_mm / 2
    )
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    return Outline(grown.points_mm + middle, grown.bulges)
