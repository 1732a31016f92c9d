"""Rigid motions and tool poses: closed form both ways, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.stepping.rigid_motion import motion_of, rigid_motions, tool_pose
from gelslim_twin.stepping.step_error import StepError

STILL = np.eye(4)


def test_a_random_motion_and_back() -> None:
    rng = np.random.default_rng(3)
    for turn in Rotation.random(500, random_state=4):
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = turn.as_matrix(), rng.normal(size=3)
        np.testing.assert_allclose(motion_of(tool_pose(motion)), motion, atol=1e-12)


@pytest.mark.parametrize("angles", [(90, 0, 0), (-90, 0, 30), (90, 0, -120), (0, 90, 0)])
def test_a_motion_where_two_angles_turn_about_one_axis(angles: tuple[float, ...]) -> None:
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(motion_of(tool_pose(motion)), motion, atol=1e-12)


def test_a_random_pose_and_back() -> None:
    rng = np.random.default_rng(5)
    for row in rng.uniform(-80, 80, (200, 6)):
        pose = Pose(0.5, *row)
        found = tool_pose(motion_of(pose), 0.5)
        np.testing.assert_allclose(
            [found.x_mm, found.depth_mm, found.twist_deg, found.tilt_x_deg, found.tilt_y_deg],
            [pose.x_mm, pose.depth_mm, pose.twist_deg, pose.tilt_x_deg, pose.tilt_y_deg],
            atol=1e-10,
        )


def test_a_quaternion_is_the_rotation_of_scipy() -> None:
    for turn in Rotation.random(50, random_state=6):
        row = np.array([1.0, 2.0, 3.0, *turn.as_quat(scalar_first=True)])
        found = rigid_motions(row, 1)[0]
        np.testing.assert_allclose(found[:3, :3], turn.as_matrix(), atol=1e-12)
        np.testing.assert_array_equal(found[:3, 3], [1.0, 2.0, 3.0])
        np.testing.assert_allclose(rotation(tool_pose(found)), turn.as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    "poses",
    [
        "here",
        None,
        [[1.0, 2.0], [3.0]],
        np.zeros((3, 3)),
        np.stack([STILL, STILL, STILL]),
        np.full((4, 4), np.nan),
        np.where(STILL == 0, np.inf, STILL),
        np.diag([2.0, 1.0, 1.0, 1.0]),
        np.diag([-1.0, 1.0, 1.0, 1.0]),
        np.diag([1.0, 1.0, 1.0, 2.0]),
        [0, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 2, 0, 0, 0],
        [0, 0, np.nan, 1, 0, 0, 0],
    ],
)  # fmt: skip
def test_what_is_no_rigid_motion_is_refused(poses: Any) -> None:
    with pytest.raises(StepError):
        rigid_motions(poses, 1)


def test_the_number_of_poses_is_that_of_the_bodies() -> None:
    assert rigid_motions(np.stack([STILL, STILL]), 2).shape == (2, 4, 4)
    for given in (STILL, np.stack([STILL] * 3), np.zeros(7)):
        with pytest.raises(StepError, match="2 bodies"):
            rigid_motions(given, 2)
