"""The marker print as PDF, 1:1 on a paper size that an office printer has."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.layout import CROSS_ARM_MM, SheetLayout, decimal, lay_out, notes
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import MarkerGrid

SCALE_BAR_MM = 50.0
"""Length of the scale bars: long enough to see a printer's 1 % with a ruler."""
_MM = 72.0 / 25.4
_PAPERS_MM = ((210.0, 297.0), (297.0, 420.0), (420.0, 594.0))
"""A4, A3 and A2."""
_MARGIN_MM = 15.0
_HEAD_MM = 38.0
_FOOT_MM = 76.0
_SIDE_MM = 12.0
_LINE_MM = 0.1


def render_pdf(grid: MarkerGrid, gel_outline: Outline, *, mirrored: bool = False) -> bytes:
    """Return a one-page PDF to print at 100 %, with a 50 mm scale bar in each direction.

    The page is A4 if the drawing fits, else the next larger size, else a page of its own.
    Raises ValueError when a dot crosses the outline.
    """
    from reportlab.pdfgen.canvas import Canvas

    layout = lay_out(grid, gel_outline, mirrored=mirrored)
    wide, tall = _page_mm(layout)
    file = io.BytesIO()
    canvas = Canvas(file, pagesize=(wide * _MM, tall * _MM), invariant=1, pageCompression=1)
    canvas.setTitle(f"Gel marker print, {layout.view}")
    canvas.setCreator("gelslim-cad")
    canvas.setAuthor("gelslim-cad")
    canvas.setSubject("Print at 100 %")
    # Viewers that honour it then offer no fit-to-page.
    canvas.setViewerPreference("PrintScaling", "None")
    canvas.scale(_MM, _MM)
    _draw_head(canvas, notes(grid, layout), tall)
    x0, y0, x1, y1 = layout.box_mm
    canvas.saveState()
    canvas.translate(
        (wide - x0 - x1) / 2, _FOOT_MM + (tall - _HEAD_MM - _FOOT_MM) / 2 - (y0 + y1) / 2
    )
    _draw_sheet(canvas, grid, layout)
    canvas.restoreState()
    _draw_rulers(canvas)
    canvas.showPage()
    canvas.save()
    return file.getvalue()


def _page_mm(layout: SheetLayout) -> tuple[float, float]:
    x0, y0, x1, y1 = layout.box_mm
    need = (x1 - x0 + 2 * _SIDE_MM, y1 - y0 + _HEAD_MM + _FOOT_MM)
    for short, long in _PAPERS_MM:
        for wide, tall in ((short, long), (long, short)):
            if need[0] <= wide and need[1] <= tall:
                return wide, tall
    return max(need[0], 150.0), need[1]


def _draw_head(canvas: Any, lines: list[str], tall: float) -> None:
    canvas.setFillGray(0)
    canvas.setFont("Helvetica-Bold", 5.0)
    canvas.drawString(_MARGIN_MM, tall - _MARGIN_MM - 3.0, "Gel marker print")
    canvas.setFont("Helvetica", 3.2)
    for i, line in enumerate(lines):
        canvas.drawString(_MARGIN_MM, tall - _MARGIN_MM - 9.0 - 4.5 * i, line)


def _draw_sheet(canvas: Any, grid: MarkerGrid, layout: SheetLayout) -> None:
    canvas.setFillGray(0)
    canvas.setStrokeGray(0)
    for (x, y), diameter in zip(layout.dots_mm, grid.diameter_mm, strict=True):
        canvas.circle(float(x), float(y), float(diameter) / 2, stroke=0, fill=1)
    canvas.setLineWidth(_LINE_MM)
    for x, y in layout.crosses_mm.tolist():
        canvas.line(x - CROSS_ARM_MM, y, x + CROSS_ARM_MM, y)
        canvas.line(x, y - CROSS_ARM_MM, x, y + CROSS_ARM_MM)
        canvas.circle(x, y, CROSS_ARM_MM / 2, stroke=1, fill=0)
    _draw_polygon(canvas, layout.arrow_mm, fill=1)
    canvas.setFont("Helvetica", 2.4)
    tail = (float(layout.arrow_mm[:, 0].min()), float(layout.arrow_mm[:, 1].max()) + 0.6)
    canvas.drawString(*tail, "tip")
    canvas.setStrokeColorRGB(0.0, 0.38, 0.75)
    _draw_polygon(canvas, layout.outline.flattened(), fill=0)


def _draw_polygon(canvas: Any, points: NDArray[np.float64], fill: int) -> None:
    path = canvas.beginPath()
    path.moveTo(*points[0].tolist())
    for point in points[1:].tolist():
        path.lineTo(*point)
    path.close()
    canvas.drawPath(path, stroke=1 - fill, fill=fill)


def _draw_rulers(canvas: Any) -> None:
    """Draw an L of two 50 mm bars, for a printer may stretch one direction only."""
    canvas.setFillGray(0)
    canvas.setStrokeGray(0)
    canvas.setLineWidth(0.2)
    left, low = _MARGIN_MM, _MARGIN_MM
    canvas.line(left, low, left + SCALE_BAR_MM, low)
    canvas.line(left, low, left, low + SCALE_BAR_MM)
    canvas.setFont("Helvetica", 2.4)
    canvas.setLineWidth(0.1)
    for step in range(int(SCALE_BAR_MM) + 1):
        tick = 2.4 if step % 10 == 0 else 1.6 if step % 5 == 0 else 1.0
        canvas.line(left + step, low, left + step, low + tick)
        canvas.line(left, low + step, left + tick, low + step)
        if step % 10 == 0 and step:
            label = f"{step} mm" if step == int(SCALE_BAR_MM) else str(step)
            canvas.drawCentredString(left + step, low + 3.2, label)
            canvas.drawString(left + 3.0, low + step - 0.9, label)
    words = left + 11.0
    canvas.setFont("Helvetica-Bold", 4.0)
    canvas.drawString(words, low + 40.0, 'Print at 100 % ("actual size"), without "fit to page".')
    canvas.setFont("Helvetica", 3.2)
    size = decimal(SCALE_BAR_MM)
    lines = [
        f"Then measure: each bar must be {size} mm long. If it is not, do not use the print;",
        "the marker pitch would not match the stiffness bundle.",
        "Align the crosses and the blue outline with the gel; the arrow points to the finger tip.",
    ]
    for i, line in enumerate(lines):
        canvas.drawString(words, low + 34.0 - 4.8 * i, line)
