import math

import numpy as np
import pytest
import shapely

from ifem_export.errors import OutlineError
from ifem_export.mesh.outline import Disc, Polygon, RoundedRectangle

RADII, ANGLES = np.tile([6.0, 3.0], 5), np.arange(10) * math.pi / 5
STAR = tuple(zip((RADII * np.cos(ANGLES)).tolist(), (RADII * np.sin(ANGLES)).tolist(), strict=True))


def counted_area(outline, n: int = 1500) -> float:
    """Area by counting a fine midpoint grid over the bounding box."""
    x0, y0, x1, y1 = outline.bounds_mm
    x = x0 + (np.arange(n) + 0.5) * (x1 - x0) / n
    y = y0 + (np.arange(n) + 0.5) * (y1 - y0) / n
    return float(outline.contains(x[:, None], y[None, :]).mean()) * (x1 - x0) * (y1 - y0)


@pytest.mark.parametrize(
    "outline",
    [RoundedRectangle(20.0, 14.0, 3.0), RoundedRectangle(5.0, 5.0), Disc(7.0), Polygon(STAR)],
    ids=["rounded", "square", "disc", "star"],
)
def test_area_matches_the_inside_test(outline):
    assert counted_area(outline) == pytest.approx(outline.area_mm2, rel=5e-4)


def test_polygon_contains_agrees_with_shapely():
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-7, 7, (2, 20000))
    reference = shapely.contains_xy(shapely.Polygon(STAR), x, y)
    assert np.array_equal(Polygon(STAR).contains(x, y), reference)
    assert np.array_equal(Polygon(STAR[::-1]).contains(x, y), reference)
    assert Polygon(STAR).area_mm2 == pytest.approx(shapely.Polygon(STAR).area, rel=1e-13)


def test_rounded_rectangle_agrees_with_shapely():
    core = shapely.box(-7, -4, 7, 4)
    reference = core.buffer(3.0, quad_segs=400)
    x, y = np.random.default_rng(5).uniform(-11, 11, (2, 20000))
    off_edge = np.abs(shapely.distance(reference.exterior, shapely.points(x, y))) > 1e-3
    inside = RoundedRectangle(20.0, 14.0, 3.0).contains(x, y)
    assert np.array_equal(inside[off_edge], shapely.contains_xy(reference, x, y)[off_edge])


def test_boundary_counts_as_inside():
    assert RoundedRectangle(4.0, 2.0, 0.5).contains([2.0, -2.0, 0.0], [0.0, 0.0, 1.0]).all()
    assert Disc(1.5).contains(1.5 * np.cos([0.1, 2.0]), 1.5 * np.sin([0.1, 2.0])).all()
    square = Polygon(((0, 0), (2, 0), (2, 2), (0, 2)))
    assert square.contains([0, 1, 2, 2, 0, 1], [1, 0, 1, 2, 0, 2]).all()
    assert not square.contains([-1e-6, 2 + 1e-6], [1, 1]).any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RoundedRectangle(0.0, 1.0), "length_mm"),
        (lambda: RoundedRectangle(1.0, math.nan), "width_mm"),
        (lambda: RoundedRectangle(4.0, 2.0, 1.01), "corner_radius_mm.*<= 1"),
        (lambda: RoundedRectangle(4.0, 2.0, -0.1), "corner_radius_mm"),
        (lambda: Disc(-1.0), "radius_mm"),
        (lambda: Polygon(((0, 0), (1, 0))), "n >= 3"),
        (lambda: Polygon(((0, 0), (1, 0), (2, 0))), "no area"),
        (lambda: Polygon(((0, 0), (0, 0), (1, 0), (1, 1))), "repeated"),
        (lambda: Polygon(((0, 0), (2, 2), (2, 0), (0, 1.5))), "cross"),
        (lambda: Polygon(((0, 0), (4, 0), (2, 0), (2, 2))), "cross or touch"),
        (lambda: Polygon(((0, 0), (4, 0), (4, 4), (2, 0), (0, 4))), "cross or touch"),
        (lambda: Polygon(((0, 0), (math.inf, 0), (1, 1))), "finite"),
    ],
)
def test_impossible_outlines_are_refused(make, message):
    with pytest.raises(OutlineError, match=message):
        make()
