"""Arrays for learning from results: shapes, unknown values, and forces carried by a grid."""

from __future__ import annotations

import numpy as np
import output_samples as samples
import pytest

from gelslim_force.forces.wrench import resultant
from gelslim_force.outputs.tactile_features import ForceGrid, TactileFeatures, scalars
from gelslim_force.tracking.tracks import MarkerStatus

FRAMES = [samples.frame(1), samples.frame(2, normal_known=False), samples.unreadable(3, "dark")]


def test_the_grid_keeps_resultant_and_torque_of_random_forces() -> None:
    rng = np.random.default_rng(5)
    for shape in ((2, 2), (3, 7), (12, 12), (40, 31)):
        nodes = np.column_stack([rng.uniform(-9, 9, (300, 2)), np.zeros(300)])
        force = rng.normal(size=(300, 3))
        grid = ForceGrid.of(nodes, shape)
        carried = grid.carried(force)
        assert carried.shape == (*shape, 3)
        points = np.column_stack([grid.points_mm.reshape(-1, 2), np.zeros(shape[0] * shape[1])])
        for found, true in zip(
            resultant(points, carried.reshape(-1, 3)), resultant(nodes, force), strict=True
        ):
            np.testing.assert_allclose(found, true, atol=1e-10)


def test_a_force_at_a_grid_point_stays_there() -> None:
    grid = ForceGrid.of(samples.NODES_MM, (31, 33))
    force = np.zeros((len(samples.NODES_MM), 3))
    force[33 * 4 + 7] = 1.0, -2.0, 3.0
    carried = grid.carried(force)
    np.testing.assert_allclose(carried[4, 7], [1, -2, 3], atol=1e-9)
    assert np.abs(carried).sum() == pytest.approx(6)
    with pytest.raises(ValueError, match="2 rows"):
        ForceGrid.of(samples.NODES_MM, (1, 8))


def test_features_keep_their_shapes_and_tell_what_is_not_known() -> None:
    grid = ForceGrid.of(samples.NODES_MM, (4, 5))
    features = TactileFeatures(grid, len(samples.MARKERS_MM))
    for number, frame in enumerate(FRAMES):
        found = features.of(frame)
        for name, described in features.description.items():
            assert found[name].shape == described["shape"], name
            assert str(found[name].dtype) == described["dtype"]
        assert found["known"].tolist() == [[1, 1], [1, 0], [0, 0]][number]
        assert np.isfinite(found["wrench"]).sum() == [6, 3, 0][number]
    whole = features.of(FRAMES[0])
    np.testing.assert_allclose(whole["wrench"], FRAMES[0].wrench.vector, rtol=1e-6)
    np.testing.assert_allclose(
        whole["wrench_sigma"] ** 2, np.diag(FRAMES[0].wrench.covariance), rtol=1e-5
    )
    np.testing.assert_allclose(
        whole["force_grid_n"].sum(axis=(0, 1)), FRAMES[0].wrench.force_n, rtol=1e-5
    )
    seen = FRAMES[0].tracks.status == MarkerStatus.TRACKED
    assert np.array_equal(np.isfinite(whole["marker_motion_px"]).all(axis=1), seen)


def test_a_policy_gets_no_nan() -> None:
    grid = ForceGrid.of(samples.NODES_MM, (4, 5))
    features = TactileFeatures(grid, len(samples.MARKERS_MM))
    found = scalars(features.of(FRAMES[1]), ("wrench", "known"))
    assert found["fz_n"] == 0.0
    assert found["normal_known"] == 0.0
    assert found["tangential_known"] == 1.0
    assert found["fx_n"] == pytest.approx(FRAMES[1].wrench.force_n[0], rel=1e-6)
