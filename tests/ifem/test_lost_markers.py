"""Roughness and lost markers on small sets of markers, against their definition."""

from __future__ import annotations

import numpy as np
import pytest

from ifem_export.errors import InterpolationError
from ifem_export.markers.interpolation_matrix import (
    MarkerInterpolation,
    local_roughness,
    sparse_interpolation,
    thin_plate_interpolation,
)
from ifem_export.markers.thin_plate import affine, kernel, thin_plate

RNG = np.random.default_rng(0)
SETS = {
    "scattered": RNG.uniform(-5.0, 5.0, (40, 2)),
    "lattice": np.stack(np.meshgrid(np.arange(6) * 1.2, np.arange(5) * 1.2), -1).reshape(-1, 2),
    "oblong": np.stack(np.meshgrid(np.arange(6) * 1.2, np.arange(5) * 0.7), -1).reshape(-1, 2),
    "few": RNG.uniform(-1.0, 1.0, (5, 2)),
    "two lines": np.array([(x, y) for y in (0.0, 90.0) for x in range(12)], dtype=float),
}


def residuals(markers: np.ndarray) -> np.ndarray:
    """Row i gives the distance of value i from the plane fitted to the neighbours of marker i."""
    rows = np.zeros((len(markers), len(markers)))
    for i, marker in enumerate(markers):
        away = np.hypot(*(markers - marker).T)
        reach = np.sort(away)[min(8, len(markers) - 1)]
        near = np.flatnonzero(away <= reach * (1 + 1e-6))
        design = np.column_stack([np.ones(len(near)), (markers[near] - marker) / reach])
        for j, value in zip(near, np.eye(len(near)), strict=True):
            plane = np.linalg.lstsq(design, value, rcond=1e-6)[0]
            rows[i, j] = (value - design @ plane)[near == i][0]
    return rows


@pytest.mark.parametrize("name", SETS)
def test_roughness_is_the_squared_distance_from_locally_fitted_planes(name: str) -> None:
    rows = residuals(SETS[name])
    assert local_roughness(SETS[name]).toarray() == pytest.approx(rows.T @ rows, abs=1e-12)


@pytest.mark.parametrize("name", ["scattered", "lattice", "oblong"])
@pytest.mark.parametrize("make", [sparse_interpolation, thin_plate_interpolation])
def test_lost_values_minimise_the_roughness(name: str, make) -> None:
    markers = SETS[name]
    nodes = RNG.uniform(0.0, 3.0, (7, 2))
    whole = make(markers, nodes)
    lost = np.zeros(len(markers), dtype=bool)
    lost[[3, 9, 10, 20]] = True
    values = RNG.normal(size=(len(markers), 2))
    form = np.asarray(whole.roughness @ np.eye(len(markers)))
    filled = values.copy()
    filled[lost] = -np.linalg.solve(
        form[np.ix_(lost, lost)], form[np.ix_(lost, ~lost)] @ values[~lost]
    )
    expected = whole.to_nodes @ filled
    found = whole.with_missing(lost)
    assert found(np.where(lost[:, None], np.nan, values)) == pytest.approx(expected, abs=1e-9)
    assert (found.n_markers, found.n_nodes, found.lost.sum()) == (len(markers), 7, 4)
    dense = found.dense()
    assert dense @ np.where(lost[:, None], 0.0, values) == pytest.approx(expected, abs=1e-9)
    assert found.noise_gain() == pytest.approx(np.sqrt((dense**2).sum(axis=1)))
    back = RNG.normal(size=(7, 2))
    assert found.transposed(back) == pytest.approx(dense.T @ back, abs=1e-9)
    assert whole.transposed(back) == pytest.approx((whole.to_nodes.T @ back), abs=1e-12)


def square(form: np.ndarray) -> MarkerInterpolation:
    return MarkerInterpolation(SETS["few"], np.eye(5), form)


def test_the_first_marker_without_a_value_is_named() -> None:
    values = np.zeros((5, 2))
    values[[2, 4], [1, 0]] = np.nan
    with pytest.raises(InterpolationError) as caught:
        square(np.eye(5))(values)
    assert (caught.value.field, caught.value.value) == ("marker", 2)


def test_lost_markers_that_the_others_do_not_determine_are_refused() -> None:
    lost = np.array([True, True, False, False, False])
    form = np.diag([1.0, 1e-8, 1.0, 1.0, 1.0])
    assert square(form).with_missing(lost).fill is not None
    for change in ((1, 1, 0.0), (1, 1, -1.0)):
        bad = form.copy()
        bad[change[:2]] = change[2]
        with pytest.raises(InterpolationError) as caught:
            square(bad).with_missing(lost)
        assert (caught.value.field, caught.value.value) == ("mask", 2)
    # Relative to its diagonal, the smallest pivot of the block is the gap below.
    for gap, is_refused in ((1e-13, True), (1e-11, False)):
        near = form.copy()
        near[:2, :2] = [[4.0, 2.0 - gap], [2.0 - gap, 1.0]]
        if not is_refused:
            assert square(near).with_missing(lost).fill is not None
            continue
        with pytest.raises(InterpolationError):
            square(near).with_missing(lost)


def test_three_markers_left_are_enough_unless_they_are_on_a_line() -> None:
    markers = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.5, 1.0], [1.5, 1.2]])
    whole = thin_plate_interpolation(markers, markers)
    assert whole.with_missing(np.array([True, False, False, True, False])).lost.sum() == 2
    for mask, value in (
        ([False, False, False, True, True], 3),
        ([True, True, True, False, False], 2),
    ):
        with pytest.raises(InterpolationError) as caught:
            whole.with_missing(np.array(mask))
        assert (caught.value.field, caught.value.value) == ("mask", value)


def test_the_spline_is_the_solution_of_its_textbook_system() -> None:
    """Σ w_i φ(|x - x_i|) + affine, with weights orthogonal to affine fields (Duchon 1977)."""
    markers, nodes = SETS["scattered"] + [3.0, -1.0], RNG.uniform(-8.0, 8.0, (30, 2))
    away = np.hypot(*(markers[:, None] - markers).transpose(2, 0, 1))
    phi = np.where(away > 0, away**2 * np.log(np.where(away > 0, away, 1.0)), 0.0)
    plane = np.column_stack([np.ones(40), markers])
    system = np.block([[phi, plane], [plane.T, np.zeros((3, 3))]])
    weights = np.linalg.solve(system, np.eye(43)[:, :40])
    reach = np.hypot(*(nodes[:, None] - markers).transpose(2, 0, 1))
    expected = (reach**2 * np.log(reach)) @ weights[:40] + (
        np.column_stack([np.ones(30), nodes]) @ weights[40:]
    )
    found = thin_plate(markers, nodes)
    assert found.to_nodes == pytest.approx(expected, abs=1e-9)
    assert found.bending == pytest.approx(weights[:40], abs=1e-9)
    assert kernel(markers, markers) == pytest.approx(phi)
    assert affine(markers) == pytest.approx(plane)
