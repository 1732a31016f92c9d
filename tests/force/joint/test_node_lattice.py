"""Values and slopes between the nodes of a lattice, and regions of nodes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from gelslim_force.joint.node_lattice import NodeLattice

Array = NDArray[np.float64]
STEP_MM = np.array([0.7, 0.5])
X, Y = np.arange(9) * 0.7 - 2.0, np.arange(11) * 0.5 - 1.0


def lattice(missing: int = 0) -> tuple[NodeLattice, Array]:
    """9 x 11 nodes in random order, without some at the first corner."""
    points = np.column_stack([a.ravel() for a in np.meshgrid(X, Y, indexing="ij")])[missing:]
    points = np.random.default_rng(3).permutation(points)
    return NodeLattice.of(np.column_stack([points, np.zeros(len(points))]), STEP_MM), points


def inner(count: int) -> Array:
    rng = np.random.default_rng(5)
    return np.column_stack([rng.uniform(a[2], a[-3], count) for a in (X, Y)])


def test_slopes_of_a_quadratic_height_are_exact() -> None:
    found, nodes = lattice()
    at = inner(60)
    height = 0.3 + nodes @ [0.2, -0.1] + 0.5 * nodes[:, 0] ** 2 - nodes[:, 0] * nodes[:, 1]
    along, across = found.slopes_at(at).slopes(height).T
    np.testing.assert_allclose(along, 0.2 + at[:, 0] - at[:, 1], atol=1e-12)
    np.testing.assert_allclose(across, -0.1 - at[:, 0], atol=1e-12)


def test_slopes_of_a_wave_converge_with_the_square_of_the_spacing() -> None:
    errors = []
    for count in (12, 24, 48):
        axis = np.linspace(0, 6, count)
        nodes = np.column_stack([a.ravel() for a in np.meshgrid(axis, axis, indexing="ij")])
        found = NodeLattice.of(nodes, np.full(2, axis[1]))
        at = np.random.default_rng(1).uniform(1.5, 4.5, (200, 2))
        along = found.slopes_at(at).slopes(np.sin(nodes[:, 0]))[:, 0]
        errors.append(np.sqrt(np.mean((along - np.cos(at[:, 0])) ** 2)))
    rate = np.polyfit(np.log([12, 24, 48]), np.log(errors), 1)[0]
    assert rate < -1.8


def test_slopes_over_a_blur_of_a_cubic_height_are_exact() -> None:
    """The mean of 3 x² over a blur of the variance v is 3 (x² + v), that of 2 x y stays."""
    found, nodes = lattice()
    at, blur_mm = inner(60), 0.3
    height = nodes[:, 0] ** 3 + nodes[:, 0] ** 2 * nodes[:, 1]
    sharp, blurred = (found.slopes_at(at, b).slopes(height) for b in (0.0, blur_mm))
    np.testing.assert_allclose(blurred[:, 0] - sharp[:, 0], 3 * blur_mm**2, rtol=1e-9)
    np.testing.assert_allclose(blurred[:, 1] - sharp[:, 1], blur_mm**2, rtol=1e-9)


def test_slopes_of_a_wave_over_a_blur_are_weaker() -> None:
    """By exp(-v k² / 2) with the variance v and the wave number k."""
    axis = np.linspace(0, 6, 49)
    nodes = np.column_stack([a.ravel() for a in np.meshgrid(axis, axis, indexing="ij")])
    found = NodeLattice.of(nodes, np.full(2, axis[1]))
    at = np.random.default_rng(1).uniform(1.5, 4.5, (200, 2))
    height = np.sin(2 * nodes[:, 0])
    everywhere = np.ones((25, 25), dtype=bool)
    for near in (everywhere, ~everywhere):
        along = found.slopes_about(at, near, 0.1).slopes(height)[:, 0]
        exact = 2 * np.exp(-(0.1**2) * 2**2 / 2) * np.cos(2 * at[:, 0])
        share = np.dot(along, exact) / np.dot(exact, exact)
        assert share == pytest.approx(1.0, abs=0.003 if near.all() else 0.012)


def test_slopes_of_a_deformed_surface_are_those_of_the_moved_plane() -> None:
    """Points of the plane z = a + s·(x, y) stay on it under any motion along it."""
    found, nodes = lattice()
    slope, gradient = np.array([0.4, -0.3]), np.array([[0.2, -0.15], [0.1, -0.25]])
    moved = nodes @ gradient.T
    height = 0.1 + (nodes + moved) @ slope
    seen = found.slopes_at(inner(40)).on_deformed(moved).slopes(height)
    np.testing.assert_allclose(seen, np.tile(slope, (40, 1)), atol=1e-12)


def test_interpolation_is_exact_for_quadratic_values_and_linear_at_the_edge() -> None:
    found, nodes = lattice()
    at = inner(40)
    for points, bent in ((at, 1.0), (np.column_stack([at[:, 0], np.full(40, Y[0] + 0.1)]), 0.0)):
        values = nodes @ [0.2, -0.1] + bent * nodes[:, 0] ** 2
        expected = points @ [0.2, -0.1] + bent * points[:, 0] ** 2
        np.testing.assert_allclose(found.interpolation(points) @ values, expected, atol=1e-12)


def test_adjacent_nodes_are_one_step_apart() -> None:
    found, points = lattice(missing=7)
    chosen = np.random.default_rng(4).choice(len(points), 40, replace=False)
    apart = np.abs(points[chosen][:, None] - points[chosen]) / STEP_MM
    expected = np.isclose(apart.sum(axis=2), 1.0) & np.isclose(apart.max(axis=2), 1.0)
    np.testing.assert_array_equal(found.adjacent(chosen), expected)


def test_values_agree_with_scipy() -> None:
    found, nodes = lattice()
    values = np.random.default_rng(2).normal(size=(len(nodes), 3))
    table = np.zeros((len(X), len(Y), 3))
    place = [np.searchsorted(a, nodes[:, k] - 1e-9) for k, a in enumerate((X, Y))]
    table[place[0], place[1]] = values
    at = inner(50)
    expected = RegularGridInterpolator((X, Y), table)(at)
    np.testing.assert_allclose(found.values_at(values, at), expected, atol=1e-12)


def test_points_are_on_cells_with_all_corners_only() -> None:
    found, _ = lattice(missing=1)
    points = np.array([[X[0] + 0.1, Y[0] + 0.1], [X[1] + 0.1, Y[0] + 0.1], [X[-1] + 0.1, 0.0]])
    assert found.on(np.vstack([points, [[np.nan, 0.0]]])).tolist() == [False, True, False, False]


def test_regions_widen_and_are_filled() -> None:
    found, nodes = lattice()
    ring = [(x, y) for x in X[2:6] for y in Y[2:7] if x in X[[2, 5]] or y in Y[[2, 6]]]
    region = found.nearest(found.place_number(np.array(ring) + 0.1))
    assert region.sum() == 4 * 5
    wider = found.widened(region, 1)
    apart = np.abs((nodes[wider][:, None] - nodes[region][None]) / STEP_MM).sum(axis=2).min(axis=1)
    assert apart.max() <= 1 + 1e-9
    assert wider.sum() == 4 * 5 + 2 * 4 + 2 * 5
