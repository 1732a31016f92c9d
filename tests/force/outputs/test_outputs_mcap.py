"""MCAP recordings, read back with mcap-ros2-support."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import output_samples as samples
import pytest

from gelslim_core.errors import OutputError
from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.mcap_recording import McapRecording, nanoseconds
from gelslim_force.tracking.tracks import Tracks

pytest.importorskip("mcap_ros2")
SAMPLES = Path(__file__).parents[1]
FRAMES = [
    samples.unreadable(0, "größe 3×5 px"),
    samples.frame(1),
    samples.frame(2, normal_known=False, problems=("dim", "no contact patch")),
]


def messages(path: Path) -> dict[str, list[Any]]:
    from mcap_ros2.reader import read_ros2_messages

    found: dict[str, list[Any]] = {}
    for message in read_ros2_messages(str(path)):
        found.setdefault(message.channel.topic, []).append(message)
    return found


def xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def check_field(message: Any, given: FrameResult) -> None:
    """Every field of a ForceField message, in SI units."""
    field, wrench, tracks = given.field, given.wrench, given.tracks
    assert message.header.frame_id == "gel"
    assert message.header.stamp.sec == 0
    assert message.header.stamp.nanosec == round(given.time_s * 1e9)
    assert message.frame_index == given.index
    assert message.normal_known == given.normal_known
    assert tuple(message.problems) == given.problems
    assert message.markers == (0 if tracks is None else 342)
    assert message.markers_tracked == (0 if tracks is None else 333)
    if field is None or wrench is None:
        assert np.isnan([*xyz(message.wrench.force), *xyz(message.wrench.torque)]).all()
        assert np.isnan(message.wrench_covariance).all()
        assert np.isnan([*message.centre_of_pressure, message.slip_margin, message.misfit]).all()
        for name in ("points", "displacement", "force", "traction", "contact"):
            assert len(getattr(message, name)) == 0
        return
    same = np.testing.assert_allclose
    same(xyz(message.wrench.force), wrench.force_n, rtol=1e-15)
    same(xyz(message.wrench.torque), wrench.torque_nmm / 1e3, rtol=1e-15)
    covariance = np.reshape(message.wrench_covariance, (6, 6))
    same(covariance[:3, :3], wrench.covariance[:3, :3], rtol=1e-15)
    same(covariance[:3, 3:], wrench.covariance[:3, 3:] * 1e-3, rtol=1e-15)
    same(covariance[3:, 3:], wrench.covariance[3:, 3:] * 1e-6, rtol=1e-14)
    same(message.centre_of_pressure, field.centre_of_pressure_mm / 1e3, rtol=1e-15)
    same([message.slip_margin, message.misfit], [field.slip_margin, field.misfit], rtol=1e-15)
    for name, values, to_si in (
        ("points", field.points_mm, 1e-3),
        ("displacement", field.displacement_mm, 1e-3),
        ("force", field.force_n, 1.0),
        ("traction", field.traction_mpa, 1e6),
    ):
        same(np.reshape(getattr(message, name), (-1, 3)), values * to_si, rtol=6e-8, err_msg=name)
    assert list(message.contact) == field.contact.tolist()


def test_every_field_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "ein Lauf ü.mcap"
    with McapRecording(path, frame_id="gel", namespace="/left", about={"spec_hash": "ab"}) as out:
        for result in FRAMES:
            out.append(result)
    found = messages(path)
    assert {topic: len(items) for topic, items in found.items()} == {
        "/left/wrench": 2,
        "/left/force_field": 3,
    }
    for item, given in zip(found["/left/force_field"], FRAMES, strict=True):
        check_field(item.ros_msg, given)
        assert item.log_time_ns == nanoseconds(given.time_s)
    for item, given in zip(found["/left/wrench"], FRAMES[1:], strict=True):
        assert item.ros_msg.header.frame_id == "gel"
        assert given.wrench is not None
        np.testing.assert_allclose(xyz(item.ros_msg.wrench.force), given.wrench.force_n)
        np.testing.assert_allclose(xyz(item.ros_msg.wrench.torque), given.wrench.torque_nmm / 1e3)


def test_frames_with_stamps_merge_with_other_logs(tmp_path: Path) -> None:
    """Header, log time and publish time are the stamp, to the quarter of a microsecond."""
    stamps = [1_795_441_687.125 + k / 90 for k in range(3)]
    with McapRecording(tmp_path / "live.mcap") as out:
        for k, stamp_s in enumerate(stamps):
            out.append(samples.frame(k, stamp_s=stamp_s))
    for topic in messages(tmp_path / "live.mcap").values():
        for item, stamp_s in zip(topic, stamps, strict=True):
            header = item.ros_msg.header.stamp
            assert item.log_time_ns == item.publish_time_ns == nanoseconds(stamp_s)
            assert header.sec * 10**9 + header.nanosec == item.log_time_ns
            assert abs(item.log_time_ns - stamp_s * 1e9) < 250


def test_metadata(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    with McapRecording(tmp_path / "a.mcap", about={"spec_hash": "ab"}) as out:
        out.append(FRAMES[1])
    with open(tmp_path / "a.mcap", "rb") as file:
        reader = make_reader(file)
        assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [
            ("gelslim", {"spec_hash": "ab"})
        ]
        assert reader.get_header().profile == "ros2"


def exact_frame() -> FrameResult:
    """A frame of numbers that every machine computes alike, so that its bytes can be pinned."""
    nodes = np.arange(12.0).reshape(4, 3)
    field = ForceField(
        points_mm=nodes / 4,
        displacement_mm=nodes / 64 - 0.125,
        force_n=-nodes / 8,
        traction_mpa=nodes / 1024,
        contact=np.array([True, False, True, True]),
        centre_of_pressure_mm=np.array([0.5, -1.25]),
        slip_margin=0.375,
        misfit=0.0625,
    )
    tracks = Tracks(np.ones((3, 2)), np.zeros((3, 2)), np.array([0, 1, 0]), np.array([2, -1, 0]))
    covariance = np.arange(36.0).reshape(6, 6) / 16
    wrench = Wrench(np.array([0.25, -0.5, -3.0]), np.array([8.0, -2.0, 0.75]), covariance)
    problems = ("dim", "größe 3×5 \udcff\0")
    return FrameResult(7, 12.25, tracks, None, field, wrench, True, problems=problems)


def test_bytes_of_the_messages(tmp_path: Path) -> None:
    """Plain CDR as rosbag2 reads it; undecodable bytes become escapes, zero bytes go."""
    from mcap.reader import make_reader

    with McapRecording(tmp_path / "a.mcap", frame_id="gel") as out:
        out.append(exact_frame())
        out.append(FrameResult(1, float("nan"), problems=("gone",)))
    with open(tmp_path / "a.mcap", "rb") as file:
        found = [m.data for _, _, m in make_reader(file).iter_messages(log_time_order=False)]
    assert [(len(data), hashlib.sha256(data).hexdigest()[:16]) for data in found] == [
        (68, "3e230e19b74674ba"),
        (656, "786ba2587f6934fc"),
        (437, "ce7d556eb99ab0c6"),
    ]


@pytest.mark.slow
def test_a_killed_recording_can_be_recovered(tmp_path: Path) -> None:
    """Whole chunks of the file are read as a stream; the tail in memory is lost."""
    path = tmp_path / "killed.mcap"
    code = f"""
