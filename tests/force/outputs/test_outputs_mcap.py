"""MCAP recordings, read and encoded by mcap-ros2-support as the judge."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import output_samples as samples
import pytest

from gelslim_core.files.output_error import OutputError
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.mcap_recording import McapRecording
from gelslim_force.outputs.ros_messages import FORCE_FIELD, force_field, nanoseconds, schema

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


@pytest.mark.parametrize("result", FRAMES)
def test_bytes_equal_those_of_mcap_ros2(result: FrameResult) -> None:
    """The same message through the library's own encoder, which reads the definition."""
    from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

    text = schema(FORCE_FIELD)
    mine = force_field(result, "gel")
    message: SimpleNamespace = generate_dynamic(FORCE_FIELD, text)[FORCE_FIELD](mine)
    message.contact = [bool(touched) for touched in message.contact]
    assert serialize_dynamic(FORCE_FIELD, text)[FORCE_FIELD](message) == mine


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
    with pytest.raises(OutputError, match=r"must end in .mcap"):
        McapRecording(tmp_path / "a.bag")
    (tmp_path / "a.mcap").write_bytes(b"mine")
    with pytest.raises(OutputError, match="in the way"):
        McapRecording(tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == b"mine"
    out = McapRecording(tmp_path / "b.mcap")
    out.finish()
    out.finish()
    with pytest.raises(OutputError, match="is finished"):
        out.append(FRAMES[1])
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(OutputError, match=r"gelslim-cad\[record\]"):
        McapRecording(tmp_path / "c.mcap")


def test_stamps() -> None:
    assert nanoseconds(1.5) == 1_500_000_000
    assert [nanoseconds(t) for t in (-1.0, float("nan"), float("inf"), 1e12)] == [0, 0, 0, 0]
