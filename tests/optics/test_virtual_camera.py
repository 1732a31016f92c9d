"""The virtual camera against light traced from the real one: pixel, mirror, each plane, gel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gelslim_optics.virtual_camera import Layer, VirtualCamera, reflect_direction, reflect_point

Vector = NDArray[np.float64]
WIDTH, HEIGHT = 640, 480


def random_pose(rng: np.random.Generator, indices: tuple[float, float] | None = None) -> dict:
    """A camera left of a mirror that folds its view up to the gel."""
    angle = rng.uniform(math.radians(25), math.radians(40))
    n_window, n_gel = indices or (rng.uniform(1.3, 1.7), rng.uniform(1.3, 1.6))
    window, gel = rng.uniform(1, 6), rng.uniform(0.5, 6)
    bottom = -(window + gel)
    mirror = np.array([rng.uniform(2, 10), 0.0, bottom - rng.uniform(5, 12)])
    pitch = math.pi / 2 - 2 * angle - rng.uniform(0, math.radians(30))
    away = rng.uniform(10, 25)
    camera = mirror - away * np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    camera[1] = rng.uniform(-2, 2)
    return {
        "camera_mm": camera,
        "pitch_rad": pitch,
        "mirror_point_mm": mirror,
        "mirror_angle_rad": angle,
        "focal_px": rng.uniform(500, 900),
        "image_width_px": WIDTH,
        "image_height_px": HEIGHT,
        "window_bottom_z_mm": bottom,
        "layers": (Layer(window, n_window), Layer(gel, n_gel)),
    }


def rotation_about_y(angle: float) -> Vector:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def refracted(direction: Vector, normal: Vector, ratio: float) -> Vector:
    """Snell's law in vectors: `normal` points along the light, ratio = n before / n after."""
    along = direction @ normal
    across = ratio * (direction - along * normal)
    return across + math.sqrt(1 - across @ across) * normal


def traced(pose: dict, u: float, v: float, depth_of_gel: float) -> Vector:
    """Where the real camera's pixel (u, v) ends, `depth_of_gel` above the gel's back.

    The real camera is an ordinary right-handed one; it stands on its head: its image's right
    is -y... turned by its pitch about y, then half a turn about its own axis.
    """
    x = (u - (WIDTH - 1) / 2) / pose["focal_px"]
    y = (v - (HEIGHT - 1) / 2) / pose["focal_px"]
    # Upright camera looking along +x: image right is -y, image down is -z. On its head: +y, +z.
    local = np.array([1.0, x, y])
    ray = rotation_about_y(pose["pitch_rad"]) @ local
    ray /= np.linalg.norm(ray)
    angle = pose["mirror_angle_rad"]
    slope = np.array([math.cos(angle), 0.0, math.sin(angle)])
    normal = np.cross(slope, [0.0, 1.0, 0.0])
    start = pose["camera_mm"]
    path = ((pose["mirror_point_mm"] - start) @ normal) / (ray @ normal)
    assert path > 0
    point = start + path * ray
    # Reflection as half a turn about the normal, reversed.
    ray = -(2 * np.outer(normal, normal) - np.eye(3)) @ ray
    up = np.array([0.0, 0.0, 1.0])
    assert ray[2] > 0
    point = point + ray * (pose["window_bottom_z_mm"] - point[2]) / ray[2]
    before = 1.0
    window, gel = pose["layers"]
    for height, index in ((window.thickness_mm, window.index), (depth_of_gel, gel.index)):
        ray = refracted(ray, up, before / index)
        point = point + ray * height / ray[2]
        before = index
    return point


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
    assert camera.apparent_distance_mm(under)[0] == pytest.approx(seen, rel=1e-12)
    # The transverse scale f/Z there is that of an object at the apparent distance.
    scale = np.linalg.norm(camera.jacobian(under[None])[0, :, 0])
    assert scale == pytest.approx(camera.focal_px / seen, rel=1e-7)
    # A point inside the gel looks nearer by its depth over the index.
    deeper = under - [0, 0, 0.3 * gel.thickness_mm]
    assert camera.apparent_distance_mm(deeper)[0] == pytest.approx(
        seen - 0.3 * gel.thickness_mm / gel.index, rel=1e-12
    )


def test_blur_vanishes_at_the_focus_and_grows_to_both_sides() -> None:
    camera = VirtualCamera.from_fold(**random_pose(np.random.default_rng(8)))
    points = np.column_stack([np.linspace(-8, 8, 9), np.zeros(9), np.zeros(9)])
    distance = camera.apparent_distance_mm(points)
    assert camera.blur_on_gel_mm(points, 1.24, distance[4])[4] == pytest.approx(0, abs=1e-12)
    blur = camera.blur_on_gel_mm(points, 1.24, distance[4])
    # Similar triangles: the cone from the aperture to its apex in focus, carried on.
    np.testing.assert_allclose(blur, 1.24 * np.abs(distance / distance[4] - 1), atol=1e-12)
    assert blur[0] > blur[2] > 0
    assert blur[8] > blur[6] > 0
