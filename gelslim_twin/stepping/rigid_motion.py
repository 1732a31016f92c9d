"""Rigid motions: reading them, and the closed form from and to the tool's pose.

A rigid motion is a matrix (4, 4) that takes points of a body to the sensor frame, in mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import angles_deg, quaternion_matrix, rotation
from gelslim_twin.stepping.step_error import StepError

Array = NDArray[np.float64]
NOT_RIGID = 1e-6
"""Largest deviation of R'R from the identity, and of the last row of a matrix."""
NOT_UNIT = 1e-3
"""Largest deviation of the length of a quaternion from 1."""
FORMS = (
    "give each body a matrix (4, 4), or the seven numbers x, y, z in mm and the unit quaternion "
    "w, x, y, z"
)


def rigid_motions(poses: ArrayLike, bodies: int) -> Array:
    """Read the poses of bodies as rigid motions.

    Args:
        poses: Matrices (k, 4, 4), or positions in mm and unit quaternions (k, 7), as
            x, y, z, qw, qx, qy, qz; for a single body also (4, 4) or (7,).
        bodies: The number k of bodies.

    Returns:
        The motions (k, 4, 4).

    Raises:
        StepError: The shape is another, a number is not finite, or a motion is not rigid.
    """
    given = _numbers(poses)
    if bodies == 1 and given.shape in ((4, 4), (7,)):
        given = given[None]
    if given.shape not in ((bodies, 7), (bodies, 4, 4)):
        raise StepError(f"poses of shape {given.shape} for {bodies} bodies; {FORMS}")
    return np.stack([_motion(number, one) for number, one in enumerate(given)])


def batch_motions(poses: ArrayLike, bodies: int) -> tuple[Array, dict[int, StepError]]:
    """Read the poses of bodies in n contacts as rigid motions.

    Args:
        poses: Matrices (n, k, 4, 4), or positions in mm and unit quaternions (n, k, 7); for a
            single body also (n, 4, 4) or (n, 7).
        bodies: The number k of bodies.

    Returns:
        The motions (n, k, 4, 4), and by number the error of each contact whose pose is not finite
        or not rigid; the motions of these hold NaN.

    Raises:
        StepError: The shape is another.
    """
    given = _numbers(poses)
    if bodies == 1 and given.shape[1:] in ((4, 4), (7,)):
        given = given[:, None]
    if given.shape[1:] not in ((bodies, 7), (bodies, 4, 4)):
        raise StepError(
            f"poses of shape {given.shape} for many contacts of {bodies} bodies, the first number "
            f"being that of the contacts; {FORMS}"
        )
    motions, errors = np.full((len(given), bodies, 4, 4), np.nan), {}
    plain = np.zeros(len(given), dtype=bool)
    if given.ndim == 4:
        plain = _are_motions(given)
        motions[plain] = given[plain]
    for number in np.flatnonzero(~plain):
        try:
            motions[number] = [_motion(body, pose) for body, pose in enumerate(given[number])]
        except StepError as error:
            errors[int(number)] = error
    return motions, errors


def _are_motions(matrices: Array) -> NDArray[np.bool_]:
    """Whether (n,) all matrices (n, k, 4, 4) are rigid motions."""
    turn = np.where(np.isfinite(matrices), matrices, 0.0)[..., :3, :3]
    bent = np.abs(np.swapaxes(turn, 2, 3) @ turn - np.eye(3)).max(axis=(2, 3))
    last = np.abs(matrices[..., 3, :] - [0.0, 0.0, 0.0, 1.0]).max(axis=2)
    rigid = (bent <= NOT_RIGID) & (np.linalg.det(turn) > 0) & (last <= NOT_RIGID)
    return np.asarray((rigid & np.isfinite(matrices).all(axis=(2, 3))).all(axis=1))


def _motion(number: int, given: Array) -> Array:
    if not np.isfinite(given).all():
        raise StepError(f"pose of body {number} holds a number that is not finite: {given}")
    return _of_quaternion(number, given) if given.ndim == 1 else _of_matrix(number, given)


def _numbers(poses: Any) -> Array:
    try:
        return np.array(poses, dtype=float)
    except (TypeError, ValueError):
        raise StepError(f"poses are not an array of numbers; {FORMS}") from None


def _of_matrix(number: int, matrix: Array) -> Array:
    turn = matrix[:3, :3]
    bent = float(np.abs(turn.T @ turn - np.eye(3)).max())
    if bent > NOT_RIGID or np.linalg.det(turn) < 0:
        raise StepError(
            f"pose of body {number}: its upper left block is no rotation (R'R differs from the "
            f"identity by {bent:.2g}, determinant {np.linalg.det(turn):.3g}); scale and reflection "
            "are not part of a rigid motion"
        )
    if np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max() > NOT_RIGID:
        raise StepError(f"pose of body {number}: its last row is {matrix[3]}, must be 0, 0, 0, 1")
    return matrix


def _of_quaternion(number: int, row: Array) -> Array:
    length = float(np.linalg.norm(row[3:]))
    if abs(length - 1) > NOT_UNIT:
        raise StepError(
            f"pose of body {number}: the quaternion w, x, y, z = {row[3:]} has the length "
            f"{length:.4g}, must be 1"
        )
    found = np.eye(4)
    found[:3, :3] = quaternion_matrix(*(row[3:] / length))
    found[:3, 3] = row[:3]
    return found


def tool_pose(motion: Array, time_s: float = 0.0) -> Pose:
    """The pose of a tool whose frame a rigid motion (4, 4) places in the sensor frame.

    At a tilt of 90° about x, where tilt about y and twist turn about the same axis, the tilt about
    y is 0.
    """
    x, y, z = (float(v) for v in motion[:3, 3])
    return Pose(time_s, x, y, -z, *angles_deg(motion[:3, :3]))


def motion_of(pose: Pose) -> Array:
    """The rigid motion (4, 4) of a tool's pose."""
    found = np.eye(4)
    found[:3, :3] = rotation(pose)
    found[:3, 3] = [pose.x_mm, pose.y_mm, -pose.depth_mm]
    return found
