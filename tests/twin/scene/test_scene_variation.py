"""Data sets: pure functions of seed and number, within their ranges; frames at an even rate."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_samples import GALLERY, MINIMAL, SENSOR, load
from scipy import stats

from gelslim_core.yaml.errors import InputError
from gelslim_twin.planning.question import contact_friction, plan_scene
from gelslim_twin.scene.draw import drawn
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
        ("depth_factor: [0, 1, log_uniform]", "vary.depth_factor: 0 has no logarithm"),
        ("depth_factor: [0.5, 1, gaussian]", "log_uniform"),
        ("light_gain: [0, 1]", "must lie in 0.01 to 100"),
        ("tilt_x_deg: [-60, 0]", "must lie in -45 to 45"),
        ("gel: {poissons_ratio: [0.3, 0.6]}", "must lie in 0 to 0.499"),
        ("camera: {turn_deg: [3, 2]}", "3 is above 2"),
        ("effects: {exposure: {gain: [2, 1]}}", "2 is above 1"),
        ("effects: {exposure: {gian: [1, 2]}}", "did you mean"),
        ("split: {validation_share: 0.5, test_share: 0.5}", "leaves nothing to train with"),
        ("split: {validation: [a], test: [a]}", "listed for validation too"),
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


def truncated(low: float, high: float) -> Any:
    return stats.truncnorm(-2, 2, (low + high) / 2, (high - low) / 4)


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("uniform", lambda low, high: stats.uniform(low, high - low)),
        ("log_uniform", stats.loguniform),
        ("normal", truncated),
    ],
)
def test_draws_have_the_distribution_that_is_named(tmp_path: Path, name: str, law: Any) -> None:
    """Kolmogorov and Smirnov's test against the distributions of SciPy."""
    text = f"vary: {{depth_factor: [0.5, 1.5, {name}]}}\nseed: 3\n"
    scene = load(tmp_path, MINIMAL + text).scene
    values = [drawn(scene, k).values["depth_factor"] for k in range(4000)]
    assert stats.kstest(values, law(0.5, 1.5).cdf).pvalue > 1e-3
    assert 0.5 <= min(values) <= max(values) <= 1.5
    others = [law(*ends) for law in (stats.loguniform, truncated) for ends in [(0.5, 1.5)]]
    if name == "uniform":
        assert all(stats.kstest(values, one.cdf).pvalue < 1e-6 for one in others)


def test_another_quantity_does_not_disturb_the_draws(tmp_path: Path) -> None:
    few = load(tmp_path, MINIMAL + "vary: {friction: [0, 1], sensors: 3}\nseed: 5\n").scene
    more = """
vary:
  friction: [0, 1]
  sensors: 3
  twist_deg: [-90, 90]
  tools: [{shape: sphere, radius_mm: 4}, {shape: sphere, radius_mm: 5}]
  effects: {dirt: {specks: [1, 9]}, exposure: {gain: [0.5, 2]}}
seed: 5
"""
    many = load(tmp_path, MINIMAL + more).scene
    for number in range(50):
        one, two = drawn(few, number, 1, 3), drawn(many, number, 2, 3)
        assert one.values["friction"] == two.values["friction"]
        assert one.sensor == two.sensor
    tools = [drawn(many, k, 2, 3).tool for k in range(400)]
    assert 150 < sum(tools) < 250
    # What belongs to a built sensor is the same for all its samples.
    by_sensor = {(d.sensor, d.values["dirt.specks"]) for k in range(60)
                 if (d := drawn(many, k, 2, 3))}  # fmt: skip
    assert len(by_sensor) == 3
    assert all(specks == int(specks) and 1 <= specks <= 9 for _, specks in by_sensor)
    assert len({drawn(many, k, 2, 3).values["exposure.gain"] for k in range(60)}) == 60


def test_the_start_is_turned_and_tilted(tmp_path: Path) -> None:
    text = "vary: {twist_deg: [20, 30], tilt_x_deg: [-5, -4], tilt_y_deg: [2, 3]}\n"
    for pose in load(tmp_path, MINIMAL + text).numbered(1).poses:
        assert 20 <= pose.twist_deg <= 30
        assert -5 <= pose.tilt_x_deg <= -4
        assert 2 <= pose.tilt_y_deg <= 3


def test_tools_are_those_listed_and_the_meshes_of_a_folder(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="OBJ and PLY files are read by trimesh")
    (tmp_path / "shapes").mkdir()
    trimesh.creation.box((4, 3, 2)).export(tmp_path / "shapes" / "b.stl")
    trimesh.creation.icosphere(radius=3).export(tmp_path / "shapes" / "a.ply")
    (tmp_path / "shapes" / "notes.txt").write_text("no mesh")
    text = "vary:\n  tools: [{shape: sphere, radius_mm: 4}]\n  tool_meshes: {folder: shapes}\n"
    loaded = load(tmp_path, MINIMAL + text)
    assert [tool.name for tool in loaded.tools] == ["sphere_0", "a.ply", "b.stl"]
    seen = {loaded.numbered(k).scene.indenters[0].shape for k in range(30)}
    assert seen == {"sphere", "mesh"}
    for name in ("nowhere", "."):
        with pytest.raises(InputError, match="tool_meshes") as caught:
            load(tmp_path, MINIMAL + text.replace("shapes", name)).numbered(0)
        assert caught.value.problems[0].line == 13


def test_paths_are_drawn(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("time_s,depth_mm\n0,0\n1,0.7\n")
    text = """
vary:
  size_factor: [0.9, 1.1]
  motions:
    - {waypoints: [{move: press, depth_mm: 0.3}]}
    - {csv: p.csv}
"""
    loaded = load(tmp_path, MINIMAL + text)
    depths = {round(loaded.numbered(k).poses[-1].depth_mm, 3) for k in range(20)}
    assert depths == {0.3, 0.7}


def test_a_friction_that_the_scene_leaves_open_stays_open(tmp_path: Path) -> None:
    """It is then that of the gel's skin, in a data set as in the scene itself."""
    loaded = load(tmp_path, MINIMAL + "vary: {x_mm: [0, 1]}\n")
    assert "friction" not in loaded.numbered(2).scene.contact.model_fields_set
    assert contact_friction(loaded.numbered(2).scene.contact, 0.7) == 0.7


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
