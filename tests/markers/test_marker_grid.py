import dataclasses

import numpy as np
import pytest

from ifem_export.errors import MarkerGridError
from ifem_export.markers.grid import ANCHOR_LARGE, REGULAR, MarkerGrid, build_marker_grid


def some_dots(sites, diameters, shape, pitch=1.5):
    """A grid of regular dots at given sites."""
    sites = np.array(sites)
    return MarkerGrid(
        positions_mm=(sites - (np.array(shape) - 1) / 2) * pitch,
        row=sites[:, 0],
        column=sites[:, 1],
        diameter_mm=np.array(diameters),
        kind=np.zeros(len(sites)),
        pitch_mm=pitch,
        lattice_shape=shape,
        omitted=[],
    )


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


@pytest.mark.parametrize(
    ("sites", "shape", "reach"),
    [
        ([(0, 1), (1, 1)], (3, 4), 1.5),
        ([(2, 1), (2, 2)], (3, 4), 1.5),
        ([(0, 0), (1, 1)], (3, 4), 1.5 * 2**0.5),
        ([(0, 3), (1, 2)], (3, 4), 1.5 * 2**0.5),
        ([(0, 0), (2, 3)], (3, 4), np.inf),
    ],
)
def test_the_smallest_gap_is_between_neighbours_along_lines_and_diagonals(sites, shape, reach):
    grid = some_dots(sites, [0.3, 0.7], shape)
    assert grid.smallest_gap_mm == pytest.approx(reach - 0.5)
    assert grid.sites_mm([(0, 0), (2, 3)]) == pytest.approx(np.array([[-1.5, -2.25], [1.5, 2.25]]))


def test_dots_may_touch_and_not_overlap():
    sites = [(0, 0), (0, 1)]
    assert some_dots(sites, [1.5, 1.5], (1, 2)).smallest_gap_mm == 0.0
    assert len(some_dots(sites, [1.5 + 1e-10, 1.5], (1, 2))) == 2
    with pytest.raises(MarkerGridError) as caught:
        some_dots(sites, [1.5 + 1e-7, 1.5], (1, 2))
    assert (caught.value.field, caught.value.value) == ("pitch_mm", 1.5)
    assert len(build_marker_grid(1, 2, 1.5, 1.5, "none")) == 2


@pytest.mark.parametrize("off", [0.9e-4, 1.1e-4])
def test_a_dot_is_on_its_site_within_a_tenthousandth_of_the_pitch(off):
    grid = some_dots([(0, 0), (1, 1)], [0.5, 0.5], (2, 2), 3.0)
    moved = grid.positions_mm + np.array([0.0, 3.0 * off])
    if off < 1e-4:
        assert len(dataclasses.replace(grid, positions_mm=moved)) == 2
        return
    with pytest.raises(MarkerGridError) as caught:
        dataclasses.replace(grid, positions_mm=moved)
    assert caught.value.field == "positions_mm"
    assert caught.value.value == pytest.approx(off * 3.0)


def test_clipping_asks_for_32_points_on_the_rim_and_the_centre():
    grid = some_dots([(0, 0), (1, 2)], [0.4, 0.6], (2, 3))
    asked = []
    grid.clipped(lambda points: asked.append(points) or np.ones(len(points), bool))
    turn = np.arange(32) * 2 * np.pi / 32
    circle = np.vstack([np.column_stack([np.cos(turn), np.sin(turn)]), [[0.0, 0.0]]])
    expected = [p + d / 2 * circle for p, d in zip(grid.positions_mm, (0.4, 0.6), strict=True)]
    assert asked[0] == pytest.approx(np.vstack(expected))
    left = grid.clipped(lambda points: points[:, 1] < 0.0)
    assert (left.row.tolist(), left.diameter_mm.tolist()) == ([0], [0.4])


def test_an_omitted_site_is_clipped_as_the_largest_dot_left_would_be():
    sites = [(0, 0), (0, 1), (0, 3)]
    grid = dataclasses.replace(some_dots(sites, [0.2, 1.0, 0.3], (1, 5)), omitted=[[0, 4]])
    assert len(grid.clipped(lambda points: points[:, 1] < 3.45).omitted) == 0
    assert len(grid.clipped(lambda points: points[:, 1] < 3.55).omitted) == 1


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
        ((5, 5, 1.0, float("nan")), "diameter_mm", pytest.approx(float("nan"), nan_ok=True)),
        ((5, 5, 1.0, 0.4, "odd_sized", float("inf")), "anchor_scale", float("inf")),
    ],
)
def test_impossible_requests_name_the_argument(request_, field, value):
    with pytest.raises(MarkerGridError) as caught:
        build_marker_grid(*request_)
    assert (caught.value.field, caught.value.value) == (field, value)


def test_what_no_anchor_needs_is_not_checked():
    assert len(build_marker_grid(1, 1, 1.0, 1.0, "none", 0.5)) == 1
    assert len(build_marker_grid(np.int64(5), 6, 1.0, 0.4, "omitted", float("nan"))) == 26


def test_a_grid_without_dots_is_refused():
    with pytest.raises(MarkerGridError) as caught:
        some_dots(np.zeros((0, 2), int), [], (2, 2))
    assert caught.value.field == "row"


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
        ({"diameter_mm": np.zeros(25)}, "diameter_mm"),
        ({"row": grid.row + 0.5}, "row"),
        ({"row": grid.row - 1}, "sites"),
        ({"omitted": np.array([[5, 0]])}, "sites"),
        ({"omitted": np.array([[0, 5]])}, "sites"),
        ({"omitted": np.array([[6, -1]])}, "sites"),
        ({"pitch_mm": 0.0}, "pitch_mm"),
        ({"pitch_mm": np.inf}, "pitch_mm"),
        ({"lattice_shape": (25, 4)}, "sites"),
    ):
        with pytest.raises(MarkerGridError) as caught:
            dataclasses.replace(grid, **change)
        assert caught.value.field == field
    names = ("positions_mm", "row", "column", "diameter_mm", "kind")
    backwards = {name: getattr(grid, name)[::-1] for name in names}
    with pytest.raises(MarkerGridError) as caught:
        dataclasses.replace(grid, **backwards)
    assert caught.value.field == "row"
