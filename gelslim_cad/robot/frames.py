"""Frames of the finger as rigid transforms to the mount, in metres.

Axes of `mount` and `gel` are those of the sensor frame: x to the tip, y across, z out of the gel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.geometry.lookup import Lookup

Transform = NDArray[np.float64]
"""Homogeneous matrix (4, 4): from coordinates in a frame to those in the mount's."""
HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])


def mount_origin_mm(d: Lookup) -> NDArray[np.float64]:
    """Middle of the jaw's face (3,) in the sensor frame: the origin of the mount."""
    bolts = JawBolts.of_design(d)
    behind = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    x = behind - bolts.plate_depth_mm / 2 if bolts.lateral else behind
    return np.array([x, 0.0, d["flange.jaw_z_mm"]])


def gel_frame(d: Lookup) -> Transform:
    """The sensor frame: origin in the middle of the gel's outer surface."""
    return _transform(np.eye(3), -mount_origin_mm(d) * 1e-3)


def optical_frame(d: Lookup) -> Transform:
    """The real camera as ROS and OpenCV have it: x right, y down in the picture, z forward.

    Its origin is the pinhole. The camera stands on its head, so that y points towards the gel, and
    it looks at the fold mirror.
    """
    pitch = math.radians(d["camera_pose.pitch_deg"])
    forward = np.array([math.cos(pitch), 0.0, -math.sin(pitch)])
    down = np.array([math.sin(pitch), 0.0, math.cos(pitch)])
    axes = np.column_stack([np.cross(down, forward), down, forward])
    place = np.array([d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]])
    return _transform(axes, (place - mount_origin_mm(d)) * 1e-3)


def graphics_frame(optical: Transform) -> Transform:
    """The same camera as MuJoCo, OpenGL and USD have it: x right, y up, looking along -z."""
    return _transform(optical[:3, :3] @ HALF_TURN_ABOUT_X, optical[:3, 3])


def vertical_fov_rad(d: Lookup) -> float:
    """Vertical field of view of the camera without distortion."""
    return 2 * math.atan(d["camera.image_height_px"] / 2 / d["view.focal_px"])


def quaternion_wxyz(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit quaternion (w, x, y, z) of a rotation (3, 3), with w >= 0."""
    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return np.array([w, x, y, z])


def roll_pitch_yaw(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles about the fixed axes x, y, z (rad), as URDF has them."""
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    # At a pitch of ±90° roll and yaw are not unique; the closed form then takes yaw as 0.
    sin_pitch = 2 * (w * y - z * x)
    if abs(sin_pitch) > 1 - 1e-12:
        pitch = math.copysign(math.pi / 2, sin_pitch)
        return np.array([math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    return Rotation.from_matrix(rotation).as_euler("xyz")


def _transform(rotation: NDArray[np.float64], place_m: NDArray[np.float64]) -> Transform:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, place_m
    return matrix
