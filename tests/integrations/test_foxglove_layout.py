"""The layout for Foxglove names topics and fields that a written recording has; its scripts run."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import output_samples as samples
import pytest
import ros_stand_in as ros

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.mcap_recording import FORCE_FIELD, McapRecording, force_field, schema

FOLDER = Path(__file__).parents[2] / "integrations" / "foxglove"
LAYOUT = json.loads((FOLDER / "gelslim.json").read_text(encoding="utf-8"))
SCRIPTS = LAYOUT["userNodes"]
OUTPUT = re.compile(r'^export const output = "([^"]+)";$', re.MULTILINE)
INPUTS = re.compile(r'^export const inputs = \["([^"]+)"\];$', re.MULTILINE)
PATH = re.compile(r"(?P<topic>(?:/\w+)+)(?P<steps>(?:\.\w+|\[\d+\])+)")
PANELS = {"3D", "Plot", "StateTransitions"}
FRAMES = [
    samples.unreadable(0, "dark"),
    samples.frame(1),
    samples.frame(2, normal_known=False, problems=("dim",)),
]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """Messages of a recording by their topics."""
    pytest.importorskip("mcap_ros2")
    from mcap_ros2.reader import read_ros2_messages

    path = tmp_path_factory.mktemp("foxglove") / "run.mcap"
    with McapRecording(path) as out:
        for frame in FRAMES:
            out.append(frame)
    found: dict[str, list[Any]] = {}
    for message in read_ros2_messages(str(path)):
        found.setdefault(message.channel.topic, []).append(message)
    return found


def leaves(node: Any) -> Iterator[str]:
    """The panels that a layout places."""
    if isinstance(node, str):
        yield node
        return
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    yield from leaves(node["first"])
    yield from leaves(node["second"])


def series() -> list[str]:
    """All message paths of the panels; a plot's constant line is none."""
    paths = [p for config in LAYOUT["configById"].values() for p in config.get("paths", ())]
    assert all(p["enabled"] and p["timestampMethod"] == "receiveTime" for p in paths)
    return [p["value"] for p in paths if not re.fullmatch(r"[\d.]+", p["value"])]


def made_topics() -> dict[str, str]:
    """What the scripts publish, and the names of the scripts."""
    found = {}
    for name, node in SCRIPTS.items():
        (topic,) = OUTPUT.findall(node["sourceCode"])
        found[topic] = name
    return found


def test_every_panel_is_placed_once() -> None:
    placed = list(leaves(LAYOUT["layout"]))
    assert sorted(placed) == sorted(LAYOUT["configById"])
    assert {name.partition("!")[0] for name in placed} == PANELS


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_is_its_file(name: str) -> None:
    """After a change put the file's text into `sourceCode` of gelslim.json."""
    assert SCRIPTS[name]["sourceCode"] == (FOLDER / f"{name}.ts").read_text(encoding="utf-8")
    assert {p.stem for p in FOLDER.glob("*.ts")} == set(SCRIPTS)


def test_every_field_is_in_a_recording(recorded: dict[str, list[Any]]) -> None:
    made = made_topics()
    paths = series()
    assert len(paths) >= 15
    for path in paths:
        parts = PATH.fullmatch(path)
        assert parts is not None, path
        topic, steps = parts["topic"], re.findall(r"\w+", parts["steps"])
        if topic in made:
            assert re.search(rf"^  {steps[0]}: number;$", SCRIPTS[made[topic]]["sourceCode"], re.M)
            continue
        values = [value(message.ros_msg, steps) for message in recorded[topic]]
        assert any(v is not None for v in values), path
        assert all(isinstance(v, int | float | str | None) for v in values), path


def value(message: Any, steps: list[str]) -> Any:
    """What a path names; None where a list of the message is too short."""
    for step in steps:
        if step.isdigit():
            if int(step) >= len(message):
                return None
            message = message[int(step)]
        else:
            message = getattr(message, step)
    return message


