import numpy as np
import pytest
import shapely
from outline_area import area_mm2

from gelslim_cad.markers.outline import Outline

L_SHAPE = [(0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5)]


@pytest.mark.parametrize("radius", [0.0, 2.0, 8.0])
def test_rounded_rectangle_has_the_closed_form_area(radius):
    outline = Outline.rounded_rectangle(20.0, 16.0, radius)
    assert area_mm2(outline) == pytest.approx(320.0 - (4 - np.pi) * radius**2, rel=1e-12)
    assert outline.bounds_mm == pytest.approx((-10, -8, 10, 8), abs=1e-3)
    assert shapely.Polygon(outline.flattened(0.001)).area == pytest.approx(
        area_mm2(outline), abs=0.06
    )


@pytest.mark.parametrize(
    "outline",
    [
        Outline.rounded_rectangle(10, 6, 3),
        Outline.polygon(L_SHAPE),
        Outline([(-2, 0), (2, 0)], [0.5, 1.0]),
    ],
    ids=["stadium", "L", "lens"],
)
def test_contains_agrees_with_shapely(outline):
    points = np.random.default_rng(3).uniform(-7, 7, (4000, 2))
    shape = shapely.Polygon(outline.flattened())
    np.testing.assert_array_equal(outline.contains(points), shapely.contains_xy(shape, points))
    assert 0 < outline.contains(points).sum() < 4000


def test_clockwise_input_is_turned_round_with_its_arcs():
    forward = Outline.rounded_rectangle(10, 6, 2)
    backward = Outline(forward.points_mm[::-1], -np.roll(forward.bulges[::-1], -1))
    assert area_mm2(backward) == pytest.approx(area_mm2(forward))
    np.testing.assert_array_equal(backward.points_mm, forward.points_mm)
    np.testing.assert_array_equal(backward.bulges, forward.bulges)


def test_mirror_image_is_a_reflection_in_x():
    outline = Outline([(0, 0), (5, 0), (5, 4)], [0.0, 0.3, 0.0])
    points = np.random.default_rng(4).uniform(-1, 7, (2000, 2))
    np.testing.assert_array_equal(
        outline.mirrored().contains(points * [1, -1]), outline.contains(points)
    )
    assert area_mm2(outline.mirrored()) == pytest.approx(area_mm2(outline))


@pytest.mark.parametrize("tolerance_mm", [0.2, 0.02, 0.002])
def test_chords_keep_within_the_tolerance_and_are_no_finer_than_it_asks(tolerance_mm):
    flat = Outline.rounded_rectangle(20, 16, 3).flattened(tolerance_mm)
    middle = (flat + np.roll(flat, -1, axis=0)) / 2
    from_centre = np.abs(middle) - [7, 5]
    rounded = (from_centre > 1e-9).all(axis=1)
    sagitta = 3 - np.hypot(*from_centre[rounded].T)
    assert 0.4 * tolerance_mm < sagitta.max() <= tolerance_mm * (1 + 1e-9)
