"""The marker print as DXF R2010, in mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gelslim_cad.markers.drawing import Drawing
from gelslim_cad.markers.layout import CROSS_ARM_MM, lay_out, notes
from gelslim_cad.markers.outline import Outline, as_outline
from ifem_export.markers.grid import MarkerGrid

_TEXT_MM = 2.0


def render_dxf(
    grid: MarkerGrid, gel_outline: Outline | ArrayLike, *, mirrored: bool = False
) -> bytes:
    """Return a DXF with the dots as circles on MARKERS and the gel's closed outline on OUTLINE.

    REGISTRATION carries crosses outside the gel, NOTES an arrow to the tip and the view in
    words. Coordinates are those of the sensor frame (outside view), y negated when `mirrored`.
    Raises ValueError when a dot crosses the outline.
    """
    layout = lay_out(grid, as_outline(gel_outline), mirrored=mirrored)
    drawing = Drawing()
    for layer in ("MARKERS", "OUTLINE", "REGISTRATION", "NOTES"):
        drawing.add_layer(layer)
    drawing.add_circles("MARKERS", layout.dots_mm, grid.diameter_mm)
    drawing.add_outline("OUTLINE", layout.outline)
    for cross in layout.crosses_mm:
        for arm in ((CROSS_ARM_MM, 0.0), (0.0, CROSS_ARM_MM)):
            drawing.add_line("REGISTRATION", cross - arm, cross + arm)
    drawing.add_outline("NOTES", Outline.polygon(layout.arrow_mm))
    tail = (layout.arrow_mm[:, 0].min(), layout.arrow_mm[:, 1].max() + 0.6)
    drawing.add_text("NOTES", "tip", tail, _TEXT_MM)
    left, low = layout.box_mm[:2]
    for i, line in enumerate(notes(grid, layout)):
        drawing.add_text("NOTES", line, np.array([left, low - 1.5 * _TEXT_MM * (i + 1)]), _TEXT_MM)
    return drawing.to_bytes()
