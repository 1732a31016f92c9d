import numpy as np
import pytest

from ifem_export.errors import InterpolationError
from ifem_export.markers.interpolation_matrix import (
    local_roughness,
    sparse_interpolation,
    thin_plate_interpolation,
)

MAKERS = {"sparse": sparse_interpolation, "thin plate": thin_plate_interpolation}


def grid(count, pitch, ratio=1.0):
    """A lattice of `count` by `count` points, whose pitch in y is `ratio` times that in x."""
    at = (np.arange(count) - (count - 1) / 2) * pitch
    return np.stack(np.meshgrid(at, ratio * at), axis=-1).reshape(-1, 2)


MARKERS, NODES = grid(21, 1.2), grid(41, 0.68, 0.9)
INSIDE = (np.abs(NODES) <= 12.0).all(axis=1)


def some_lost(share=0.05, seed=0):
    return np.random.default_rng(seed).random(len(MARKERS)) < share


def plane(points):
    return points @ np.array([[0.3, -0.2, 0.1], [1.1, 0.4, 2.0]]) + [0.1, 0.2, -0.3]


def bump(points, place, width):
    square = ((points - place) ** 2).sum(axis=1)
    return np.exp(-square / (2 * width**2))[:, None]


@pytest.fixture(scope="module", params=MAKERS)
def interpolation(request):
    return MAKERS[request.param](MARKERS, NODES)


@pytest.fixture(scope="module")
def spline():
    return thin_plate_interpolation(MARKERS, NODES)


@pytest.mark.parametrize("lost", [np.zeros(441, bool), some_lost(), some_lost(0.3, 2)])
def test_affine_fields_are_exact_inside_whoever_is_missing(interpolation, lost):
    field = np.where(lost[:, None], np.nan, plane(MARKERS))
    found = interpolation.with_missing(lost)(field)
    assert found[INSIDE] == pytest.approx(plane(NODES)[INSIDE], abs=1e-9)
    rows = interpolation.with_missing(lost).dense().sum(axis=1)
    assert np.abs(rows - 1.0).max() < 1e-10


def test_the_spline_is_affine_outside_too(spline):
    assert spline(plane(MARKERS)) == pytest.approx(plane(NODES), abs=1e-11)
    assert (~INSIDE).any()


def test_the_spline_passes_through_every_marker(spline):
    at_markers = thin_plate_interpolation(MARKERS, MARKERS)
    assert at_markers.to_nodes == pytest.approx(np.eye(441), abs=1e-8)


def test_the_spline_is_scipys(spline):
    from scipy.interpolate import RBFInterpolator

    field = np.random.default_rng(3).normal(size=(441, 3))
    theirs = RBFInterpolator(MARKERS, field, kernel="thin_plate_spline")(NODES)
    assert spline(field) == pytest.approx(theirs, abs=1e-8)


def test_bending_energy_is_the_integral_of_the_curvatures():
    markers = np.array([[0.0, 0.0], [2.0, 0.3], [-1.0, 1.7], [0.4, -2.1], [-2.2, -1.0]])
    values = np.array([1.0, -0.3, 0.2, 0.4, -0.6])
    pitch = 0.05
    points = grid(601, pitch)
    found = thin_plate_interpolation(markers, points)
    u = found(values[:, None]).reshape(601, 601)
    du = np.gradient(u, pitch)
    second = [np.gradient(d, pitch) for d in du]
    bent = (second[0][0] ** 2 + 2 * second[0][1] ** 2 + second[1][1] ** 2).sum() * pitch**2
    assert bent == pytest.approx(8 * np.pi * values @ found.roughness @ values, rel=0.03)


@pytest.mark.slow
def test_lost_markers_leave_the_spline_of_the_others():
    lost = some_lost(0.1, 5)
    lost[[0, 20, 21, 22, 200, 201, 202, 221, 222, 223]] = True
    whole = thin_plate_interpolation(MARKERS, NODES).with_missing(lost)
    kept = thin_plate_interpolation(MARKERS[~lost], NODES)
    assert whole.dense()[:, ~lost] == pytest.approx(kept.to_nodes, abs=1e-8)
    assert not whole.dense()[:, lost].any()


def test_lost_markers_of_the_sparse_one_read_what_is_least_rough():
    sparse = sparse_interpolation(MARKERS, MARKERS)
    lost = some_lost(0.1, 6)
    field = np.random.default_rng(7).normal(size=(441, 1))
    found = sparse.with_missing(lost)(field)
    assert found[~lost] == pytest.approx(field[~lost], abs=1e-12)
    form = local_roughness(MARKERS).toarray()
    slope = form @ found
    assert np.abs(slope[lost]).max() < 1e-9
    assert np.abs(slope[~lost]).max() > 0.1