def test_scripts_read_recorded_topics_and_one_is_shown(recorded: dict[str, list[Any]]) -> None:
    for node in SCRIPTS.values():
        assert set(INPUTS.findall(node["sourceCode"])) <= set(recorded)
    made = made_topics()
    assert not set(made) & set(recorded)
    space = LAYOUT["configById"]["3D!gelslim"]
    assert set(space["topics"]) <= set(made)
    frames = {m.ros_msg.header.frame_id for m in recorded["/gelslim/force_field"]}
    assert frames == {space["followTf"]}
    kinds = {topic: items[0].schema.name for topic, items in recorded.items()}
    assert kinds == {
        "/gelslim/wrench": "geometry_msgs/msg/WrenchStamped",
        "/gelslim/force_field": "gelslim_msgs/msg/ForceField",
    }


def test_the_live_topics_are_those_of_the_node() -> None:
    """The page says to put `/gelslim/force/` in place of `/gelslim/`."""
    from gelslim_ros.force_server import TOPICS

    launch = (ros.INTEGRATION / "gelslim_ros" / "launch" / "force.launch.py").read_text("utf-8")
    assert '"namespace": "gelslim"' in launch
    assert 'name="force"' in launch
    named = {path.split(".")[0].removeprefix("/gelslim/") for path in series()}
    assert named - {t.removeprefix("/gelslim/") for t in made_topics()} <= set(TOPICS)


def typescript_of(kind: str) -> str:
    """A message as a type of TypeScript, from the definition that recordings carry."""
    numbers = r"u?int\d+|float\d+"
    types = {"bool": "boolean", "string": "string", "builtin_interfaces/Time": "Time"}
    texts = re.split(r"={80}\nMSG: (\S+)\n", f"{'=' * 80}\nMSG: {kind}\n{schema(kind)}")
    lines = ["export type Time = { sec: number; nsec: number };"]
    for name, text in zip(texts[1::2], texts[2::2], strict=True):
        if name == "builtin_interfaces/Time":
            continue
        fields = []
        for declared, many, field in re.findall(r"^([\w/]+)(\[\d*\])? (\w+)", text, re.MULTILINE):
            plain = "number" if re.fullmatch(numbers, declared) else types.get(declared)
            plain = plain or declared.replace("/", "_")
            fields.append(f"{field}: {f'ReadonlyArray<{plain}>' if many else plain};")
        lines.append(f"export interface {name.replace('/', '_')} {{ {' '.join(fields)} }}")
    return "\n".join(lines)