import os, signal, sys
sys.path[:0] = [{str(SAMPLES)!r}]
import output_samples as samples
from gelslim_force.outputs.mcap_recording import McapRecording
out = McapRecording({str(path)!r})
for k in range(30):
    out.append(samples.frame(k))
os.kill(os.getpid(), signal.SIGKILL)
"""
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    from mcap.exceptions import EndOfFile
    from mcap.records import Message
    from mcap.stream_reader import StreamReader

    seen = []
    with open(path, "rb") as file:
        try:
            for item in StreamReader(file).records:
                if isinstance(item, Message):
                    seen.append(item.sequence)
        except EndOfFile:
            pass
    frames = sorted(set(seen))
    assert frames == list(range(len(frames)))
    assert len(frames) >= 20


def test_refusals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OutputError, match=r"a\.bag"):
        McapRecording(tmp_path / "a.bag")
    (tmp_path / "a.mcap").write_bytes(b"mine")
    with pytest.raises(OutputError, match=r"a\.mcap"):
        McapRecording(tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == b"mine"
    out = McapRecording(tmp_path / "b.mcap")
    out.finish()
    out.finish()
    with pytest.raises(OutputError, match=r"b\.mcap"):
        out.append(FRAMES[1])
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    with pytest.raises(MissingLibraryError) as refused:
        McapRecording(tmp_path / "c.mcap")
    assert (refused.value.name, refused.value.extra) == ("mcap_ros2", "record")


def test_stamps() -> None:
    assert nanoseconds(1.5) == 1_500_000_000
    assert [nanoseconds(t) for t in (-1.0, float("nan"), float("inf"), 1e12)] == [0, 0, 0, 0]
