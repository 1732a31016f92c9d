import numpy as np
import pytest

from ifem_export.errors import InterpolationError
from ifem_export.markers.interpolation import marker_to_node


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
