import math

import numpy as np
import pytest
import shapely
from ifem_shapes import disc

from ifem_export.errors import OutlineError
from ifem_export.mesh.outline import RoundedRectangle


def counted_area(outline, n: int = 1500) -> float:
    """Area by counting a fine midpoint grid over the bounding box."""
    x0, y0, x1, y1 = outline.bounds_mm
    x = x0 + (np.arange(n) + 0.5) * (x1 - x0) / n
    y = y0 + (np.arange(n) + 0.5) * (y1 - y0) / n
    return float(outline.contains(x[:, None], y[None, :]).mean()) * (x1 - x0) * (y1 - y0)


@pytest.mark.parametrize(
    "outline",
    [
        RoundedRectangle(20.0, 14.0, 3.0),
        RoundedRectangle(5.0, 5.0),
        disc(7.0),
        RoundedRectangle(3.0, 40.0, 1.0),
    ],
    ids=["rounded", "square", "disc", "long"],
)
def test_area_matches_the_inside_test(outline):
    assert counted_area(outline) == pytest.approx(outline.area_mm2, rel=5e-4)


def test_rounded_rectangle_agrees_with_shapely():
    core = shapely.box(-7, -4, 7, 4)
    reference = core.buffer(3.0, quad_segs=400)
    x, y = np.random.default_rng(5).uniform(-11, 11, (2, 20000))
    off_edge = np.abs(shapely.distance(reference.exterior, shapely.points(x, y))) > 1e-3
    inside = RoundedRectangle(20.0, 14.0, 3.0).contains(x, y)
    assert np.array_equal(inside[off_edge], shapely.contains_xy(reference, x, y)[off_edge])


def test_boundary_counts_as_inside():
    assert RoundedRectangle(4.0, 2.0, 0.5).contains([2.0, -2.0, 0.0], [0.0, 0.0, 1.0]).all()
    assert disc(1.5).contains(1.5 * np.cos([0.1, 2.0]), 1.5 * np.sin([0.1, 2.0])).all()
    assert not RoundedRectangle(4.0, 2.0).contains([2 + 1e-6, 1.0], [0.5, 1 + 1e-6]).any()
    assert not RoundedRectangle(4.0, 2.0).contains(0.5, 1.5)
    assert RoundedRectangle(2.0, 4.0).contains(0.5, 1.5)


@pytest.mark.parametrize(
    ("sides", "field"),
    [
        ((0.0, 1.0), "length_mm"),
        ((1.0, math.inf), "width_mm"),
        ((True, 1.0), "length_mm"),
        ((4.0, 2.0, 1.01), "corner_radius_mm"),
        ((2.0, 4.0, 1.01), "corner_radius_mm"),
        ((4.0, 2.0, -0.1), "corner_radius_mm"),
    ],
)
def test_impossible_outlines_are_refused(sides, field):
    with pytest.raises(OutlineError) as caught:
        RoundedRectangle(*sides)
    names = ("length_mm", "width_mm", "corner_radius_mm")
    assert caught.value.field == field
    assert caught.value.value == sides[names.index(field)]