def sent(result: FrameResult) -> dict[str, Any]:
    """A force field as a script of Foxglove gets it; JSON has no NaN."""
    message = force_field(result, "gelslim_sensor")
    stamp = message["header"]["stamp"]
    message["header"]["stamp"] = {"sec": stamp["sec"], "nsec": stamp["nanosec"]}
    return json.loads(json.dumps(message).replace("NaN", '"NaN"'))


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """What each script makes of the frames: type-checked by tsc, run by node."""
    tsc, node = shutil.which("tsc"), shutil.which("node")
    if tsc is None or node is None:
        pytest.skip("NOT TESTED: scripts of Foxglove need node and tsc (Debian: node-typescript)")
    folder = tmp_path_factory.mktemp("scripts")
    (folder / "types.ts").write_text(
        f"{typescript_of(FORCE_FIELD)}\n"
        "type Field = gelslim_msgs_msg_ForceField;\n"
        "export type Input<T extends string> = { topic: T; message: Field };\n"
        "export type Message<_ extends string> = Record<string, unknown>;\n",
        encoding="utf-8",
    )
    for name, script in SCRIPTS.items():
        (folder / f"{name}.ts").write_text(script["sourceCode"], encoding="utf-8")
    files = [f"{name}.ts" for name in SCRIPTS]
    options = ["--strict", "--target", "ES2022", "--module", "CommonJS"]
    checked = subprocess.run(
        [tsc, *options, *files], cwd=folder, capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout
    (folder / "frames.json").write_text(json.dumps([sent(f) for f in FRAMES]), encoding="utf-8")
    program = (
        "const alive = (k, v) => v === 'NaN' ? NaN : v;"
        "const frames = JSON.parse(require('fs').readFileSync('frames.json'), alive);"
        "const made = {};"
        f"for (const name of {json.dumps(list(SCRIPTS))})"
        " made[name] = frames.map(message => require(`./${name}.js`).default({message}));"
        "console.log(JSON.stringify(made));"
    )
    ran = subprocess.run(
        [node, "-e", program], cwd=folder, capture_output=True, text=True, check=True
    )
    return json.loads(ran.stdout)


@pytest.mark.slow
def test_limits_are_those_of_the_wrench(outputs: dict[str, list[Any]]) -> None:
    wrench = FRAMES[1].wrench
    assert wrench is not None
    made = outputs["force_limits"][1]
    for k, axis in enumerate("xyz"):
        low, high = made[f"f{axis}_low"], made[f"f{axis}_high"]
        np.testing.assert_allclose((low + high) / 2, wrench.force_n[k], rtol=1e-12)
        width = 2 * 1.96 * wrench.standard_deviation[k]
        np.testing.assert_allclose(high - low, width, rtol=1e-12)
    assert all(v is None for v in outputs["force_limits"][0].values())


@pytest.mark.slow
def test_arrows_are_the_force_field(outputs: dict[str, list[Any]]) -> None:
    """Every node of more than 300 Pa has an arrow of 2 mm per 10 kPa; the resultant 1 cm per N."""
    for frame, made in zip(FRAMES, outputs["force_arrows"], strict=True):
        (entity,) = made["entities"]
        field_lines, outline = entity["lines"]
        points = np.array([[p["x"], p["y"], p["z"]] for p in field_lines["points"]])
        if frame.field is None or frame.wrench is None:
            assert not len(points)
            assert not entity["arrows"]
            continue
        traction = np.nan_to_num(frame.field.traction_mpa) * 1e6
        drawn = np.linalg.norm(traction, axis=1) > 300
        assert drawn.any()
        np.testing.assert_allclose(points[::2], frame.field.points_mm[drawn] / 1e3, atol=1e-8)
        np.testing.assert_allclose(points[1::2] - points[::2], 2e-7 * traction[drawn], atol=1e-8)
        corners = {(round(1e3 * p["x"], 3), round(1e3 * p["y"], 3)) for p in outline["points"]}
        assert len(corners) == 4
        force = np.nan_to_num(frame.wrench.force_n)
        (arrow,) = entity["arrows"]
        length = arrow["shaft_length"] + arrow["head_length"]
        np.testing.assert_allclose(length, 0.01 * np.linalg.norm(force), rtol=1e-9)
        q = arrow["pose"]["orientation"]
        along = rotated_x(q["w"], np.array([q["x"], q["y"], q["z"]]))
        np.testing.assert_allclose(along, force / np.linalg.norm(force), atol=1e-9)


def rotated_x(w: float, v: np.ndarray) -> np.ndarray:
    """The x axis, rotated by a unit quaternion."""
    x = np.array([1.0, 0.0, 0.0])
    return x + 2 * w * np.cross(v, x) + 2 * np.cross(v, np.cross(v, x))


@pytest.mark.slow
def test_arrows_keep_the_published_schema(outputs: dict[str, list[Any]]) -> None:
    """Every field by the definition of `foxglove.SceneUpdate` in its package for Protobuf."""
    pytest.importorskip(
        "foxglove_schemas_protobuf", reason="NOT TESTED: needs foxglove-schemas-protobuf"
    )
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
    from google.protobuf.json_format import ParseDict

    for made in outputs["force_arrows"]:
        text = re.sub(
            r'"(timestamp|lifetime)": \{"sec": (\d+), "nsec": (\d+)\}',
            lambda m: f'"{m[1]}": "{"1970-01-01T00:00:00Z" if m[1][0] == "t" else "0s"}"',
            json.dumps(made),
        )
        read = ParseDict(json.loads(text), SceneUpdate())
        assert [entity.frame_id for entity in read.entities] == ["gelslim_sensor"]