def test_roughness_is_zero_on_planes_only():
    form = local_roughness(MARKERS).toarray()
    assert np.abs(form - form.T).max() < 1e-15
    values = np.linalg.eigvalsh(form)
    assert values[2] < 1e-12 < 1e-6 < values[3]
    assert np.abs(form @ plane(MARKERS)).max() < 1e-12


def test_roughness_of_a_lattice_keeps_its_mirror_images():
    form = local_roughness(MARKERS).toarray()
    mirrored = np.arange(441).reshape(21, 21)[:, ::-1].reshape(-1)
    assert form[np.ix_(mirrored, mirrored)] == pytest.approx(form, abs=1e-12)


@pytest.mark.parametrize("width", [1.5, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("place", [(0.0, 0.0), (3.3, -2.1), (9.5, 5.0)])
@pytest.mark.parametrize("share", [0.0, 0.05])
def test_the_spline_errs_less_on_smooth_bumps(spline, width, place, share):
    lost = some_lost(share, 8)
    sparse = sparse_interpolation(MARKERS, NODES).with_missing(lost)
    at_markers, expected = bump(MARKERS, place, width), bump(NODES, place, width)
    linear = np.linalg.norm(sparse(at_markers) - expected)
    bent = np.linalg.norm(spline.with_missing(lost)(at_markers) - expected)
    assert bent < (0.3 if place == (0.0, 0.0) else 0.7) * linear


def test_sparse_rows_never_amplify_noise_and_the_spline_does_at_the_rim():
    assert sparse_interpolation(MARKERS, NODES).noise_gain().max() <= 1.0 + 1e-12
    gain = thin_plate_interpolation(MARKERS, NODES).noise_gain()
    assert gain[INSIDE].max() < 1.2


def test_masks_replace_one_another(interpolation):
    field = np.random.default_rng(9).normal(size=(441, 3))
    first, second = some_lost(0.05, 1), some_lost(0.05, 2)
    after = interpolation.with_missing(first).with_missing(second)
    assert np.array_equal(after.lost, second)
    assert np.array_equal(after(field), interpolation.with_missing(second)(field))
    none = after.with_missing(np.zeros(441, bool))
    assert not none.lost.any()
    assert np.array_equal(none(field), interpolation(field))


def test_what_determines_no_field_is_refused(interpolation):
    field = plane(MARKERS)
    field[17, 1] = np.nan
    for values, name, value in ((field, "marker", 17), (field[:5], "values", (5, 3))):
        with pytest.raises(InterpolationError) as caught:
            interpolation(values)
        assert (caught.value.field, caught.value.value) == (name, value)
    one_row = MARKERS[:, 1] != MARKERS[0, 1]
    two_left = np.arange(441) > 1
    for mask, value in ((np.zeros(441), (441,)), (one_row, 21), (two_left, 2)):
        with pytest.raises(InterpolationError) as caught:
            interpolation.with_missing(mask)
        assert (caught.value.field, caught.value.value) == ("mask", value)


def test_markers_out_of_reach_of_those_left_are_refused():
    apart = np.concatenate([grid(4, 1.0), grid(4, 1.0) + 100.0])
    sparse = sparse_interpolation(apart, apart)
    with pytest.raises(InterpolationError) as caught:
        sparse.with_missing(np.arange(32) >= 16)
    assert (caught.value.field, caught.value.value) == ("mask", 16)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_three_markers_are_enough(make):
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    found = make(corners, [[0.5, 0.25]])(plane(corners))
    assert found == pytest.approx(plane(np.array([[0.5, 0.25]])), abs=1e-12)


def test_bad_splines_are_refused():
    for markers in (grid(64, 1.0), MARKERS[:21]):
        with pytest.raises(InterpolationError) as caught:
            thin_plate_interpolation(markers, NODES)
        assert caught.value.field == "markers_mm"


@pytest.mark.parametrize("lost", [np.zeros(441, bool), some_lost(0.1, 3)])
def test_the_transpose_is_that_of_the_matrix(interpolation, lost):
    kept = interpolation.with_missing(lost)
    values = np.random.default_rng(4).normal(size=(len(NODES), 2))
    assert kept.transposed(values) == pytest.approx(kept.dense().T @ values, abs=1e-9)
    assert not kept.transposed(values)[lost].any()
