"""The virtual camera against light traced from the real one: pixel, mirror, each plane, gel."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from camera_cases import HEIGHT, WIDTH, finger_camera, random_pose, rotation_about_y, traced

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.rays import newton_rays
from gelslim_optics.camera.refraction_kernel import solve_rays
from gelslim_optics.camera.virtual_camera import (
    Layer,
    VirtualCamera,
    reflect_direction,
    reflect_point,
)


@pytest.mark.parametrize("seed", range(12))
def test_projection_inverts_light_traced_from_the_real_camera(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = random_pose(rng)
    camera = VirtualCamera.from_fold(**pose)
    pixels = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (40, 2))
    gel = pose["layers"][1].thickness_mm
    depths = np.where(rng.random(40) < 0.5, gel, rng.uniform(0.05, gel, 40))
    points = np.array([traced(pose, u, v, h) for (u, v), h in zip(pixels, depths, strict=True)])
    assert np.abs(camera.project(points) - pixels).max() < 1e-8


def test_without_refraction_it_is_the_mirrored_pinhole() -> None:
    rng = np.random.default_rng(20)
    pose = random_pose(rng, indices=(1.0, 1.0))
    camera = VirtualCamera.from_fold(**pose)
    points = np.column_stack([rng.uniform(-10, 10, (50, 2)), np.zeros(50)])
    # Mirror the points instead of the camera and take the real camera's plain projection.
    angle = pose["mirror_angle_rad"]
    n = np.array([-math.sin(angle), 0, math.cos(angle)])
    q = pose["mirror_point_mm"]
    imaged = points - 2 * ((points - q) @ n)[:, None] * n
    local = (imaged - pose["camera_mm"]) @ rotation_about_y(pose["pitch_rad"])
    expected = pose["focal_px"] * local[:, 1:] / local[:, :1]
    expected += [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]
    np.testing.assert_allclose(camera.project(points), expected, rtol=0, atol=1e-9)


def test_the_fold_flips_handedness_and_keeps_the_axes_orthonormal() -> None:
    for seed in range(5):
        camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(seed)))
        axes = np.array([camera.right, camera.down, camera.forward])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(axes) == pytest.approx(-1, abs=1e-12)


def test_tilt_of_the_virtual_axis_follows_mirror_and_pitch() -> None:
    pose = random_pose(np.random.default_rng(3))
    forward = VirtualCamera.from_fold(**pose).forward
    tilt = math.pi / 2 - 2 * pose["mirror_angle_rad"] - pose["pitch_rad"]
    np.testing.assert_allclose(forward, [math.sin(tilt), 0, math.cos(tilt)], atol=1e-14)


def test_reflection_twice_is_no_reflection() -> None:
    rng = np.random.default_rng(4)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    p, q, a = rng.normal(size=(3, 3))
    once = reflect_point(p, q, normal)
    assert (once - q) @ normal == pytest.approx(-(p - q) @ normal)
    np.testing.assert_allclose(np.cross(once - p, normal), 0, atol=1e-14)
    np.testing.assert_allclose(reflect_point(once, q, normal), p, atol=1e-14)
    turned = reflect_direction(a, normal)
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(a))
    np.testing.assert_allclose(reflect_direction(turned, normal), a, atol=1e-14)


def test_jacobian_agrees_with_differences_of_another_order_and_step() -> None:
    rng = np.random.default_rng(5)
    camera = VirtualCamera.from_fold(**random_pose(rng))
    points = np.column_stack([rng.uniform(-8, 8, (30, 2)), np.zeros(30)])
    jacobian = camera.jacobian(points)
    assert jacobian.shape == (30, 2, 2)
    h = 0.02
    for axis in range(2):
        e = np.eye(3)[axis] * h
        p = camera.project
        fourth = (p(points - 2 * e) - 8 * p(points - e) + 8 * p(points + e) - p(points + 2 * e)) / (
            12 * h
        )
        np.testing.assert_allclose(jacobian[:, :, axis], fourth, rtol=1e-6, atol=1e-6)


def test_point_under_the_camera_is_seen_along_the_normal() -> None:
    camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(6)))
    below = np.array([[*camera.position_mm[:2], 0.0]])
    np.testing.assert_allclose(camera.air_directions(below), [[0, 0, 1]], atol=1e-15)


def test_apparent_distance_is_exact_for_rays_near_the_normal() -> None:
    pose = random_pose(np.random.default_rng(7))
    camera = VirtualCamera.from_fold(**pose)
    axes = {"right": np.array([0.0, 1, 0]), "down": np.array([-1.0, 0, 0])}
    camera = replace(camera, **axes, forward=np.array([0.0, 0, 1]))
    window, gel = pose["layers"]
    seen = camera.air_height_mm + window.thickness_mm / window.index + gel.thickness_mm / gel.index
    under = np.array([*camera.position_mm[:2], 0.0])
    assert camera.apparent_distances_mm(under) == pytest.approx(np.array([[seen, seen]]), rel=1e-12)
    # The transverse scale f/Z there is that of an object at the apparent distance.
    scale = np.linalg.norm(camera.jacobian(under[None])[0, :, 0])
    assert scale == pytest.approx(camera.focal_px / seen, rel=1e-7)
    # A point inside the gel looks nearer by its depth over the index.
    deeper = under - [0, 0, 0.3 * gel.thickness_mm]
    assert camera.apparent_distances_mm(deeper)[0, 0] == pytest.approx(
        seen - 0.3 * gel.thickness_mm / gel.index, rel=1e-12
    )


@pytest.mark.parametrize("seed", range(5))
def test_images_are_where_neighbouring_rays_meet(seed: int) -> None:
    """Rays from a point of the gel, traced into the air by Snell's law and carried back."""
    camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(seed)))
    point = np.array([6.0, -3.0, -0.4])
    seen = camera.apparent_distances_mm(point)[0]
    direction = -camera.air_directions(point[None])[0]
    radial = direction[:2] / np.linalg.norm(direction[:2])
    sine, turn = np.linalg.norm(direction[:2]), np.arctan2(radial[1], radial[0])
    heights = camera.stack.crossed_mm(point[None, 2])

    def ray(sine: float, turn: float) -> tuple[np.ndarray, np.ndarray]:
        """A point of the ray in air, at the camera's height, and its direction."""
        reach = sum(
            float(h[0]) * sine / n / np.sqrt(1 - (sine / n) ** 2)
            for h, n in zip(heights, camera.stack.indices, strict=True)
        )
        flat = np.array([np.cos(turn), np.sin(turn)])
        end = np.append(point[:2] + reach * flat, camera.position_mm[2])
        return end, np.append(sine * flat, -np.sqrt(1 - sine**2))

    start, along = ray(sine, turn)
    assert start == pytest.approx(camera.position_mm, abs=1e-9)
    step = 1e-5
    for expected, other in zip(seen, (ray(sine, turn + step), ray(sine + step, turn)), strict=True):
        # Least squares over both lines' parameters; neighbouring rays miss each other by little.
        pair = np.column_stack([along, -other[1]])
        back = np.linalg.lstsq(pair, other[0] - start, rcond=None)[0][0]
        image = start + back * along
        assert (image - camera.position_mm) @ camera.forward == pytest.approx(expected, rel=2e-3)


