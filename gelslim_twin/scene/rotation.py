"""Rotations: the matrix of a pose, its angles, and the matrix of a quaternion.

A pose has R = Ry Rx Rz with the angles of tilt about y and x and of the twist about z. The third
column of R is then (cos a sin b, -sin a, cos a cos b) for the tilts a about x and b about y, and
the second row is (cos a sin c, cos a cos c, -sin a) for the twist c.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def rotation(pose: Pose) -> Array:
    """Rotation matrix (3, 3) of a pose: twist about z first, then tilt about x, then about y.

    It is read-only, because a contact asks for that of its pose some twenty times.
    """
    cz, sz = _cos_sin(pose.twist_deg)
    cx, sx = _cos_sin(pose.tilt_x_deg)
    cy, sy = _cos_sin(pose.tilt_y_deg)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    turn = np.asarray(about_y @ about_x @ about_z)
    turn.flags.writeable = False
    return turn


def _cos_sin(angle_deg: float) -> tuple[float, float]:
    angle = np.radians(angle_deg)
    return float(np.cos(angle)), float(np.sin(angle))


def angles_deg(turn: Array) -> tuple[float, float, float]:
    """Twist, tilt about x and tilt about y of a rotation matrix (3, 3).

    At a tilt of 90° about x, where tilt about y and twist turn about the same axis, the tilt about
    y is 0.
    """
    tilt_x = math.asin(min(1.0, max(-1.0, -turn[1, 2])))
    if math.hypot(turn[1, 0], turn[1, 1]) > 1e-12:
        tilt_y = math.atan2(turn[0, 2], turn[2, 2])
        twist = math.atan2(turn[1, 0], turn[1, 1])
    else:
        tilt_y, twist = 0.0, math.atan2(-turn[0, 1], turn[0, 0])
    return math.degrees(twist), math.degrees(tilt_x), math.degrees(tilt_y)


def quaternion_matrix(w: float, x: float, y: float, z: float) -> Array:
    """The rotation matrix (3, 3) of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
