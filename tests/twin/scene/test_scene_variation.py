"""Data sets: pure functions of seed and number, within their ranges; frames at an even rate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scene_samples import GALLERY, MINIMAL, SENSOR, load

from gelslim_core.yaml.errors import InputError
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.scene.pose import FrameTime, Pose, frame_times
from gelslim_twin.scene.reader import read_scene

SHEAR = read_scene(next(p for p in GALLERY if p.stem == "shear_sphere"))
COUNT = 300


def test_values_lie_in_their_ranges_and_fill_them():
    scenes = [SHEAR.numbered(k).scene for k in range(COUNT)]
    friction = np.array([s.contact.friction for s in scenes])
    assert 0.2 <= friction.min() < 0.22
    assert 1.18 < friction.max() <= 1.2
    radius = np.array([s.indenters[0].radius_mm for s in scenes])
    assert 5 <= radius.min() < 5.2
    assert 11.8 < radius.max() <= 12
    # Even: the mean of n even numbers has the deviation range / sqrt(12 n).
    assert friction.mean() == pytest.approx(0.7, abs=4 / math.sqrt(12 * COUNT))
    assert abs(np.corrcoef(friction, radius)[0, 1]) < 4 / math.sqrt(COUNT)
    shear = np.array([(s.motion.waypoints[1].x_mm, s.motion.waypoints[1].y_mm) for s in scenes])
    size = np.hypot(*shear.T) / math.hypot(0.6, 0.3)
    assert 0.3 - 1e-9 <= size.min() < 0.33
    assert 1.96 < size.max() <= 2 + 1e-9
    assert len({s.seed for s in scenes}) == len({s.name for s in scenes}) == COUNT


def test_a_scene_does_not_depend_on_the_others_or_on_what_else_is_varied(tmp_path):
    assert SHEAR.numbered(7).scene == SHEAR.numbered(7).scene
    both = "vary: {friction: [0, 1], x_mm: [0, 9]}\nseed: 5\n"
    one = load(tmp_path, MINIMAL + "vary: {friction: [0, 1]}\nseed: 5\n").numbered(3)
    two = load(tmp_path, MINIMAL + both).numbered(3)
    other = load(tmp_path, MINIMAL + "vary: {friction: [0, 1]}\nseed: 6\n").numbered(3)
    assert one.scene.contact == two.scene.contact
    assert one.scene.contact != other.scene.contact
    assert one.scene.seed == two.scene.seed == 8936307579429521 != other.scene.seed


def test_a_varied_scene_is_whole_and_plans():
    for number in range(25):
        loaded = SHEAR.numbered(number)
        assert loaded.poses[0].x_mm == loaded.scene.motion.start_x_mm
        assert loaded.poses[-1].x_mm != SHEAR.poses[-1].x_mm
        assert "friction" in plan_scene(loaded, SENSOR).order
        assert loaded.numbered(0).scene.contact == loaded.scene.contact, "no ranges are left"


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ("friction: [1, 0]", "vary.friction: 1 is above 0; swap the two"),
        ("friction: [0, 99]", "must lie in 0 to 10"),
        ("size_factor: [0, 1]", "must be above 0"),
        ("fricton: [0, 1]", "did you mean vary.friction"),
    ],
)
def test_bad_ranges_are_refused_by_line(tmp_path, vary, words):
    with pytest.raises(InputError, match=r"scene\.yaml:12") as caught:
        load(tmp_path, f"{MINIMAL}vary:\n  {vary}\n")
    assert words in str(caught.value)


def test_a_value_drawn_beyond_the_limits_is_refused(tmp_path):
    loaded = load(tmp_path, MINIMAL + "vary:\n  size_factor: [900, 1000]\n")
    with pytest.raises(InputError, match=r"scene 0: indenters\.0\.sphere\.radius_mm") as caught:
        loaded.numbered(0)
    assert caught.value.problems[0].line == 11


def test_a_table_varies_in_size_and_friction_only(tmp_path):
    (tmp_path / "p.csv").write_text("time_s,depth_mm\n0,0\n1,0.5\n")
    head, _, tail = MINIMAL.partition("  waypoints:")
    table = head + "  csv: p.csv\n" + tail.partition("\n")[2].partition("\n")[2]
    loaded = load(tmp_path, table + "vary: {friction: [0.5, 1]}\n").numbered(4)
    assert 0.5 <= loaded.scene.contact.friction <= 1
    assert [p.depth_mm for p in loaded.poses] == [0, 0.5]
    with pytest.raises(InputError, match="vary"):
        load(tmp_path, table + "vary: {x_mm: [0, 1]}\n").numbered(0)


POSES = tuple(Pose(time_s=t) for t in (0.0, 0.1, 0.3, 1.0))


def test_one_frame_per_pose_by_default():
    expected = [FrameTime(p.time_s, k, 0.0) for k, p in enumerate(POSES)]
    assert list(frame_times(POSES)) == expected


@pytest.mark.parametrize("rate", [1.0, 3.0, 10.0, 29.97, 1000.0])
def test_frames_at_an_even_rate_lie_between_their_poses(rate):
    found = frame_times(POSES, rate)
    assert len(found) == math.floor(rate + 1e-9) + 1
    np.testing.assert_allclose(np.diff([f.time_s for f in found]), 1 / rate, atol=1e-9)
    for frame in found:
        start = POSES[frame.before].time_s
        after = POSES[min(frame.before + 1, len(POSES) - 1)].time_s
        assert 0 <= frame.part < 1
        assert start + frame.part * (after - start) == pytest.approx(frame.time_s, abs=1e-12)
