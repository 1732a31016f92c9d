"""Cameras for the tests, and light traced from the real one: pixel, mirror, each plane, gel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera, reflect_point

Vector = NDArray[np.float64]
WIDTH, HEIGHT = 640, 480
TILT = math.radians(17.7)


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


OFF_CENTRE_PX = (9.0, -6.5)


def finger_camera(**changes: object) -> VirtualCamera:
    """A VGA camera as in a finger with a 28 x 24 mm gel: 31 mm of air, 2.5 acrylic, 2 gel.

    It is off the middle in y and its principal point off the image's centre, so that x and y, or
    two sides, cannot be swapped unnoticed.
    """
    mirror_angle, mirror = math.radians(32), np.array([-2.0, 0.0, -14.3])
    normal = np.array([-math.sin(mirror_angle), 0.0, math.cos(mirror_angle)])
    fold: dict = {
        "camera_mm": reflect_point([-12.37, 1.3, -35.53], mirror, normal),
        "pitch_rad": math.pi / 2 - 2 * mirror_angle - TILT,
        "mirror_point_mm": mirror,
        "mirror_angle_rad": mirror_angle,
        "focal_px": 634.92,
        "image_width_px": WIDTH,
        "image_height_px": HEIGHT,
        "window_bottom_z_mm": -4.5,
        "layers": (Layer(2.5, 1.4906), Layer(2.0, 1.41)),
    }
    return replace(VirtualCamera.from_fold(**(fold | changes)), principal_offset_px=OFF_CENTRE_PX)