def test_blur_vanishes_at_the_focus_and_grows_to_both_sides() -> None:
    camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(8)))
    points = np.column_stack([np.linspace(-8, 8, 9), np.zeros(9), np.zeros(9)])
    distance = camera.apparent_distances_mm(points)
    focus = distance[4].mean()
    blur = camera.blur_on_gel_mm(points, 1.24, focus)
    # Similar triangles: the cones from the aperture to their apexes in focus, carried on.
    ellipse = 1.24 * np.abs(distance / focus - 1)
    np.testing.assert_allclose(blur, np.hypot(*ellipse.T) / np.sqrt(2), atol=1e-12)
    assert blur[4] < 0.1 * min(blur[0], blur[8])
    assert blur[0] > blur[2] > 0
    assert blur[8] > blur[6] > 0


LENS = LensDistortion(k1=-0.12, k2=0.03, p1=4e-4, p2=-3e-4)
WIDE = LensDistortion(k1=-0.04, k2=0.02, k3=0.01, k4=-0.003, model="kannala_brandt")


@pytest.mark.parametrize("seed", range(4))
def test_a_distorted_lens_moves_the_traced_pixels_by_its_polynomial(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    pose = random_pose(rng)
    camera = VirtualCamera.from_fold(**pose, lens=LENS)
    ideal = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (30, 2))
    gel = pose["layers"][1].thickness_mm
    points = np.array([traced(pose, u, v, gel) for u, v in ideal])
    middle = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    expected = LENS.distort((ideal - middle) / pose["focal_px"]) * pose["focal_px"] + middle
    assert np.abs(camera.project(points) - expected).max() < 1e-8
    assert np.abs(expected - ideal).max() > 1


@pytest.mark.parametrize("lens", [None, LENS, WIDE])
def test_jacobian_is_the_derivative_in_all_three_directions(lens: LensDistortion | None) -> None:
    for seed in range(4):
        rng = np.random.default_rng(30 + seed)
        camera = VirtualCamera.from_fold(**random_pose(rng), lens=lens)
        points = np.column_stack([rng.uniform(-6, 6, (20, 2)), rng.uniform(-0.3, 0.3, 20)])
        # The foot of the pinhole, where the ray's azimuth has no meaning.
        points[0, :2] = camera.position_mm[:2]
        points[1, :2] = camera.position_mm[:2] + np.array([1e-11, -1e-12])
        jacobian = camera.jacobian_3d(points)
        np.testing.assert_array_equal(camera.jacobian(points), jacobian[:, :, :2])
        h = 0.01
        for axis in range(3):
            e = np.eye(3)[axis] * h
            p = camera.project
            fourth = (
                p(points - 2 * e) - 8 * p(points - e) + 8 * p(points + e) - p(points + 2 * e)
            ) / (12 * h)
            np.testing.assert_allclose(jacobian[:, :, axis], fourth, rtol=1e-8, atol=1e-7)


