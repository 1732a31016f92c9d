"""Markers' motion in the gel's plane: exact against the camera, the paper's models worse."""

from __future__ import annotations

import numpy as np
import pytest
from camera_rig import off_centre_view
from synthetic import grid_of_dots

from gelslim_force.motion.marker_motion import COMPENSATIONS, MarkerView
from gelslim_optics.camera.projection_error import projection_error_mm


@pytest.fixture(scope="module")
def pressed():
    camera, grid = off_centre_view(), grid_of_dots()
    rest = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    rng = np.random.default_rng(3)
    motion = np.column_stack([rng.normal(0, 0.2, (len(grid), 2)), -rng.uniform(0, 0.8, len(grid))])
    view = MarkerView(camera, camera.project(rest))
    return view, camera.project(rest + motion), motion


def test_exact_compensation_returns_the_true_motion(pressed) -> None:
    view, now, motion = pressed
    found = view.lateral_motion(now, motion[:, 2], "exact")
    assert np.abs(found - motion[:, :2]).max() < 1e-11


def test_the_papers_models_err_in_their_order(pressed) -> None:
    view, now, motion = pressed
    off = {
        model: np.abs(view.lateral_motion(now, motion[:, 2], model) - motion[:, :2]).max()
        for model in COMPENSATIONS
    }
    assert off["exact"] < 1e-11 < off["arctan"] < off["printed"] < off["none"]
    assert off["none"] > 0.3
    assert off["arctan"] < 0.05


def test_zero_motion_is_zero_under_every_model(pressed) -> None:
    view, _, _ = pressed
    for model in COMPENSATIONS:
        assert np.abs(view.lateral_motion(view.reference_px, 0.0, model)).max() < 1e-12


def test_marker_below_the_pinhole_has_no_apparent_motion() -> None:
    camera = off_centre_view()
    foot = np.array([[*camera.position_mm[:2], 0.0], [2.0, 1.0, 0.0]])
    view = MarkerView(camera, camera.project(foot))
    pressed_px = camera.project(foot - [0.0, 0.0, 0.4])
    for model in COMPENSATIONS[1:]:
        moved = view.lateral_motion(pressed_px, -0.4, model)
        assert np.isfinite(moved).all()
        assert np.abs(moved[0]).max() < 1e-9


def test_unknown_places_stay_unknown(pressed) -> None:
    view, now, motion = pressed
    holes = now.copy()
    holes[4] = np.nan
    normal = motion[:, 2].copy()
    normal[9] = np.nan
    found = view.lateral_motion(holes, normal)
    assert np.flatnonzero(np.isnan(found).any(axis=1)).tolist() == [4, 9]
    assert np.isnan(view.lateral_motion(np.full_like(now, np.nan))).all()


def test_scale_at_rest_is_the_inverse_of_the_cameras(pressed) -> None:
    view, _, _ = pressed
    step = 1e-3
    moved = view.lateral_motion(view.reference_px + np.array([step, 0.0])) / step
    assert np.abs(moved - view.mm_per_px[:, :, 0]).max() < 1e-4 * np.abs(moved).max()


def test_bad_arguments_are_named(pressed) -> None:
    view, now, _ = pressed
    with pytest.raises(ValueError, match="positions"):
        view.lateral_motion(now[:5])
    with pytest.raises(ValueError, match="linear"):
        view.lateral_motion(now, 0.0, "linear")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="finite"):
        MarkerView(view.camera, np.full((3, 2), np.nan))


def test_motion_is_in_the_plane_unless_a_depth_is_given(pressed) -> None:
    view, now, _ = pressed
    there = view.camera.backproject(now, 0.0)[:, :2]
    np.testing.assert_allclose(view.lateral_motion(now), there - view.rest_mm[:, :2], atol=1e-12)
    for model in COMPENSATIONS:
        np.testing.assert_array_equal(
            view.lateral_motion(now, compensation=model), view.lateral_motion(now, 0.0, model)
        )


def test_the_papers_models_subtract_their_error_from_the_motion_in_the_plane(pressed) -> None:
    view, now, motion = pressed
    for model in ("printed", "arctan"):
        error = projection_error_mm(view.camera, view.rest_mm, motion[:, 2], model)
        expected = view.lateral_motion(now) - error
        np.testing.assert_allclose(view.lateral_motion(now, motion[:, 2], model), expected)
    np.testing.assert_array_equal(
        view.lateral_motion(now, motion[:, 2], "none"), view.lateral_motion(now)
    )


def test_a_crowned_pad_is_seen_at_its_height() -> None:
    camera = off_centre_view()
    rest = np.array([[1.0, 2.0, 0.3], [-3.0, 0.5, -0.2]])
    view = MarkerView(camera, camera.project(rest), rest[:, 2])
    np.testing.assert_allclose(view.rest_mm, rest, atol=1e-11)
    moved = rest + np.array([[0.1, -0.2, -0.4], [0.0, 0.3, 0.1]])
    found = view.lateral_motion(camera.project(moved), [-0.4, 0.1])
    np.testing.assert_allclose(found, [[0.1, -0.2], [0.0, 0.3]], atol=1e-11)
    scale = np.linalg.inv(camera.jacobian(rest))
    np.testing.assert_allclose(view.mm_per_px, scale)
    for bad in (np.zeros(4), np.zeros((4, 3)), np.array([[np.inf, 0.0]])):
        with pytest.raises(ValueError, match="reference positions"):
            MarkerView(camera, bad)
