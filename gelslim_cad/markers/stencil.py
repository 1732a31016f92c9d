"""A sheet with the dot holes, for laser cutting: spray or wipe ink through it onto the gel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.dxf import Drawing
from gelslim_cad.markers.kerf import KerfError, offset_outline
from gelslim_cad.markers.layout import check_inside, tip_arrow
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import MarkerGrid

_CORNER_MM = 2.0
_WALL_MM = 2.0
_BORDER_MM = 12.0
PIN_MM = 3.0
"""Diameter of the dowel pins, which leave more than `_WALL_MM` of the border on each side."""


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
    arrow_mm: NDArray[np.float64]
    """(7, 2) arrow that points to the tip."""


def lay_out_stencil(grid: MarkerGrid, gel: Outline) -> StencilSheet:
    """Return the stencil sheet: the gel's bounding box and 12 mm on each side.

    The alignment holes take dowel pins; one is displaced so that the sheet fits the pins in one
    way only. Raises ValueError when a dot crosses the gel's outline.
    """
    check_inside(grid, gel)
    return replace(
        lay_out_frame(gel), holes_mm=grid.positions_mm, hole_diameter_mm=grid.diameter_mm
    )


def lay_out_frame(gel: Outline) -> StencilSheet:
    """Return the stencil sheet without dots, which the cutting template is made from."""
    x0, y0, x1, y1 = gel.bounds_mm
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    frame = Outline.rounded_rectangle(
        x1 - x0 + 2 * _BORDER_MM, y1 - y0 + 2 * _BORDER_MM, _CORNER_MM
    )
    reach = _BORDER_MM / 2
    pins = np.array(
        [
            (x0 - reach, y0 - reach),
            (x1 + reach, y0 - reach),
            (x1 + reach - 2 * PIN_MM, y1 + reach),
            (x0 - reach, y1 + reach),
        ]
    )
    length = min(6.0, _BORDER_MM - 2 * _WALL_MM)
    return StencilSheet(
        sheet=Outline(frame.points_mm + middle, frame.bulges),
        gel=gel,
        holes_mm=np.zeros((0, 2)),
        hole_diameter_mm=np.zeros(0),
        alignment_mm=pins,
        arrow_mm=tip_arrow((x1 + _WALL_MM, float(middle[1])), length, 0.45 * length),
    )


def render_stencil(sheet: StencilSheet, kerf_mm: float = 0.0) -> bytes:
    """Return the stencil as DXF R2010 in mm with layers HOLES, ALIGNMENT, SHEET and ENGRAVE.

    ENGRAVE (gel outline, tip arrow) is to be marked and not cut. Paths lie half the kerf outside
    the film that stays. Raises KerfError where a dot is narrower than the cut.
    """
    if kerf_mm >= min(float(sheet.hole_diameter_mm.min()), PIN_MM):
        raise KerfError(
            f"dots of {sheet.hole_diameter_mm.min():g} mm are narrower than a cut of {kerf_mm:g} "
            "mm; make manufacturing.kerf.film_mm smaller or the dots larger"
        )
    drawing = Drawing()
    for layer in ("HOLES", "ALIGNMENT", "SHEET", "ENGRAVE"):
        drawing.add_layer(layer)
    drawing.add_circles("HOLES", sheet.holes_mm, sheet.hole_diameter_mm - kerf_mm)
    pins = np.full(len(sheet.alignment_mm), PIN_MM - kerf_mm)
    drawing.add_circles("ALIGNMENT", sheet.alignment_mm, pins)
    drawing.add_outline("SHEET", offset_outline(sheet.sheet, kerf_mm / 2))
    drawing.add_outline("ENGRAVE", sheet.gel)
    drawing.add_outline("ENGRAVE", Outline.polygon(sheet.arrow_mm))
    return drawing.to_bytes()
