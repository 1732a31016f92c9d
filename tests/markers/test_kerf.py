"""Paths beside outlines, against Steiner's formula and shapely's buffer."""

from __future__ import annotations

import io
import math

import ezdxf
import numpy as np
import pytest
from ezdxf.path import make_path
from shapely.geometry import Polygon

from gelslim_cad.markers.kerf import KerfError, offset_gain_mm2, offset_outline
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import MarkerGrid

STAR = [(0, 0), (10, 0), (10, 4), (6, 4), (6, 7), (12, 9), (2, 12), (3, 5)]
BITE = Outline(np.array([(0, 0), (10, 0), (10, 6), (7, 6), (3, 6), (0, 6)]), [0, 0, 0, -1, 0, 0])
KEY = Outline(np.array([(-6, -1.0), (-3, -1), (-3, 1), (-6, 1)]), [0, 6.16, 0, 0])
"""A shank that meets a large circle in two sharp concave corners."""


def polygon(outline: Outline) -> Polygon:
    return Polygon(outline.flattened(1e-5))


@pytest.mark.parametrize("distance", [0.05, 0.3])
def test_convex_outlines_follow_steiners_formula(distance: float) -> None:
    square = Outline.rounded_rectangle(28, 20, 0)
    rounded = Outline.rounded_rectangle(28, 20, 3)
    disc = Outline.rounded_rectangle(20, 20, 10)
    for shape in (square, rounded, disc):
        before = polygon(shape)
        wanted = before.area + before.length * distance + math.pi * distance**2
        path = offset_outline(shape, distance)
        assert polygon(path).area == pytest.approx(wanted, rel=1e-6)
        assert offset_gain_mm2(shape, distance) == pytest.approx(wanted - before.area, rel=1e-4)
    # Convex corners become true arcs of that radius.
    path = offset_outline(square, distance)
    assert len(path.points_mm) == 8
    assert sorted(path.bulges) == pytest.approx([0] * 4 + [math.tan(math.pi / 8)] * 4)


@pytest.mark.parametrize("distance", [-0.4, -0.1, 0.1, 0.4])
@pytest.mark.parametrize("shape", [Outline.polygon(STAR), BITE, KEY], ids=["star", "bite", "key"])
def test_any_outline_is_shapelys_buffer(shape: Outline, distance: float) -> None:
    # A buffer rounds what it moves away from; inwards that is the complement's corner.
    true = polygon(shape).buffer(distance, quad_segs=2000)
    path = polygon(offset_outline(shape, distance))
    assert path.is_valid
    assert path.symmetric_difference(true).area < 2e-4 * true.area
    gain = offset_gain_mm2(shape, distance)
    assert polygon(shape).area + gain == pytest.approx(true.area, rel=1e-3)


def test_arcs_stay_arcs_and_outlines_of_no_distance_stay() -> None:
    path = offset_outline(BITE, 0.2)
    (bulge,) = [b for b in path.bulges if b < 0]
    k = list(path.bulges).index(bulge)
    start, end = path.points_mm[k], path.points_mm[(k + 1) % len(path.points_mm)]
    radius = np.hypot(*(end - start)) / (2 * math.sin(2 * math.atan(abs(bulge))))
    assert radius == pytest.approx(2.0 - 0.2)
    assert offset_outline(BITE, 0.0) is BITE


def test_details_narrower_than_the_cut_are_refused() -> None:
    rounded = Outline.rounded_rectangle(10, 10, 0.2)
    with pytest.raises(KerfError, match=r"0\.200"):
        offset_outline(rounded, -0.25)
    slot = Outline.polygon([(0, 0), (5, 0), (5, 0.3), (0, 0.3)])
    with pytest.raises(KerfError):
        offset_outline(slot, -0.2)


def test_stencil_keeps_its_film_and_its_dots(grid: MarkerGrid, outline: Outline) -> None:
    from gelslim_cad.markers.stencil import lay_out_stencil, render_stencil

    sheet = lay_out_stencil(grid, outline)
    drawing = ezdxf.read(io.StringIO(render_stencil(sheet, 0.1).decode()))
    dots = [e.dxf.radius for e in drawing.modelspace() if e.dxf.layer == "HOLES"]
    assert sorted(dots) == pytest.approx(sorted(sheet.hole_diameter_mm / 2 - 0.05))
    (film,) = [e for e in drawing.modelspace() if e.dxf.layer == "SHEET"]
    area = Polygon([(p.x, p.y) for p in make_path(film).flattening(1e-4)]).area
    assert area == pytest.approx(polygon(sheet.sheet).buffer(0.05, quad_segs=500).area, rel=1e-5)
    with pytest.raises(KerfError, match="narrower"):
        render_stencil(sheet, 1.5)
