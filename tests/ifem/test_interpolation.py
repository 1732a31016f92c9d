import numpy as np
import pytest
import shapely
from scipy.interpolate import LinearNDInterpolator

from ifem_export.errors import InterpolationError
from ifem_export.markers.interpolation import checked_markers, marker_to_node


def lattice(nx=7, ny=5, pitch=(1.3, 1.1)):
    x = (np.arange(nx) - (nx - 1) / 2) * pitch[0]
    y = (np.arange(ny) - (ny - 1) / 2) * pitch[1]
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def inner_nodes(seed=0, n=400):
    return np.random.default_rng(seed).uniform([-3.9, -2.2], [3.9, 2.2], (n, 2))


MARKERS = {
    "lattice": lattice(),
    "lattice with holes": np.delete(lattice(), [8, 17, 18], axis=0),
    "jittered": lattice() + np.random.default_rng(2).normal(0, 0.1, lattice().shape) * (
        np.abs(lattice()) < [3.8, 2.1]
    ),
    "scattered": np.concatenate(
        [[[-4, -3], [4, -3], [4, 3], [-4, 3]], np.random.default_rng(3).uniform(-2.9, 2.9, (60, 2))]
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MARKERS)
def test_linear_fields_are_exact_inside_the_hull(name):
    markers, nodes = MARKERS[name], inner_nodes()
    operator = marker_to_node(markers, nodes)
    field = np.array([[0.3, -0.2], [1.1, 0.4], [-0.7, 2.0]])
    offset = np.array([0.1, 0.2, -0.3])
    found = operator @ (markers @ field.T + offset)
    assert found == pytest.approx(nodes @ field.T + offset, abs=1e-12)


@pytest.mark.parametrize("name", MARKERS)
def test_rows_are_convex_weights_everywhere(name):
    nodes = np.random.default_rng(1).uniform(-9, 9, (500, 2))
    operator = marker_to_node(MARKERS[name], nodes)
    assert operator.shape == (500, len(MARKERS[name]))
    assert np.abs(operator.sum(axis=1) - 1.0).max() < 1e-14
    assert operator.data.min() > 0.0
    assert np.diff(operator.indptr).max() <= 4
    assert operator.has_sorted_indices
    assert operator.indices.dtype == np.int32


def test_a_node_on_a_marker_takes_its_value_alone():
    markers = lattice()
    operator = marker_to_node(markers, markers + 1e-15)
    assert (operator - np.eye(len(markers))).max() == pytest.approx(0.0, abs=1e-12)
    assert operator.nnz == len(markers)


def test_bilinear_fields_are_exact_in_complete_lattice_cells():
    markers, nodes = lattice(), inner_nodes(5)
    operator = marker_to_node(markers, nodes)
    assert operator @ markers.prod(axis=1) == pytest.approx(nodes.prod(axis=1), abs=1e-12)


def test_outside_nodes_take_the_nearest_point_of_the_hull():
    markers = lattice()
    nodes = np.array([[9.0, 0.4], [-9.0, -9.0], [1.0, 7.0]])
    found = marker_to_node(markers, nodes) @ markers
    assert found == pytest.approx(np.array([[3.9, 0.4], [-3.9, -2.2], [1.0, 2.2]]), abs=1e-12)


def reference(markers, nodes, values):
    """Linear in Delaunay triangles, and the value of the nearest point of the hull outside."""
    hull = shapely.MultiPoint(markers).convex_hull
    ways = shapely.shortest_line(hull, shapely.points(nodes))
    at = np.array([way.coords[0] for way in ways])
    # A point on the rim moves inwards by rounding, so that it is in a triangle.
    middle = markers.mean(axis=0)
    return LinearNDInterpolator(markers, values)(middle + (at - middle) * (1 - 1e-12))


def test_scattered_markers_are_interpolated_linearly_and_extended_to_the_nearest_point():
    rng = np.random.default_rng(8)
    markers, nodes = rng.uniform(-3, 3, (40, 2)) * [1.5, 1.0], rng.uniform(-9, 9, (300, 2))
    values = rng.normal(size=(40, 2))
    found = marker_to_node(markers, nodes) @ values
    assert found == pytest.approx(reference(markers, nodes, values), abs=1e-9)


def test_cells_are_bilinear_where_they_are_complete_and_linear_elsewhere():
    sites, nodes = lattice(), inner_nodes(9)
    markers = np.delete(sites, [8, 17, 24], axis=0)
    values = np.random.default_rng(10).normal(size=len(markers))
    found = marker_to_node(markers, nodes) @ values
    expected = reference(markers, nodes, values)
    by_site = {tuple(np.round(m, 9)): v for m, v in zip(markers, values, strict=True)}
    complete = np.zeros(len(nodes), dtype=bool)
    for k, (x, y) in enumerate(nodes):
        left, low = np.floor(x / 1.3 + 1e-12) * 1.3, np.floor(y / 1.1 + 1e-12) * 1.1
        s, t = (x - left) / 1.3, (y - low) / 1.1
        corners = [(left, low), (left + 1.3, low), (left, low + 1.1), (left + 1.3, low + 1.1)]
        at = [by_site.get(tuple(np.round(c, 9))) for c in corners]
        complete[k] = None not in at
        if complete[k]:
            expected[k] = np.dot(at, [(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t])
    assert 100 < complete.sum() < 350
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("count", "is_lattice"), [(9, True), (8, False)])
def test_a_lattice_has_at_most_four_sites_per_marker(count, is_lattice):
    """Six by six lines: four times nine markers, and more than four times eight."""
    markers = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (5, 4)][:count]
    operator = marker_to_node(markers, [[0.5, 0.25]])
    assert operator.nnz == (4 if is_lattice else 3)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_lattice_with_rounding_errors_is_still_one(scale):
    rng = np.random.default_rng(11)
    markers = scale * (lattice() + rng.uniform(-1e-10, 1e-10, lattice().shape))
    nodes = inner_nodes(12)
    found = marker_to_node(markers, scale * nodes) @ lattice().prod(axis=1)
    assert found == pytest.approx(nodes.prod(axis=1), abs=1e-8)


