"""Motions become poses: by waypoints, by table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter
from scene_samples import MINIMAL, load
from scipy.spatial.transform import Rotation

from gelslim_core.yaml.errors import InputError
from gelslim_twin.planning.question import motion_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.pose import Pose, poses
from gelslim_twin.scene.pose_table import read_pose_table
from gelslim_twin.scene.rotation import rotation


def motion(*waypoints: dict, **more: float) -> Motion:
    return TypeAdapter(Motion).validate_json(
        __import__("json").dumps({"waypoints": list(waypoints), **more})
    )


def test_a_press_is_even_and_ends_exactly():
    found = poses(motion({"move": "press", "depth_mm": 0.7, "steps": 7, "duration_s": 1.4}))
    assert len(found) == 8
    assert found[0] == Pose()
    assert found[-1] == Pose(time_s=1.4, depth_mm=0.7)
    np.testing.assert_allclose(np.diff([p.depth_mm for p in found]), 0.1, rtol=1e-12)
    np.testing.assert_allclose(np.diff([p.time_s for p in found]), 0.2, rtol=1e-12)


def test_each_movement_starts_where_the_last_ended_and_leaves_the_rest():
    found = poses(
        motion(
            {"move": "press", "depth_mm": 0.5, "steps": 1},
            {"move": "shear", "x_mm": 0.3, "steps": 3},
            {"move": "twist", "angle_deg": 20, "steps": 2},
            {"move": "tilt", "about": "x", "angle_deg": 4, "steps": 2},
            {"move": "tilt", "about": "y", "angle_deg": -3, "steps": 1},
            {"move": "slide", "y_mm": -4, "steps": 4},
            {"move": "hold", "steps": 2, "duration_s": 3},
            {"move": "release", "clearance_mm": 0.25, "steps": 5},
            start_x_mm=-1.0,
        )
    )
    end = found[-1]
    assert end == Pose(end.time_s, -0.7, -4.0, -0.25, 20.0, 4.0, -3.0)
    assert end.time_s == pytest.approx(0.5 * 7 + 3)
    assert {p.depth_mm for p in found[1:15]} == {0.5}
    assert len(found) == 1 + 1 + 3 + 2 + 2 + 1 + 4 + 2 + 5


def test_finer_steps_pass_through_the_coarse_poses():
    coarse = poses(motion({"move": "slide", "x_mm": 3.0, "y_mm": -1.0, "steps": 4}))
    fine = poses(motion({"move": "slide", "x_mm": 3.0, "y_mm": -1.0, "steps": 8}))
    for a, b in zip(coarse, fine[::2], strict=True):
        assert (a.x_mm, a.y_mm, a.time_s) == pytest.approx((b.x_mm, b.y_mm, b.time_s))


def test_too_many_poses_are_refused():
    with pytest.raises(ValueError, match="20000"):
        motion(*[{"move": "hold", "steps": 5000}] * 5)


def test_a_table_is_read_with_comments_and_any_order_of_columns(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("# note\ndepth_mm,time_s, twist_deg\n0,0,1\n\n0.5,0.1,2\n")
    assert read_pose_table(path) == (
        Pose(0.0, twist_deg=1.0),
        Pose(0.1, depth_mm=0.5, twist_deg=2.0),
    )


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", None, "is empty"),
        ("time_s,depth_mm\n", 1, "has no poses"),
        ("time_s,depth\n0,0\n", 1, "did you mean depth_mm"),
        ("time_s,x_mm\n0,0\n", 1, "add the column depth_mm"),
        ("time_s,depth_mm,depth_mm\n0,0,0\n", 1, "given twice"),
        ("time_s,depth_mm\n0,0\n1\n", 3, "1 values for 2 columns"),
        ("time_s,depth_mm\n0,0\n1,deep\n", 3, "depth_mm = deep: must be a number from -50 to 20"),
        ("time_s,depth_mm\n0,nan\n", 2, "must be a number"),
        ("time_s,depth_mm\n0,0\n0,1\n", 3, "must be above the time of the line before, 0 s"),
    ],
)
def test_faults_of_a_table_name_their_line(tmp_path, text, line, words):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_pose_table(path)
    assert caught.value.problems[0].line == line


@pytest.mark.parametrize(("about", "sign"), [("x", -1.0), ("y", 1.0)])
def test_a_wheel_rolls_without_slipping(about: str, sign: float) -> None:
    """Its centre moves level by radius times angle; the point that touches does not move."""
    radius, roll = 6.0, {"move": "roll", "about": about, "angle_deg": 30.0, "radius_mm": 6.0}
    found = poses(
        motion(
            {"move": "press", "depth_mm": 0.3, "steps": 1},
            {"move": "twist", "angle_deg": 40.0, "steps": 1},
            {**roll, "steps": 3000, "duration_s": 3.0},
        )
    )[2:]
    centres = np.array(
        [[p.x_mm, p.y_mm, -p.depth_mm] + rotation(p) @ [0, 0, radius] for p in found]
    )
    np.testing.assert_allclose(centres[:, 2], radius - 0.3, atol=1e-12)
    axis = "yx".index(about)
    way = sign * radius * np.radians(np.linspace(0, 30, 3001))
    np.testing.assert_allclose(centres[:, axis], way, atol=1e-12)
    np.testing.assert_allclose(centres[:, 1 - axis], 0.0, atol=1e-12)
    a, b = found[1500], found[1501]
    touching = centres[1500] - [0, 0, radius]
    start, end = (np.array([p.x_mm, p.y_mm, -p.depth_mm]) for p in (a, b))
    moved = rotation(b) @ rotation(a).T @ (touching - start) + end
    assert np.abs(moved - touching).max() < 1e-3 * np.abs(end - start).max()


def test_depths_after_a_roll_are_those_of_the_wheel() -> None:
    roll = {"move": "roll", "about": "y", "angle_deg": 25.0, "radius_mm": 4.0}
    found = poses(
        motion(
            {"move": "press", "depth_mm": 0.3, "steps": 1},
            {**roll, "steps": 5},
            {"move": "press", "depth_mm": 0.5, "steps": 1},
            {**roll, "angle_deg": -25.0, "steps": 1},
            {"move": "release", "clearance_mm": 0.2, "steps": 1},
        )
    )
    lowest = [p.depth_mm - 4.0 * rotation(p)[2, 2] + 4.0 for p in found]
    np.testing.assert_allclose(lowest, [0, *[0.3] * 6, 0.5, 0.5, -0.2], atol=1e-12)
    assert (found[-1].x_mm, found[-1].tilt_y_deg) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_table_takes_quaternions_and_matrices(tmp_path):
    """The same rotations in three ways; a turn by more than 180° goes on."""
    angles = [(20.0, 5.0, -3.0), (150.0, 10.0, 8.0), (200.0, -4.0, 30.0)]
    turns = [rotation(Pose(0, 0, 0, 0, *three)) for three in angles]
    quaternions = Rotation.from_matrix(turns).as_quat(scalar_first=True)
    rows = {
        "twist_deg,tilt_x_deg,tilt_y_deg": angles,
        "qw,qx,qy,qz": quaternions,
        ",".join(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)): [t.ravel() for t in turns],
    }
    for columns, values in rows.items():
        lines = [f"time_s,depth_mm,x_mm,{columns}"]
        lines += [f"{k},0.1,2," + ",".join(f"{v:.9f}" for v in row) for k, row in enumerate(values)]
        (tmp_path / "p.csv").write_text("\n".join(lines) + "\n")
        for pose, three in zip(read_pose_table(tmp_path / "p.csv"), angles, strict=True):
            found = (pose.twist_deg, pose.tilt_x_deg, pose.tilt_y_deg)
            assert (pose.x_mm, pose.depth_mm) == (2.0, 0.1)
            assert found == pytest.approx(three, abs=1e-6)


@pytest.mark.parametrize(
    ("head", "row", "words"),
    [
        ("qw,qx,qy", "1,0,0", "add the column qz"),
        ("qw,qx,qy,qz,twist_deg", "1,0,0,0,0", "the rotation is given once"),
        ("qw,qx,qy,qz", "0.9,0,0,0", "length 0.9"),
        ("qw,qx,qy,qz", "0,1,0,0", "known from below only"),
        ("r11,r12,r13,r21,r22,r23,r31,r32,r33", "1,0,0,0,1,0,0,0,-1", "no rotation"),
        ("r11,r12,r13,r21,r22,r23,r31,r32,r33", "1,0,0,0,1,0,0,0,0.9", "no rotation, by 0.1"),
    ],
)
def test_rotations_that_are_refused(tmp_path, head, row, words):
    (tmp_path / "p.csv").write_text(f"time_s,depth_mm,{head}\n0,0,{row}\n")
    with pytest.raises(InputError, match=words):
        read_pose_table(tmp_path / "p.csv")


def test_rolls_that_tilt_a_scene_too_far_are_refused(tmp_path):
    roll = "    - {move: roll, about: x, angle_deg: 30, radius_mm: 8}\n"
    text = MINIMAL.replace("observe:", "PLACE").replace("PLACE", roll + "observe:")
    assert load(tmp_path, text).poses[-1].tilt_x_deg == pytest.approx(30.0)
    with pytest.raises(InputError, match=r"48°.*45°"):
        load(tmp_path, text.replace(roll, 2 * roll))


def test_a_ball_that_rolls_touches_as_deep_as_before() -> None:
    """Effects are estimated from its depth; its origin is above the gel by then."""
    ball = tool_footprint((Sphere(shape="sphere", radius_mm=6.0),), Path(), 784.0)
    found = poses(
        motion(
            {"move": "press", "depth_mm": 0.3, "steps": 1},
            {"move": "roll", "about": "y", "angle_deg": 40.0, "radius_mm": 6.0, "steps": 20},
        )
    )
    assert found[-1].depth_mm < -1.0
    for pose in found[1:]:
        depth = motion_figures((Pose(-1.0), pose), ball).depth_mm
        assert 0.3 - 0.02 < depth < 2.0
    assert motion_figures(found, ball).contact_s == pytest.approx(found[-1].time_s)
