"""Motions become poses: by waypoints, by table."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from gelslim_core.yaml.errors import InputError
from gelslim_twin.scene.motion import Motion
from gelslim_twin.scene.pose import Pose, poses, read_motion_csv


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
    assert read_motion_csv(path) == (
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
        read_motion_csv(path)
    assert caught.value.problems[0].line == line
