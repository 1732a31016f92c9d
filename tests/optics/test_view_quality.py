"""Blur and the homography of the pad, against closed forms and traced light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from camera_cases import finger_camera

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.view_quality import (
    blur_map,
    fit_homography,
    grid_points,
)
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera

X, Y = np.linspace(-14, 14, 57), np.linspace(-12, 12, 49)
AIR = (Layer(2.5, 1.0), Layer(2.0, 1.0))


def pencil(camera: VirtualCamera, point: np.ndarray, focus: float) -> list[float]:
    """Distance along the axis of the point's image by pencils side by side and one above another.

    Two rays from the point through the pupil's rim, each refracted on its own, meet in air where
    their spread, at the focus A |1 - s/Z|, is nought.
    """
    half, distances = 1e-3, []
    for offset in (camera.right, camera.down):
        ends = []
        for side in (-half, half):
            moved = replace(camera, position_mm=camera.position_mm + side * offset)
            ray = moved.air_directions(point)[0]
            ends.append(moved.position_mm + ray * focus / (ray @ camera.forward))
        spread = (ends[1] - ends[0]) @ offset
        distances.append(focus / (1 - spread / (2 * half)))
    return distances


@pytest.mark.parametrize("focus", [20.0, 30.0, 34.5, 50.0])
@pytest.mark.parametrize("layers", [AIR, finger_camera().layers])
def test_blur_is_that_of_the_pencil_of_light_least_in_focus(
    layers: tuple[Layer, ...], focus: float
) -> None:
    camera = finger_camera(layers=layers)
    x, aperture = np.linspace(-10, 10, 9), 1.24
    # The tangential and the sagittal pencil lie in the plane of the fold, through the pinhole.
    middle = camera.position_mm[1]
    blur = blur_map(camera, x, [middle], aperture, focus)
    assert blur.shape == (1, 9)
    truth = [
        max(
            aperture * abs(z - focus) / focus
            for z in pencil(camera, np.array([v, middle, 0.0]), focus)
        )
        for v in x
    ]
    np.testing.assert_allclose(blur[0], truth, rtol=1e-5, atol=1e-7)


def test_blur_seen_near_the_normal_is_the_closed_form() -> None:
    camera = finger_camera()
    foot = camera.position_mm
    near = blur_map(camera, [foot[0]], [foot[1]], 1.24, 30.0)[0, 0]
    assert near == pytest.approx(camera.blur_on_gel_mm([[foot[0], foot[1], 0]], 1.24, 30.0)[0])
    # 33° off it the layers look thinner yet: the closed form is out by more than it may be taken.
    far = blur_map(camera, [10.0], [0.0], 1.24, 30.0)[0, 0]
    assert 0.03 < abs(far / camera.blur_on_gel_mm([[10.0, 0, 0]], 1.24, 30.0)[0] - 1) < 0.15


def test_blur_map_is_laid_out_by_rows_of_y() -> None:
    camera = finger_camera()
    x, y = np.array([-8.0, 0.0, 5.0]), np.array([-3.0, 6.0])
    blur = blur_map(camera, x, y, 1.24, 36.0, -0.2)
    assert blur.shape == (2, 3)
    one = blur_map(camera, [5.0], [-3.0], 1.24, 36.0, -0.2)
    assert blur[0, 2] == one[0, 0]
    assert len(np.unique(blur)) == 6


def test_homography_is_exact_without_refraction_and_about_a_pixel_off_with_it() -> None:
    exact = fit_homography(finger_camera(layers=AIR), X, Y)
    assert exact.max_px < 1e-9
    refracting = fit_homography(finger_camera(), X, Y)
    assert 0.1 < refracting.rms_px < 1
    assert 0.5 < refracting.max_px < 2
    assert refracting.matrix[2, 2] == 1
    # A distorted lens leaves more.
    bent = fit_homography(finger_camera(lens=LensDistortion(k1=-0.1)), X, Y)
    assert bent.rms_px > 2 * refracting.rms_px


def mapped(matrix: np.ndarray, xy: np.ndarray) -> np.ndarray:
    image = xy @ matrix[:, :2].T + matrix[:, 2]
    return image[:, :2] / image[:, 2:]


def test_homography_residual_is_what_an_independent_fit_leaves() -> None:
    from scipy.optimize import least_squares

    camera = finger_camera()
    fitted = fit_homography(camera, X, Y)
    _, _, points = grid_points(X, Y)
    pixels = camera.project(points)

    def miss(h: np.ndarray) -> np.ndarray:
        return (mapped(np.append(h, 1).reshape(3, 3), points[:, :2]) - pixels).ravel()

    start = np.array([0, 18.0, 319, 18, 0, 200, 0, 0])
    truth = least_squares(miss, start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    rms = math.sqrt(np.sum(truth.fun**2) / len(points))
    assert fitted.rms_px == pytest.approx(rms, rel=1e-8)
    np.testing.assert_allclose(fitted.matrix.ravel()[:8], truth.x, rtol=1e-5, atol=1e-7)
    largest = np.linalg.norm(truth.fun.reshape(-1, 2), axis=1).max()
    assert fitted.max_px == pytest.approx(largest, rel=1e-5)


def test_homography_of_another_plane_maps_that_plane() -> None:
    camera = finger_camera(layers=AIR)
    fitted = fit_homography(camera, X, Y, -0.3)
    xy = np.random.default_rng(0).uniform(-9, 9, (30, 2))
    points = np.column_stack([xy, np.full(30, -0.3)])
    np.testing.assert_allclose(mapped(fitted.matrix, xy), camera.project(points), atol=1e-9)


def test_two_by_two_points_fix_a_homography() -> None:
    camera = finger_camera()
    fitted = fit_homography(camera, [-9, 9], [-9, 9])
    assert fitted.max_px < 1e-9


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c: fit_homography(c, [0.0], Y), "two by two"),
        (lambda c: grid_points(np.zeros((2, 2)), Y), "shape"),
        (lambda c: grid_points([0.0, np.nan], Y), "finite"),
        (lambda c: blur_map(c, X, Y, 0.0, 30.0), "positive"),
        (lambda c: blur_map(c, X, Y, 1.2, -30.0), "positive"),
        (lambda c: fit_homography(c, [-500.0, -400.0], Y), "behind"),
    ],
)
def test_bad_requests_are_refused(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(finger_camera())


@pytest.mark.parametrize(
    "wrong",
    [([0.0, np.inf], [1.0], 0.0), ([0.0], [np.nan, 1.0], 0.0), ([0.0], [1.0], np.nan),
     ([], [1.0], 0.0), ([1.0], [], 0.0), ([[0.0, 1.0]], [1.0], 0.0), ([0.0], [[1.0, 2.0]], 0.0)],
)  # fmt: skip
def test_axes_and_height_of_a_grid_are_finite_and_plain(wrong: tuple) -> None:
    with pytest.raises(ValueError, match="grid axes"):
        grid_points(*wrong)


def test_points_of_a_grid_run_along_x_first() -> None:
    x, y, points = grid_points([1.0, 2.0, 4.0], 7.0, -0.3)
    assert (x.tolist(), y.tolist()) == ([1, 2, 4], [7])
    np.testing.assert_array_equal(points, [[1, 7, -0.3], [2, 7, -0.3], [4, 7, -0.3]])
    _, _, points = grid_points([1.0, 2.0], [3.0, 5.0])
    np.testing.assert_array_equal(points[:, :2], [[1, 3], [2, 3], [1, 5], [2, 5]])


def test_blur_off_the_plane_of_the_fold_is_that_of_the_worse_image() -> None:
    """By the heights r/t and dr/dt at which rays side by side and one above another meet."""
    camera = finger_camera()
    x, y, z = [-7.0, 3.0], [-6.0, 8.0], -0.3
    blur = blur_map(camera, x, y, 1.3, 33.0, z)
    for i, at_x in enumerate(x):
        for j, at_y in enumerate(y):
            dx, dy = camera.air_slopes([[at_x, at_y, z]])[0]
            t = math.hypot(dx, dy)
            heights = [-4.5 - camera.position_mm[2], 2.5, 2.0 + z]

            def reach(slope: float, heights: list[float] = heights) -> float:
                sines = [math.sin(math.atan(slope)) / n for n in (1.0, 1.4906, 1.41)]
                return sum(
                    h * s / math.sqrt(1 - s * s) for h, s in zip(heights, sines, strict=True)
                )

            images = (reach(t) / t, (reach(t + 1e-5) - reach(t - 1e-5)) / 2e-5)
            along_axis = np.array([dx, dy, 1.0]) @ camera.forward
            expected = max(1.3 * abs(h * along_axis - 33.0) / 33.0 for h in images)
            assert blur[j, i] == pytest.approx(expected, rel=1e-7)
