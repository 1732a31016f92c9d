"""The marker print as DXF R2010, in mm; the same content gives the same bytes."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_cad.markers.layout import CROSS_ARM_MM, lay_out, notes
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import MarkerGrid

_TEXT_MM = 2.0
_MILLIMETRES = 4
_COLOURS = {"MARKERS": 7, "HOLES": 7, "OUTLINE": 5, "SHEET": 1, "ALIGNMENT": 3, "ENGRAVE": 4}
_OTHER_COLOUR = 8


def render_dxf(grid: MarkerGrid, gel_outline: Outline) -> bytes:
    """Return a DXF with the dots as circles on MARKERS and the gel's closed outline on OUTLINE.

    REGISTRATION carries crosses outside the gel, NOTES an arrow to the tip and the view in
    words. Coordinates are those of the sensor frame (outside view).
    Raises ValueError when a dot crosses the outline.
    """
    layout = lay_out(grid, gel_outline)
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


class Drawing:
    """Circles, closed outlines, lines and text on named layers; x and y in mm, $INSUNITS mm."""

    def __init__(self) -> None:
        import ezdxf

        with fixed_metadata():
            self._document: Any = ezdxf.new("R2010", setup=False, units=_MILLIMETRES)
        self._document.header["$MEASUREMENT"] = 1
        self._space: Any = self._document.modelspace()
        self._circles_mm: list[NDArray[np.float64]] = []

    def add_layer(self, name: str) -> None:
        """Add a layer; each of the drawing's layers is added before anything is put on it."""
        self._document.layers.add(name, color=_COLOURS.get(name, _OTHER_COLOUR))

    def add_circles(
        self, layer: str, centres_mm: NDArray[np.float64], diameter_mm: NDArray[np.float64]
    ) -> None:
        """Add circles at `centres_mm` (n, 2) with `diameter_mm` (n,)."""
        reach = np.asarray(diameter_mm)[:, None] / 2
        self._circles_mm += [np.round(centres_mm, 6) - reach, np.round(centres_mm, 6) + reach]
        for centre, diameter in zip(centres_mm, diameter_mm, strict=True):
            self._space.add_circle(_point(centre), float(diameter) / 2, dxfattribs={"layer": layer})

    def add_outline(self, layer: str, outline: Outline) -> None:
        """Add a closed polyline; arcs stay arcs."""
        corners = [
            (*_point(p), float(b)) for p, b in zip(outline.points_mm, outline.bulges, strict=True)
        ]
        self._space.add_lwpolyline(corners, "xyb", close=True, dxfattribs={"layer": layer})

    def add_line(self, layer: str, start_mm: ArrayLike, end_mm: ArrayLike) -> None:
        """Add a straight line between two points (2,)."""
        self._space.add_line(_point(start_mm), _point(end_mm), dxfattribs={"layer": layer})

    def add_text(self, layer: str, text: str, at_mm: ArrayLike, height_mm: float) -> None:
        """Add a line of text whose lower left corner is `at_mm` (2,)."""
        self._space.add_text(
            text, height=height_mm, dxfattribs={"layer": layer, "insert": _point(at_mm)}
        )

    def to_bytes(self) -> bytes:
        """Return the file. View and extents are set to the content, dates and ids are fixed."""
        extents = self._extents()
        if extents.has_data:
            low, high = (
                (round(p.x, 6), round(p.y, 6), 0.0) for p in (extents.extmin, extents.extmax)
            )
            self._space.dxf.extmin, self._space.dxf.extmax = low, high
            self._document.header["$EXTMIN"], self._document.header["$EXTMAX"] = low, high
            self._document.set_modelspace_vport(
                height=1.1 * max(high[1] - low[1], high[0] - low[0]),
                center=((low[0] + high[0]) / 2, (low[1] + high[1]) / 2),
            )
        # The library would add these from a set, in an order that changes with the process.
        classes = self._document.classes
        classes.add_required_classes(self._document.dxfversion)
        classes.classes = dict(sorted(classes.classes.items()))
        text = io.StringIO()
        with fixed_metadata():
            self._document.write(text)
        return text.getvalue().encode("utf-8")

    def _extents(self) -> Any:
        """Box around everything; ezdxf would approximate each circle by Bézier curves."""
        from ezdxf import bbox

        box = bbox.extents(entity for entity in self._space if entity.dxftype() != "CIRCLE")
        for corners in self._circles_mm:
            if len(corners):
                box.extend([(*corners.min(axis=0), 0.0), (*corners.max(axis=0), 0.0)])
        return box


@contextmanager
def fixed_metadata() -> Iterator[None]:
    """Have ezdxf write a fixed date, GUIDs and version note instead of today's."""
    from ezdxf import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def _point(values: ArrayLike) -> tuple[float, float]:
    x, y = np.round(np.asarray(values, dtype=np.float64), 6) + 0.0
    return float(x), float(y)
