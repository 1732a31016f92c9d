"""Compiled steps of the joint estimate against the same in a few lines of NumPy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage, sparse

from gelslim_force.joint.kernels.fit_kernel import marker_data, sparse_product, sparse_rows
from gelslim_force.joint.kernels.light_kernel import gather_heights, gather_markers, light_data
from gelslim_force.joint.kernels.region_kernel import bins_above_noise
from gelslim_force.joint.light.sums import LightSums, placed_bins
from gelslim_force.joint.markers.rows import MarkerRows
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.normal_equations import Linearised, NormalEquations, huber
from gelslim_optics.light.light_law import SCATTERED, LightLaw

Array = NDArray[np.float64]
LAW = LightLaw(np.array([[0.0, 2.0], [0.3, -1.8]]), gamma=1.6)
STEP_MM = np.array([0.7, 0.5])


def lattice() -> NodeLattice:
    """14 x 12 nodes without some at two corners."""
    nodes = np.argwhere(np.ones((14, 12)))[2:-3]
    return NodeLattice.of((nodes * STEP_MM) - 3.0, STEP_MM)


def view(rng: np.random.Generator, found: NodeLattice) -> tuple[Any, Any]:
    """A view of 20 x 30 bins, some of them beyond the lattice, and what a frame shows."""
    x, y = np.meshgrid(np.linspace(-3.5, 6.8, 30), np.linspace(-3.2, 3.0, 20))
    rest, shape = np.stack([x, y], axis=-1), (20, 30)
    layers = {name: rng.uniform(0.2, 1.0, (2, *shape)) for name in ("level", "gain", "change")}
    return (
        SimpleNamespace(
            rest_mm=rest, nearest=found.nearest_node(rest.reshape(-1, 2)),
            lean=rng.normal(0, 0.4, (*shape, 2)), share=rng.uniform(0.2, 1.0, (2, 2, *shape)),
            level=layers["level"], area_mm2=rng.uniform(0.1, 0.2, shape), gain=layers["gain"],
            blur_mm=0.0, law=LAW,
        ),
        SimpleNamespace(
            shading=SimpleNamespace(valid=rng.random(shape) < 0.8), log_change=layers["change"],
            noise=rng.uniform(0.01, 0.02, (2, *shape)), saturated=rng.random((2, *shape)) < 0.1,
            independent=0.7,
        ),
    )  # fmt: skip


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_bins_are_placed_where_their_lines_of_sight_meet_the_gel(seed: int) -> None:
    rng, nodes = np.random.default_rng(seed), lattice()
    seen_from, seen = view(rng, nodes)
    count = len(nodes.place)
    moved = rng.normal(0, 0.1, (count, 3))
    near = nodes.widened(rng.random(count) < 0.05, 2)
    relief = rng.uniform(0.5, 1.0, (count, 2))
    found = placed_bins(seen_from, seen, nodes, moved, near, relief)
    rest, lean = seen_from.rest_mm.reshape(-1, 2), seen_from.lean.reshape(-1, 2)
    places = rest
    for _ in range(3):
        motion = nodes.values_at(moved, places)
        places = rest + lean * motion[:, 2:] - motion[:, :2]
    kept = nodes.on(places) & (nodes.values_at(near.astype(float), places) > 0.999)
    kept &= seen.shading.valid.ravel() & nodes.widened(near, 1)[seen_from.nearest]
    assert 20 < kept.sum() < 300
    np.testing.assert_array_equal(found.change, seen.log_change.reshape(2, -1)[:, kept])
    np.testing.assert_array_equal(found.share, seen_from.share.reshape(2, 2, -1)[..., kept])
    assert found.relief is not None
    np.testing.assert_allclose(found.relief, nodes.values_at(relief, places[kept]).T, atol=1e-12)
    flat, height = nodes.slopes_at(places[kept]), rng.normal(0, 0.1, count)
    along, across = flat.along, flat.across
    gradient = np.empty((kept.sum(), 2, 2))
    for axis in range(2):
        by_node = moved[flat.nodes, axis]
        gradient[:, axis] = np.stack([(along * by_node).sum(1), (across * by_node).sum(1)], -1)
    level = np.stack([(w * height[flat.nodes]).sum(axis=1) for w in (along, across)], axis=-1)
    turned = np.linalg.solve((np.eye(2) + gradient).swapaxes(1, 2), level[..., None])[..., 0]
    clear = np.linalg.det(np.eye(2) + gradient) > 0.3
    assert clear.mean() > 0.8
    np.testing.assert_allclose(found.taps.slopes(height)[clear], turned[clear], atol=1e-10)


def light(rng: np.random.Generator, count: int, relief: Array | None) -> dict[str, Array]:
    slope = rng.normal(0, 0.3, (count, 2))
    share = rng.uniform(0.2, 1.0, (2, 2, count))
    return {
        "slope": slope, "share": share / share.sum(axis=0),
        "level": rng.uniform(0.5, 1, (2, count)), "gain": 1.2 * rng.uniform(0.8, 1.2, (2, count)),
    } | ({} if relief is None else {"relief": relief})  # fmt: skip


@pytest.mark.parametrize("shaded", [False, True])
def test_data_of_the_light_are_those_of_its_law(shaded: bool) -> None:
    rng, count = np.random.default_rng(4), 300
    relief = rng.uniform(0.4, 1.0, (2, count)) if shaded else None
    given = light(rng, count, relief)
    change, noise = rng.normal(0, 0.3, (2, count)), rng.uniform(0.01, 0.1, (2, count))
    saturated, area = rng.random((2, count)) < 0.2, rng.uniform(0.5, 2.0, count)
    by_slope, sums = np.empty((2, count, 2)), np.zeros(5)
    by_gain, residual, weight = np.empty((3, 2, count))
    light_data(
        *LAW.irradiance(given["slope"]), change, noise, saturated, given["share"], given["level"],
        given["gain"], 1.2, np.empty((0, 0)) if relief is None else relief, area,
        (LAW.gamma, SCATTERED), (0.05, 0.2, 3.0), by_slope, by_gain, residual, weight, sums,
    )  # fmt: skip
    model, steep, grown = LAW.change(**given)
    grown = grown * given["gain"] / 1.2
    left = change - model
    sigma = np.hypot(0.05 / np.sqrt(area), noise)
    if relief is not None:
        lost = (given["share"] * np.abs(1 - relief)[:, None]).sum(axis=0)
        sigma = np.hypot(sigma, 0.2 * lost / np.sqrt(area))
    expected = np.where(saturated & (left < 0), 0.0, huber(left, sigma, 3.0))
    assert 0.1 < (np.abs(left) > 3 * sigma).mean() < 0.9
    np.testing.assert_allclose(residual, left, atol=1e-13)
    np.testing.assert_allclose(by_slope, steep, atol=1e-12)
    np.testing.assert_allclose(by_gain, grown, atol=1e-13)
    np.testing.assert_allclose(weight, expected, rtol=1e-10)
    terms = (grown * grown, grown * left, left * left, change * change, noise * noise)
    np.testing.assert_allclose(sums, [float((expected * t).sum()) for t in terms], rtol=1e-9)


def test_the_irradiance_is_that_of_the_law_in_numpy() -> None:
    slope = np.random.default_rng(6).normal(0, 0.8, (200, 2))
    width, root = LAW.penumbra, np.sqrt(1 + LAW.penumbra**2)
    towards = LAW.sensitivity / ((1 - LAW.ambient) * (1 + 1 / root) / (1 + root))

    def value(slope: Array) -> Array:
        lit = 1 - towards @ slope.T
        part = (lit + np.sqrt(lit * lit + width * width)) / (1 + root)
        return LAW.ambient + (1 - LAW.ambient) * part / np.sqrt(1 + (slope**2).sum(axis=1))

    found, by_slope = LAW.irradiance(slope)
    np.testing.assert_allclose(found, value(slope), atol=1e-14)
    for axis, step in enumerate(1e-6 * np.eye(2)):
        change = (value(slope + step) - value(slope - step)) / 2e-6
        np.testing.assert_allclose(by_slope[..., axis], change, atol=1e-8)


def test_data_of_markers_are_residuals_with_weights_that_grow_linearly_beyond_a_limit() -> None:
    rng, count = np.random.default_rng(7), 40
    used = np.sort(rng.permutation(count)[:25])
    model, bent = rng.normal(0, 0.01, (count, 3)), rng.normal(0, 0.02, (count, 3))
    lateral, by_height = rng.normal(0, 0.05, (25, 2)), rng.normal(0, 0.4, (count, 2))
    noise = rng.uniform(0.001, 0.01, count)
    residual, weight = np.empty((2, 50))
    marker_data(used, lateral, model, bent, by_height, noise, (0.004, 0.7, 2.0), residual, weight)
    seen = bent[:, :2] - by_height * bent[:, 2:]
    size = np.sqrt((seen**2).mean(axis=1))
    sigma = np.sqrt(0.004**2 + noise**2 + (0.7 * size) ** 2)[used]
    left = (lateral - model[used, :2]).ravel()
    np.testing.assert_allclose(residual, left, atol=1e-15)
    np.testing.assert_allclose(weight, huber(left, np.repeat(sigma, 2), 2.0), rtol=1e-12)
    assert (weight < np.repeat(sigma, 2) ** -2 * 0.99).any()


def test_gathered_rows_are_those_of_fancy_indexing() -> None:
    rng = np.random.default_rng(8)
    nodes, near, markers = (np.sort(rng.permutation(30)[:k]) for k in (6, 11, 9))
    heights = rng.normal(size=(30, 30, 3)).astype(np.float32)
    found = np.empty((11, 18), dtype=np.float32)
    gather_heights(heights, near, nodes, found)
    np.testing.assert_array_equal(found, heights[near][:, nodes].reshape(11, 18))
    motion = rng.normal(size=(30, 2, 30, 3)).astype(np.float32)
    rows = np.empty((18, 18), dtype=np.float32)
    gather_markers(motion, markers, nodes, rows)
    np.testing.assert_array_equal(rows, motion[markers][:, :, nodes].reshape(18, 18))


def test_some_rows_of_a_sparse_product_are_those_of_scipy() -> None:
    rng = np.random.default_rng(9)
    matrix = sparse.random_array((30, 20), density=0.2, rng=rng, format="csr")
    right, rows = rng.normal(size=(20, 3)), np.sort(rng.permutation(30)[:12])
    found = np.full((30, 3), 7.0)
    sparse_rows(matrix.indptr, matrix.indices, matrix.data, rows, right, found)
    np.testing.assert_allclose(found[rows], (matrix @ right)[rows], rtol=1e-14, atol=1e-15)
    assert (np.delete(found, rows, axis=0) == 7.0).all()


@pytest.mark.parametrize("rings", [0, 1, 3])
def test_nodes_are_widened_over_places_without_a_node(rings: int) -> None:
    found, rng = lattice(), np.random.default_rng(rings)
    marked = rng.random(len(found.place)) < 0.03
    wide = found.picture(marked)
    if rings:
        wide = ndimage.binary_dilation(wide, iterations=rings)
    expected = wide[found.place[:, 0], found.place[:, 1]]
    np.testing.assert_array_equal(found.widened(marked, rings), expected)


@pytest.mark.parametrize(("size", "columns"), [(1, 3), (40, 17), (97, 64)])
def test_a_product_without_zeros_is_that_of_numpy(size: int, columns: int) -> None:
    rng = np.random.default_rng(size)
    matrix = rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.2)
    right = rng.normal(size=(size, columns)).astype(np.float32)
    found = np.empty_like(right)
    sparse_product(matrix.astype(np.float32), right, found)
    np.testing.assert_allclose(found, matrix @ right, atol=3e-6 * np.abs(matrix @ right).max())


@pytest.mark.parametrize("share", [0.0, 0.02, 0.4])
def test_bins_that_changed_are_those_of_filters_of_the_picture(share: float) -> None:
    rng = np.random.default_rng(9)
    change = rng.normal(0, 0.004, (2, 37, 52)).astype(np.float32)
    change[:, rng.random((37, 52)) < share] *= 20
    noise = rng.uniform(0.005, 0.02, change.shape).astype(np.float32)
    valid = rng.random((37, 52)) < 0.6
    valid[:9, :20] = False
    found, box = np.empty((37, 52), dtype=bool), np.empty(4, dtype=np.intp)
    bins_above_noise(change, noise, valid, 6.0, 0.2, found, box)
    power = np.square(change / noise).sum(axis=0) * valid
    seen = ndimage.uniform_filter(valid.astype(float), 3)
    mean = ndimage.uniform_filter(power.astype(float), 3) / np.maximum(seen, 0.1)
    expected = (mean > 6.0) & (seen > 0.2)
    assert (found != expected).mean() < 2e-3
    assert found.any() == (share > 0)
    inside = np.zeros_like(found)
    inside[box[0] : box[1], box[2] : box[3]] = True
    assert not (found & ~inside).any()
    if found.any():
        rows, columns = np.nonzero(found)
        assert box.tolist() == [rows.min(), rows.max() + 1, columns.min(), columns.max() + 1]


def equations(rows: Array, values: Array) -> NormalEquations:
    """Of rows (n, 3p) and values (n,) with unit weight."""
    return NormalEquations.of(rows.shape[1]).with_rows(rows, values, np.ones(len(values)))


def test_linear_data_on_fewer_nodes_are_those_without_the_others() -> None:
    """The change of the forces on the others, to zero, is taken from the data."""
    rng = np.random.default_rng(10)
    rows, heights = rng.normal(size=(40, 18)), rng.normal(size=(7, 18))
    residual, start = rng.normal(size=40), rng.normal(size=18)
    moved = np.zeros((6, 3))
    markers = MarkerRows(np.arange(20), rows, residual, np.ones(40))
    nodes, light = np.array([3, 5, 8, 9, 11, 14]), cast(LightSums, SimpleNamespace())
    data = Linearised(
        nodes, start, moved, moved, 1.0, 0.0,
        equations(rows, residual), markers, light, heights,
    )  # fmt: skip
    found = data.on(np.array([5, 9, 14]))
    kept = np.repeat([False, True, False, True, False, True], 3)
    left = residual + rows[:, ~kept] @ start[~kept]
    np.testing.assert_allclose(found.start, start[kept])
    np.testing.assert_allclose(found.markers.residual, left, atol=1e-12)
    force, change = rng.normal(size=9), -start
    change[kept] += force
    higher = found.heights_after(force)
    assert higher is not None
    np.testing.assert_allclose(higher, heights @ change, atol=1e-12)
    expected = equations(rows[:, kept], left)
    np.testing.assert_allclose(found.equations.hessian, expected.hessian, atol=1e-12)
    np.testing.assert_allclose(found.equations.slope, expected.slope, atol=1e-12)
    step = rng.normal(size=9)
    after = found.markers.after(step).residual
    np.testing.assert_allclose(after, left - rows[:, kept] @ step, atol=1e-12)