def test_mirrored_lattice_gives_mirrored_weights():
    markers, nodes = lattice(), inner_nodes(6)
    straight = marker_to_node(markers, nodes).toarray()
    mirrored = marker_to_node(markers * [-1, 1], nodes * [-1, 1]).toarray()
    assert mirrored == pytest.approx(straight, abs=1e-12)


@pytest.mark.parametrize(
    ("markers", "value"),
    [
        ([[0, 0], [1, 0]], 2),
        ([[0, 0], [1, 1], [2, 2], [3, 3]], None),
        ([[0, 0], [1, 0], [0, 1], [1, 0]], (1, 3)),
        ([[0, 0], [1, 0], [np.nan, 1]], None),
        ([0, 1, 2], None),
    ],
)
def test_markers_that_determine_no_field_are_refused(markers, value):
    with pytest.raises(InterpolationError) as caught:
        marker_to_node(markers, [[0.0, 0.0]])
    assert (caught.value.field, caught.value.value) == ("markers_mm", value)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_markers_coincide_and_lie_on_a_line_within_a_billionth_of_their_extent(scale):
    corners, shift = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], (0.4, 0.7)
    assert len(checked_markers(scale * np.add(shift, [*corners, (1.0, 4e-9)]))) == 4
    assert len(checked_markers(scale * np.add(shift, [*corners[:2], (0.5, 1e-8)]))) == 3
    for markers in ([*corners, (1.0, 4e-10)], [*corners[:2], (0.5, 4e-10)]):
        with pytest.raises(InterpolationError) as caught:
            checked_markers(scale * np.add(shift, markers))
        assert caught.value.field == "markers_mm"
