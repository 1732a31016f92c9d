"""Lattices of markers that are turned, off the centre, or of two pitches."""

from __future__ import annotations

import numpy as np
import pytest

from ifem_export.bundle.imported import Imported
from ifem_export.errors import MarkerGridError
from ifem_export.markers.grid import MarkerGrid, build_marker_grid
from ifem_export.markers.lattice_frame import LatticeFrame

FRAME = LatticeFrame(np.array([1.1, 0.1]), np.array([-0.1, 1.3]), np.array([0.4, -0.2]))
SHAPE = (5, 4)


def grid(diameter_mm: float = 0.4) -> MarkerGrid:
    sites = np.argwhere(np.ones(SHAPE, dtype=bool))
    return MarkerGrid(
        FRAME.places_mm(sites, SHAPE), sites[:, 0], sites[:, 1], np.full(20, diameter_mm),
        np.zeros(20), 1.2, SHAPE, np.zeros((0, 2)), FRAME,
    )  # fmt: skip


def test_a_square_frame_is_the_printed_lattice() -> None:
    printed = build_marker_grid(7, 6, 1.1, 0.4, anchors="none")
    sites = np.column_stack([printed.row, printed.column])
    found = LatticeFrame.square(1.1).places_mm(sites, printed.lattice_shape)
    np.testing.assert_allclose(found, printed.positions_mm, atol=1e-12)


def test_a_frame_is_fitted_to_places() -> None:
    sites = np.random.default_rng(1).permutation(np.argwhere(np.ones(SHAPE, dtype=bool)))[:9]
    found = LatticeFrame.fitted(sites, FRAME.places_mm(sites, SHAPE), SHAPE)
    np.testing.assert_allclose(found.steps_mm, FRAME.steps_mm, atol=1e-12)
    np.testing.assert_allclose(found.middle_mm, FRAME.middle_mm, atol=1e-12)


def test_distances_are_those_of_neighbours() -> None:
    found = grid()
    places = found.sites_mm([[1, 1], [2, 1], [1, 2], [2, 2]])
    apart = [np.hypot(*(places[k] - places[0])) for k in (1, 2, 3)]
    np.testing.assert_allclose(FRAME.pitches_mm, apart[:2])
    assert FRAME.diagonals_mm[0] == pytest.approx(apart[2])
    assert FRAME.diagonals_mm[1] == pytest.approx(np.hypot(*(places[1] - places[2])))
    assert found.smallest_gap_mm == pytest.approx(min(apart[:2]) - 0.4)


def test_clipping_keeps_the_frame() -> None:
    kept = grid().clipped(lambda points: points[:, 0] > 0)
    assert kept.frame is FRAME
    assert 0 < len(kept) < 20


@pytest.mark.parametrize(
    ("rows", "columns", "middle"),
    [
        ([1.0, 0.0], [1.0, 0.05], [0.0, 0.0]),
        ([0.0, 0.0], [0.0, 1.0], [0.0, 0.0]),
        ([1.0, np.nan], [0.0, 1.0], [0.0, 0.0]),
        ([1.0, 0.0], [0.0, 1.0], [0.0, 0.0, 0.0]),
    ],
)
def test_steps_that_span_no_plane_are_refused(
    rows: list[float], columns: list[float], middle: list[float]
) -> None:
    with pytest.raises(MarkerGridError):
        LatticeFrame(np.array(rows), np.array(columns), np.array(middle))


def test_a_marker_off_the_frame_and_dots_that_overlap_are_refused() -> None:
    good = grid()
    moved = good.positions_mm.copy()
    moved[3] += 0.01
    with pytest.raises(MarkerGridError):
        MarkerGrid(
            moved, good.row, good.column, good.diameter_mm, good.kind, 1.2, SHAPE,
            good.omitted, FRAME,
        )  # fmt: skip
    with pytest.raises(MarkerGridError):
        grid(diameter_mm=1.15)


def test_what_is_known_of_a_sensor_survives_its_file() -> None:
    told = Imported(FRAME, ("a.",), ("b.", "c."), (), ("d.",))
    found = Imported.from_record(told.to_record())
    assert found.to_record() == told.to_record()
    assert found.missing == ("d.",)
    with pytest.raises(KeyError):
        Imported.from_record({"lattice": FRAME.to_record()})
