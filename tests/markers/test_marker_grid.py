import dataclasses

import numpy as np
import pytest

from ifem_export.errors import MarkerGridError
from ifem_export.markers.grid import ANCHOR_LARGE, REGULAR, build_marker_grid


def test_positions_are_a_centred_lattice_in_row_major_order():
    grid = build_marker_grid(5, 8, 1.2, 0.5)
    assert len(grid) == 40
    np.testing.assert_array_equal(grid.row * 8 + grid.column, np.arange(40))
    np.testing.assert_allclose(grid.positions_mm.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(grid.positions_mm[0], [-2.4, -4.2])
    np.testing.assert_allclose(grid.positions_mm[1] - grid.positions_mm[0], [0.0, 1.2])
    np.testing.assert_allclose(grid.positions_mm[8] - grid.positions_mm[0], [1.2, 0.0])
    np.testing.assert_array_equal(grid.index_map, np.arange(40).reshape(5, 8))


def test_odd_sized_anchors_are_larger_by_the_scale():
    grid = build_marker_grid(23, 25, 0.9, 0.4, "odd_sized", 1.4)
    large = grid.kind == ANCHOR_LARGE
    assert 4 <= large.sum() <= 8
    assert len(grid.omitted) == 0
    np.testing.assert_allclose(grid.diameter_mm[large], 0.56)
    np.testing.assert_allclose(grid.diameter_mm[~large], 0.4)
    assert grid.smallest_gap_mm == pytest.approx(0.9 - 0.48)


def test_omitted_anchors_use_the_same_sites_and_leave_no_dot():
    large = build_marker_grid(23, 25, 0.9, 0.4)
    gaps = build_marker_grid(23, 25, 0.9, 0.4, "omitted")
    np.testing.assert_array_equal(large.anchor_sites, gaps.anchor_sites)
    assert len(gaps) + len(gaps.omitted) == 23 * 25
    assert (gaps.index_map[tuple(gaps.omitted.T)] == -1).all()
    assert (gaps.kind == REGULAR).all()


def test_a_grid_without_anchors():
    grid = build_marker_grid(2, 3, 1.0, 0.4, "none")
    assert len(grid) == 6
    assert len(grid.anchor_sites) == 0


@pytest.mark.parametrize("anchors", ["odd_sized", "omitted"])
def test_a_round_gel_keeps_its_anchors_and_drops_crossing_dots(anchors):
    grid = build_marker_grid(21, 21, 1.0, 0.4, anchors)
    radius = 10.6
    clipped = grid.clipped(lambda p: np.hypot(p[:, 0], p[:, 1]) <= radius)
    reach = np.hypot(*grid.positions_mm.T) + grid.diameter_mm / 2
    # The rim is sampled, so a dot is safe up to the sagitta between two of 32 points.
    sagitta = grid.diameter_mm.max() / 2 * (1 - np.cos(np.pi / 32))
    assert np.sum(reach <= radius) <= len(clipped) <= np.sum(reach <= radius + sagitta)
    assert len(clipped) < len(grid)
    np.testing.assert_array_equal(clipped.anchor_sites, grid.anchor_sites)
    assert clipped.lattice_shape == (21, 21)
    order = clipped.row * 21 + clipped.column
    assert (np.diff(order) > 0).all()
    np.testing.assert_allclose(
        clipped.positions_mm, np.column_stack([clipped.row - 10, clipped.column - 10]), atol=1e-12
    )


def test_anchors_outside_the_outline_are_dropped():
    grid = build_marker_grid(21, 21, 1.0, 0.4, "omitted")
    half = grid.clipped(lambda p: p[:, 0] < -6.0)
    assert len(half.omitted) < len(grid.omitted)
    assert {tuple(s) for s in half.omitted} <= {tuple(s) for s in grid.omitted}


def test_clipping_everything_is_refused():
    grid = build_marker_grid(5, 5, 1.0, 0.4)
    for contains, field in (
        (lambda p: np.zeros(len(p), bool), "outline"),
        (lambda p: True, "contains"),
    ):
        with pytest.raises(MarkerGridError) as caught:
            grid.clipped(contains)
        assert caught.value.field == field


def test_arrays_are_read_only_copies():
    grid = build_marker_grid(5, 5, 1.0, 0.4)
    with pytest.raises(ValueError, match="read-only"):
        grid.positions_mm[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        grid.pitch_mm = 2.0


@pytest.mark.parametrize(
    ("request_", "field", "value"),
    [
        ((0, 5, 1.0, 0.4), "rows", 0),
        ((5, 2.5, 1.0, 0.4), "columns", 2.5),
        ((True, 5, 1.0, 0.4), "rows", True),
        ((5, 5, 0.0, 0.4), "pitch_mm", 0.0),
        ((5, 5, float("inf"), 0.4), "pitch_mm", float("inf")),
        ((5, 5, 1.0, -0.4), "diameter_mm", -0.4),
        ((5, 5, 1.0, 1.1), "diameter_mm", 1.1),
        ((5, 5, 1.0, 0.9), "pitch_mm", 1.0),
        ((5, 5, 1.0, 0.4, "odd"), "anchors", "odd"),
        ((5, 5, 1.0, 0.4, "odd_sized", 1.0), "anchor_scale", 1.0),
        ((4, 9, 1.0, 0.4), "anchors", (4, 9)),
    ],
)
def test_impossible_requests_name_the_argument(request_, field, value):
    with pytest.raises(MarkerGridError) as caught:
        build_marker_grid(*request_)
    assert (caught.value.field, caught.value.value) == (field, value)


def test_inconsistent_arrays_are_refused():
    grid = build_marker_grid(5, 5, 1.0, 0.4)
    moved = grid.positions_mm + np.array([0.01, 0.0])
    for change, field in (
        ({"positions_mm": moved}, "positions_mm"),
        ({"positions_mm": np.full((25, 2), np.nan)}, "positions_mm"),
        ({"row": grid.row[:-1]}, "positions_mm"),
        ({"omitted": np.array([[0, 0]])}, "sites"),
        ({"omitted": np.array([[9, 0]])}, "sites"),
        ({"kind": np.full(25, 2)}, "kind"),
        ({"diameter_mm": np.full(25, np.inf)}, "diameter_mm"),
        ({"row": grid.row + 0.5}, "row"),
    ):
        with pytest.raises(MarkerGridError) as caught:
            dataclasses.replace(grid, **change)
        assert caught.value.field == field
    names = ("positions_mm", "row", "column", "diameter_mm", "kind")
    backwards = {name: getattr(grid, name)[::-1] for name in names}
    with pytest.raises(MarkerGridError) as caught:
        dataclasses.replace(grid, **backwards)
    assert caught.value.field == "row"
