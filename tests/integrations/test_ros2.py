"""The ROS 2 node without ROS: its messages by the published definitions, its logic by stand-ins."""

from __future__ import annotations

import importlib
import re
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import output_samples as samples
import pytest
import ros_stand_in as ros
from camera_rig import finger_view
from ruamel.yaml import YAML

from gelslim_force.outputs.mcap_recording import force_field_definition
from gelslim_ros import messages as msg

FRAMES = [
    samples.unreadable(0, "dark"),
    samples.frame(1),
    samples.frame(2, normal_known=False, problems=("dim",)),
]
HEADER = {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": "gel"}
COLOURS = np.random.default_rng(1).integers(0, 256, (4, 6, 3), dtype=np.uint8)


def image(encoding: str, data: np.ndarray, step: int) -> Any:
    height, width = data.shape[:2]
    rows = np.zeros((height, step), dtype=np.uint8)
    flat = data.reshape(height, -1)
    rows[:, : flat.shape[1]] = flat
    return SimpleNamespace(
        encoding=encoding, height=height, width=width, step=step, data=rows.tobytes()
    )


def test_pictures_of_every_encoding_are_read() -> None:
    same = np.testing.assert_array_equal
    alpha = np.concatenate([COLOURS, COLOURS[..., :1]], axis=2)
    same(msg.picture_of(image("rgb8", COLOURS, 18)), COLOURS)
    same(msg.picture_of(image("rgb8", COLOURS, 32)), COLOURS)
    same(msg.picture_of(image("bgr8", COLOURS[..., ::-1], 18)), COLOURS)
    same(msg.picture_of(image("rgba8", alpha, 24)), COLOURS)
    same(msg.picture_of(image("bgra8", alpha[..., [2, 1, 0, 3]], 24)), COLOURS)
    same(msg.picture_of(image("mono8", COLOURS[..., 0], 8)), COLOURS[..., 0])


def test_impossible_pictures_are_refused() -> None:
    short = image("rgb8", COLOURS, 18)
    short.data = short.data[:-1]
    for message in (short, image("rgb8", COLOURS, 18), image("bayer_rggb8", COLOURS, 18)):
        message.step = 17 if message is not short and message.encoding == "rgb8" else message.step
        with pytest.raises(msg.PictureMessageError):
            msg.picture_of(message)


def test_the_definition_of_a_force_field_is_that_of_recordings() -> None:
    assert (ros.OWN / "ForceField.msg").read_text(encoding="utf-8") == force_field_definition()


@pytest.mark.slow
@pytest.mark.parametrize("frame", FRAMES, ids=["unreadable", "whole", "tangential"])
def test_messages_keep_the_published_definitions(frame: Any) -> None:
    store = ros.type_store()

    def sent(kind: str, fields: Any) -> Any:
        message = ros.with_arrays(store, msg.fill(ros.empty(store, kind), fields))
        return store.deserialize_cdr(store.serialize_cdr(message, kind), kind)

    field = sent("gelslim_msgs/msg/ForceField", msg.field_fields(frame, "gel"))
    assert field.header.frame_id == "gel"
    assert list(field.problems) == list(frame.problems)
    wrench = msg.wrench_fields(frame, "gel")
    assert (wrench is None) == (frame.wrench is None)
    if wrench is not None:
        plain = sent("geometry_msgs/msg/WrenchStamped", wrench).wrench
        np.testing.assert_array_equal(
            [plain.force.x, plain.force.y, plain.force.z], frame.wrench.force_n
        )
        kind = "gelslim_msgs/msg/WrenchWithCovarianceStamped"
        covariance = sent(kind, msg.covariance_fields(frame, "gel")).covariance.reshape(6, 6)
        np.testing.assert_allclose(covariance[:3, :3], frame.wrench.covariance[:3, :3])
        np.testing.assert_allclose(covariance[3:, 3:], frame.wrench.covariance[3:, 3:] * 1e-6)
    picture = sent("sensor_msgs/msg/Image", msg.image_fields(COLOURS, HEADER))
    np.testing.assert_array_equal(msg.picture_of(picture), COLOURS)


class Pipeline:
    """Gives the frames above in turn, and counts the rests taken."""

    def __init__(self) -> None:
        camera = SimpleNamespace(
            image_height_px=480, image_width_px=640, project=finger_view().project
        )
        self.calibration = SimpleNamespace(
            camera=camera, reference=SimpleNamespace(positions_px=samples.MARKERS_MM)
        )
        self.stamps: list[float | None] = []
        self.rests = 0

    def prepare(self) -> None:
        assert not self.stamps

    def process(self, picture: np.ndarray, stamp_s: float | None = None) -> Any:
        self.stamps.append(stamp_s)
        return FRAMES[len(self.stamps) - 1]

    def tare(self, picture: np.ndarray) -> Any:
        self.rests += 1
        return SimpleNamespace(shift_px=(0.3, -0.4))


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Any:
    store = ros.type_store()
    ros.install(monkeypatch, store)
    monkeypatch.delitem(sys.modules, "gelslim_ros.force_node", raising=False)
    module = importlib.import_module("gelslim_ros.force_node")
    opened: dict[str, Any] = {}

    def open_sensor(bundle: str, **options: Any) -> Pipeline:
        opened.update(options, bundle=bundle)
        return Pipeline()

    monkeypatch.setattr(module, "open_sensor", open_sensor)
    given = {"bundle": "b", "calibration": "c.json", "frame_id": "left_gel", "overlay_every": 0}
    monkeypatch.setattr(ros.StandInNode, "given", given)
    made = module.ForceNode()
    made.opened = opened
    return made


@pytest.mark.slow
def test_the_node_publishes_what_the_pictures_give(node: Any) -> None:
    assert node.opened == {
        "bundle": "b", "calibration": "c.json", "indenter": None, "gel_calibration": None,
        "light_calibration": None,
    }  # fmt: skip
    (take,) = node.subscriptions.values()
    for second in range(3):
        message = image("rgb8", COLOURS, 18)
        message.header = SimpleNamespace(stamp=SimpleNamespace(sec=second, nanosec=500_000_000))
        take(message)
    assert [len(node.published[f"~/{t}"]) for t in ("wrench", "force_field", "overlay")] == [
        2,
        3,
        0,
    ]
    assert {m.header.frame_id for m in node.published["~/wrench"]} == {"left_gel"}
    levels = [bytes([d.status[0].level[0]]) for d in node.published["/diagnostics"]]
    assert levels == [b"\x01", b"\x00", b"\x01"]
    assert node.published["/diagnostics"][2].status[0].message == "dim"
    assert node._server.pipeline.stamps == [0.5, 1.5, 2.5]


@pytest.mark.slow
def test_the_service_takes_the_last_picture_for_the_new_rest(node: Any) -> None:
    call = node.services["~/tare"]
    early = call(None, SimpleNamespace())
    assert not early.success
    (take,) = node.subscriptions.values()
    message = image("mono8", COLOURS[..., 0], 6)
    message.header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
    take(message)
    assert call(None, SimpleNamespace()).success
    assert node._server.pipeline.rests == 1


@pytest.mark.slow
def test_a_picture_that_cannot_be_read_is_told_and_the_node_goes_on(node: Any) -> None:
    (take,) = node.subscriptions.values()
    message = image("yuv422", COLOURS, 18)
    message.header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
    take(message)
    assert len(node.errors) == 1
    assert not node.published["~/force_field"]


@pytest.mark.slow
def test_a_pressed_sensor_gives_the_forces_of_its_pipeline() -> None:
    """Drawn pictures of a pad under known tractions, at rest and pressed, then a new rest."""
    from pressed_samples import calibration, lit_bundle, pressed, reference

    from gelslim_force.joint.sensor_source import unknown_shape
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_ros.force_server import ForceServer

    sent: dict[str, list[Any]] = {}
    source = unknown_shape(lit_bundle(), calibration(), reference().image, gel="linear")
    server = ForceServer(
        ForcePipeline(lit_bundle(), calibration(), normal=source),
        lambda topic, fields: sent.setdefault(topic, []).append(fields),
    )
    truth = pressed(13)
    server.take(reference().image, 100.0)
    result = server.take(truth.image, 100.1)
    assert server.take(reference().image, 100.2).wrench is not None
    force = sent["wrench"][1]["wrench"]["force"]
    assert [force[axis] for axis in "xyz"] == pytest.approx(result.wrench.force_n.tolist())
    assert force["z"] == pytest.approx(truth.wrench[2], rel=0.1)
    assert [w["header"]["stamp"]["sec"] for w in sent["wrench"]] == [100] * 3
    assert len(sent["force_field"]) == 3
    overlay = sent["overlay"][0]
    assert overlay["height"] * overlay["step"] == len(overlay["data"])
    assert server.tare()[0]
    server.take(truth.image)
    assert not server.tare()[0]


@pytest.mark.slow
def test_the_round_trip_of_the_container_compares_every_field(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The script that the job with ROS runs, here with the serialisation of rosbags."""
    store = ros.type_store()
    ros.install(monkeypatch, store)
    spoilt: list[bool] = []

    def serialize(message: Any) -> bytes:
        return bytes(store.serialize_cdr(ros.with_arrays(store, message), message.__msgtype__))

    def deserialize(sent: bytes, constructor: Any) -> Any:
        message = store.deserialize_cdr(sent, constructor().__msgtype__)
        if hasattr(message, "covariance") and spoilt:
            message.covariance = message.covariance + 1
        return message

    module = ModuleType("rclpy.serialization")
    module.serialize_message, module.deserialize_message = serialize, deserialize  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "rclpy.serialization", module)
    script = runpy.run_path(str(ros.INTEGRATION / "round_trip.py"))
    script["main"]()
    assert capsys.readouterr().out.count("come back") == 3
    spoilt.append(True)
    with pytest.raises(AssertionError, match="covariance"):
        script["main"]()


class LinkedNode(ros.StandInNode):
    """A node whose messages reach the other nodes of this process at once, by absolute names."""

    takers: ClassVar[dict[str, list[Any]]] = {}

    def _absolute(self, topic: str) -> str:
        if topic.startswith("~/"):
            return f"/gelslim/{self._name}/{topic[2:]}"
        return topic if topic.startswith("/") else f"/gelslim/{topic}"

    def create_publisher(self, kind: Any, topic: str, depth: Any) -> Any:
        takers = self.takers.setdefault(self._absolute(topic), [])

        def publish(message: Any) -> None:
            for take in takers:
                take(message)

        return SimpleNamespace(publish=publish, get_subscription_count=lambda: len(takers))

    def create_subscription(self, kind: Any, topic: str, call: Any, qos: Any) -> None:
        self.takers.setdefault(self._absolute(topic), []).append(call)

    def destroy_node(self) -> None:
        self.takers.clear()


@pytest.mark.slow
@pytest.mark.parametrize(("true_n", "status"), [(None, 0), (-0.001, 1)], ids=["as found", "other"])
def test_the_drawn_press_of_the_container_judges_the_node(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, true_n: float | None, status: int
) -> None:
    """The script that the job with ROS runs, here with linked nodes and known results."""
    image = pytest.importorskip("PIL.Image")
    frame = samples.frame(1)
    assert frame.wrench is not None
    found = float(frame.wrench.force_n[2])
    (tmp_path / "frames").mkdir()
    for k in range(2):
        image.fromarray(COLOURS).save(tmp_path / "frames" / f"frame_{k:06d}.png")
    truth = f"frame,fz_n\n0,0.0\n1,{found if true_n is None else true_n}\n"
    (tmp_path / "truth.csv").write_text(truth, encoding="utf-8")

    class Answers(Pipeline):
        def process(self, picture: np.ndarray, stamp_s: float | None = None) -> Any:
            np.testing.assert_array_equal(picture, COLOURS)
            return replace(frame, stamp_s=stamp_s)

    ros.install(monkeypatch, ros.type_store())
    monkeypatch.setattr(sys.modules["rclpy.node"], "Node", LinkedNode)
    for name in ("init", "spin_once", "try_shutdown"):
        monkeypatch.setattr(sys.modules["rclpy"], name, lambda *_, **__: None, raising=False)
    monkeypatch.setattr(LinkedNode, "takers", {})
    monkeypatch.setattr(LinkedNode, "given", {"overlay_every": 0})
    monkeypatch.delitem(sys.modules, "gelslim_ros.force_node", raising=False)
    module = importlib.import_module("gelslim_ros.force_node")
    monkeypatch.setattr(module, "open_sensor", lambda *_, **__: Answers())
    module.ForceNode()
    script = runpy.run_path(str(ros.INTEGRATION / "drawn_press.py"))
    assert script["main"](tmp_path) == status


def test_the_job_with_ros_is_written_in_shell_and_names_files_that_exist() -> None:
    """It needs a container, which not every machine has."""
    root = ros.INTEGRATION.parents[1]
    text = (root / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")
    job = YAML(typ="safe").load(text)["jobs"]["ros2"]
    assert job["container"].startswith("ros:")
    steps = [step["run"] for step in job["steps"] if "run" in step]
    assert len(steps) >= 4
    for step in steps:
        checked = subprocess.run(["bash", "-n", "-c", step], capture_output=True, text=True)
        assert checked.returncode == 0, checked.stderr
    named = re.findall(r"integrations/[\w/]+\.py", "\n".join(steps))
    assert named
    assert all((root / path).is_file() for path in named)