def test_one_mirror_turns_the_picture_over() -> None:
    camera = finger_camera()
    points = np.column_stack([np.random.default_rng(9).uniform(-9, 9, (40, 2)), np.zeros(40)])
    # Seen from below by an ordinary camera, x to y turns as right to down does... in a mirror not.
    straight = replace(camera, right=-camera.right)
    assert np.linalg.det([straight.right, straight.down, straight.forward]) == pytest.approx(1)
    assert np.all(np.linalg.det(straight.jacobian(points)) > 0)
    assert np.all(np.linalg.det(camera.jacobian(points)) < 0)


def test_points_within_window_or_air_cross_only_what_lies_below_them() -> None:
    pose = random_pose(np.random.default_rng(10))
    camera = VirtualCamera.from_fold(**pose)
    window, _ = pose["layers"]
    bottom = pose["window_bottom_z_mm"]
    rng = np.random.default_rng(11)
    xy = rng.uniform(-5, 5, (20, 2))
    for z, layers in (
        (bottom - 1.0, ()),
        (bottom + 0.4 * window.thickness_mm, (Layer(0.4 * window.thickness_mm, window.index),)),
    ):
        points = np.column_stack([xy, np.full(20, z)])
        np.testing.assert_allclose(
            camera.project(points), replace(camera, layers=layers).project(points), atol=1e-10
        )


def test_compiled_and_plain_rays_agree() -> None:
    rng = np.random.default_rng(12)
    for seed in range(3):
        camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(seed)))
        bottom = camera.window_bottom_z_mm
        points = np.column_stack(
            [rng.uniform(-10, 10, (30_000, 2)), rng.uniform(bottom - 1, 1, 30_000)]
        )
        points[0] = [*camera.position_mm[:2], 0]
        points[1] = np.nan
        points[2, 0] = np.inf
        stack = camera.stack
        compiled = solve_rays(
            points, camera.position_mm, camera.axes, np.array(stack.tops_mm),
            np.array(stack.indices),
        )  # fmt: skip
        np.testing.assert_allclose(
            compiled,
            newton_rays(camera.position_mm, stack, camera.axes, points),
            rtol=1e-15,
            atol=1e-15,
        )
        # `project` takes the compiled way for all, the plain one for a few.
        seen = points[compiled[:, 2] > 0]
        assert len(seen) > 25_000
        np.testing.assert_allclose(
            camera.project(seen)[:500], camera.project(seen[:500]), rtol=1e-13, atol=1e-10
        )


def test_missing_points_have_no_image_and_disturb_no_other() -> None:
    camera = finger_camera()
    pixels = camera.project([[1.0, 2.0, 0.0], [np.nan, 0.0, 0.0]])
    np.testing.assert_array_equal(pixels[:1], camera.project([[1.0, 2.0, 0.0]]))
    assert np.isnan(pixels[1]).all()


def test_what_cannot_be_seen_is_refused() -> None:
    camera = finger_camera()
    with pytest.raises(ValueError, match="behind the camera"):
        camera.project([[-400.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="above"):
        camera.project([[0.0, 0.0, -50.0]])
    with pytest.raises(ValueError, match="shape"):
        camera.project([[0.0, 0.0]])
    with pytest.raises(ValueError, match="monotone"):
        replace(camera, lens=LensDistortion(k1=-6.0)).project([[9.0, 9.0, 0.0]])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position_mm": np.array([0.0, 0.0, -4.0])}, "below the window"),
        ({"right": np.array([0.0, 2.0, 0.0])}, "unit vectors"),
        ({"forward": np.array([0.0, 1.0])}, "three finite"),
        ({"focal_px": 0.0}, "focal_px"),
        ({"image_width_px": -1}, "image_width_px"),
        ({"window_bottom_z_mm": math.nan}, "below the window"),
    ],
)
def test_values_that_make_no_camera_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(finger_camera(), **changes)


def test_layers_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="thickness_mm"):
        Layer(-1.0, 1.4)
    with pytest.raises(ValueError, match="index"):
        Layer(1.0, 0.9)


def test_a_few_points_need_no_compiler() -> None:
    code = (
        "import sys; from gelslim_optics.camera.virtual_camera import VirtualCamera, Layer;"
        "c = VirtualCamera.from_fold(camera_mm=(-26, 0, -11), pitch_rad=.14, mirror_angle_rad=.56,"
        "mirror_point_mm=(-2, 0, -14.3), focal_px=635, image_width_px=640, image_height_px=480,"
        "window_bottom_z_mm=-4.5, layers=(Layer(2.5, 1.49), Layer(2, 1.41)));"
        "c.backproject(c.project([[1, 2, 0]] * 1000)); sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
