"""Projection error of markers pressed in: the exact one by ray, and how far the models are off."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_cases import finger_camera, random_pose

from gelslim_optics.camera.projection_error import (
    MODELS,
    effective_height_mm,
    error_map,
    projection_error_mm,
)
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera

X, Y = np.linspace(-14, 14, 57), np.linspace(-12, 12, 49)
PRESS = -0.5


def on_pad(count: int, seed: int = 0) -> np.ndarray:
    xy = np.random.default_rng(seed).uniform(-10, 10, (count, 2))
    return np.column_stack([xy, np.zeros(count)])


@pytest.mark.parametrize("seed", range(4))
def test_exact_is_the_difference_of_two_refracted_projections(seed: int) -> None:
    camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(seed)))
    points, d = on_pad(60, seed), np.random.default_rng(seed).uniform(-0.4, 0.2, 60)
    moved = points + d[:, None] * [0, 0, 1]
    error = projection_error_mm(camera, points, d, "exact")
    shifted = points + np.column_stack([error, np.zeros(60)])
    np.testing.assert_allclose(camera.project(shifted), camera.project(moved), atol=1e-9)


def test_a_pressed_marker_seems_to_move_away_from_the_cameras_foot() -> None:
    camera = finger_camera()
    points = on_pad(50)
    away = points[:, :2] - camera.position_mm[:2]
    for model in MODELS:
        pressed = projection_error_mm(camera, points, PRESS, model)
        assert np.all((pressed * away).sum(axis=1) > 0)
        np.testing.assert_allclose(pressed[:, 0] * away[:, 1], pressed[:, 1] * away[:, 0])
        if model != "exact":
            pulled = projection_error_mm(camera, points, -PRESS, model)
            np.testing.assert_allclose(pulled, -pressed)
        np.testing.assert_allclose(projection_error_mm(camera, points, 0.0, model), 0, atol=1e-14)


def test_by_hand_in_the_three_approximate_models() -> None:
    camera = finger_camera()
    height = -camera.position_mm[2]
    seen = (height - 4.5) + 2.5 / 1.4906 + 2.0 / 1.41
    assert effective_height_mm(camera) == pytest.approx(seen, rel=1e-14)
    reach = 12.0
    point = [[*(camera.position_mm[:2] + np.array([9.6, 7.2])), 0.0]]
    for model, alpha in (
        ("printed", reach / height),
        ("arctan", math.atan(reach / height)),
        ("effective_height", math.atan(reach / seen)),
    ):
        size = 0.5 * math.tan(math.asin(math.sin(alpha) / 1.41))
        expected = [[0.8 * size, 0.6 * size]]
        np.testing.assert_allclose(projection_error_mm(camera, point, -0.5, model), expected)


@pytest.mark.parametrize("layers", [(Layer(2.5, 1.0), Layer(2.0, 1.0)), ()])
def test_without_layers_that_refract_the_straight_ray_is_exact(layers: tuple[Layer, ...]) -> None:
    camera = finger_camera(layers=layers)
    points = on_pad(40)
    exact = projection_error_mm(camera, points, PRESS)
    # The models take the angle before the press: afterwards it is wider by H / (H + d).
    wider = camera.position_mm[2] / (camera.position_mm[2] - PRESS)
    for model in ("arctan", "effective_height"):
        error = projection_error_mm(camera, points, PRESS, model)
        np.testing.assert_allclose(error * wider, exact, rtol=1e-12, atol=1e-14)
    assert np.abs(projection_error_mm(camera, points, PRESS, "printed") - exact).max() > 0.005


def test_straight_ray_is_low_by_3_to_8_percent_and_effective_height_by_1_to_4() -> None:
    seen = error_map(finger_camera(), X, Y, PRESS)
    assert -0.08 < np.nanmin(seen.relative("arctan")) < np.nanmax(seen.relative("arctan")) < -0.03
    effective = seen.relative("effective_height")
    assert -0.04 < np.nanmin(effective) < np.nanmax(effective) < -0.008
    assert np.all(effective > seen.relative("arctan"))


def test_the_printed_form_crosses_the_truth_and_runs_off_at_wide_angles() -> None:
    # A pad far longer than the camera is deep: r/H up to 1.5.
    camera = finger_camera()
    foot = camera.position_mm[0]
    height = -camera.position_mm[2]
    ratio = np.linspace(0.05, 1.5, 30)
    printed = error_map(camera, foot + ratio * height, [0.0], PRESS).relative("printed")[0]
    assert np.all(np.abs(printed[ratio < 0.5]) < 0.06)
    assert printed[0] < 0
    assert np.all(np.diff(printed[ratio < 1.3]) > 0)
    assert 0.28 < printed.max() < 0.36


def test_error_map_holds_every_model_by_rows_of_y() -> None:
    camera = finger_camera()
    x, y = np.array([-5.0, 0.0, 5.0]), np.array([-2.0, 2.0])
    seen = error_map(camera, x, y, -0.3, z_mm=-0.1)
    assert set(seen.delta_mm) == set(MODELS)
    for model in MODELS:
        one = projection_error_mm(camera, [[5.0, -2.0, -0.1]], -0.3, model)
        np.testing.assert_array_equal(seen.delta_mm[model][0, 2], one[0])
        off = seen.delta_mm[model][0, 2] - seen.delta_mm["exact"][0, 2]
        assert seen.deviation_mm(model)[0, 2] == pytest.approx(np.hypot(*off), abs=1e-15)
    assert np.all(seen.deviation_mm("exact") == 0)


def test_under_the_foot_there_is_no_error_and_no_ratio() -> None:
    camera = finger_camera()
    foot = [[*camera.position_mm[:2], 0.0]]
    for model in MODELS:
        np.testing.assert_array_equal(projection_error_mm(camera, foot, PRESS, model), [[0, 0]])
    seen = error_map(camera, *camera.position_mm[:2, None], PRESS)
    assert np.isnan(seen.relative("arctan")).all()


def test_missing_markers_stay_missing() -> None:
    for model in MODELS:
        error = projection_error_mm(finger_camera(), [[1.0, 2, 0], [np.nan, 0, 0]], PRESS, model)
        assert np.isfinite(error[0]).all()
        assert np.isnan(error[1]).all()


@pytest.mark.parametrize(
    ("points", "d", "model", "message"),
    [
        ([[0.0, 0, 0]], -0.1, "tuned", "printed, arctan, effective_height, exact"),
        ([[0.0, 0, 0]], [-0.1, -0.2], "exact", "shape"),
        ([[0.0, 0]], -0.1, "exact", "shape"),
        ([[0.0, 0, -60]], -0.1, "printed", "above the virtual pinhole"),
        ([[0.0, 0, -60]], -0.1, "effective_height", "above"),
        ([[0.0, 0, 0]], -60.0, "exact", "above"),
    ],
)
def test_bad_requests_are_refused(points: list, d: object, model: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        projection_error_mm(finger_camera(), points, d, model)


def test_effective_height_needs_a_point_above_the_pinhole() -> None:
    with pytest.raises(ValueError, match="above"):
        effective_height_mm(finger_camera(), -60.0)
