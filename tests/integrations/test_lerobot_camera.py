"""The camera for LeRobot: without it by stand-ins, and with it as its own tools use cameras."""

from __future__ import annotations

import importlib
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import lerobot_stand_in as stand_in
import numpy as np
import output_samples as samples
import pytest

from gelslim_force.frames.frame import Frame, FrameSource
from gelslim_force.frames.frame_array import FrameArray

FRAMES = [samples.frame(1), samples.frame(2, normal_known=False), samples.unreadable(3, "dark")]
HEIGHT, WIDTH = 6, 8
PICTURES = np.random.default_rng(3).integers(0, 256, (4, HEIGHT, WIDTH, 3), dtype=np.uint8)


class Pipeline:
    """Gives the frames above in turn."""

    def __init__(self, portrait: bool = False) -> None:
        size = (WIDTH, HEIGHT) if portrait else (HEIGHT, WIDTH)
        camera = SimpleNamespace(image_height_px=size[0], image_width_px=size[1])
        reference = SimpleNamespace(positions_px=samples.MARKERS_MM)
        self.calibration = SimpleNamespace(camera=camera, reference=reference)
        self.points_mm = samples.NODES_MM
        self.seen: list[np.ndarray] = []
        self.rests: list[np.ndarray] = []

    def prepare(self) -> None:
        assert not self.seen

    def process(self, frame: Frame) -> Any:
        self.seen.append(frame.image)
        return FRAMES[(len(self.seen) - 1) % len(FRAMES)]

    def tare(self, image: np.ndarray) -> str:
        self.rests.append(image)
        return "rest"


class LiveSource(FrameSource):
    """A camera whose frames come when the test wants."""

    live = True

    def __init__(self) -> None:
        self._ready, self._waiting = threading.Semaphore(0), list[Frame | None]()
        self._seen = threading.Semaphore(0)

    def give(self, image: np.ndarray | None) -> None:
        self._waiting.append(
            Frame(len(self._waiting), 0.0, image, "" if image is not None else "?")
        )
        self._ready.release()

    def end(self) -> None:
        self._waiting.append(None)
        self._ready.release()

    def wait_until_asked(self) -> None:
        """Wait until the reader has done with what was given and asks for more."""
        assert self._seen.acquire(timeout=10)

    def __iter__(self) -> Iterator[Frame]:
        while True:
            self._seen.release()
            assert self._ready.acquire(timeout=10)
            frame = self._waiting.pop(0)
            if frame is None:
                return
            yield frame

    def close(self) -> None:
        self.end()


@pytest.fixture
def plugin(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The plugin with stand-ins for LeRobot."""
    stand_in.install(monkeypatch)
    return importlib.import_module(stand_in.PLUGIN)


@pytest.fixture
def stream(plugin: Any) -> Any:
    return importlib.import_module(f"{stand_in.PLUGIN}.sensor_stream")


@pytest.fixture
def camera(plugin: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """A camera over a recording of four pictures."""
    np.save(tmp_path / "frames.npy", PICTURES)
    pipeline, opened = Pipeline(), {}

    def open_sensor(bundle: str, **options: Any) -> Pipeline:
        opened.update(options, bundle=bundle)
        return pipeline

    config_module = importlib.import_module(f"{stand_in.PLUGIN}.config_gelslim")
    monkeypatch.setattr(config_module, "read_calibration", lambda path: pipeline.calibration)
    monkeypatch.setattr(
        importlib.import_module(f"{stand_in.PLUGIN}.camera"), "open_sensor", open_sensor
    )
    config = plugin.GelslimCameraConfig(
        bundle="b", calibration="c.json", source=str(tmp_path / "frames.npy"), fps=10, grid=(4, 5)
    )
    made = plugin.GelslimCamera(config)
    made.pipeline, made.opened = pipeline, opened
    return made


def test_a_camera_gives_its_newest_picture_once(stream: Any) -> None:
    source = LiveSource()
    sensor = stream.SensorStream(Pipeline(), source)
    source.wait_until_asked()
    with pytest.raises(stream.NoPictureError):
        sensor.latest(10.0)
    for picture in PICTURES[:2]:
        source.give(picture)
        source.wait_until_asked()
    np.testing.assert_array_equal(sensor.latest(10.0).picture, PICTURES[1])
    np.testing.assert_array_equal(sensor.latest(10.0).picture, PICTURES[1])
    with pytest.raises(TimeoutError):
        sensor.next(0.01)
    source.give(None)
    source.give(PICTURES[2])
    reading = sensor.next(10.0)
    np.testing.assert_array_equal(reading.picture, PICTURES[2])
    assert reading.result is FRAMES[2]
    with pytest.raises(stream.NoPictureError):
        sensor.latest(-1.0)
    source.wait_until_asked()
    sensor.close()


def test_a_camera_that_stops_is_told(stream: Any) -> None:
    source = LiveSource()
    sensor = stream.SensorStream(Pipeline(), source)
    source.end()
    with pytest.raises(stream.NoPictureError, match="stopped"):
        sensor.next(10.0)
    sensor.close()


def test_pictures_are_upright_and_in_colour_and_rests_are_not(stream: Any) -> None:
    grey = PICTURES[:1, :, :, 0]
    pipeline = Pipeline(portrait=True)
    sensor = stream.SensorStream(pipeline, FrameArray(grey, None, 10.0))
    reading = sensor.next(0.0)
    assert reading.picture.shape == (WIDTH, HEIGHT, 3)
    np.testing.assert_array_equal(reading.picture[..., 1], np.rot90(grey[0], -1))
    sensor.tare(reading)
    assert pipeline.rests[0].ndim == 2


def test_a_recording_gives_every_picture_with_its_forces(camera: Any, stream: Any) -> None:
    reads = (camera.read, camera.async_read, camera.read_latest, camera.async_read)
    camera.connect()
    assert camera.is_connected
    assert (camera.width, camera.height, camera.fps) == (WIDTH, HEIGHT, 10)
    for number, read in enumerate(reads):
        np.testing.assert_array_equal(read(), PICTURES[number])
        result = FRAMES[number % len(FRAMES)]
        assert camera.reading.result is result
        assert camera.observation()["known"][0] == (result.wrench is not None)
    with pytest.raises(TimeoutError) as ended:
        camera.read()
    assert isinstance(ended.value, stream.RecordingEndedError)
    assert camera.tare() == "rest"
    camera.disconnect()
    assert not camera.is_connected
    assert camera.opened == {
        "bundle": "b", "calibration": "c.json", "indenter": None, "gel_calibration": None,
        "light_calibration": None,
    }  # fmt: skip


def test_reading_needs_a_connection(camera: Any) -> None:
    for call in (camera.read, camera.async_read, camera.read_latest, camera.observation,
                 camera.disconnect, lambda: camera.features):  # fmt: skip
        with pytest.raises(stand_in.DeviceNotConnectedError):
            call()
    with camera, pytest.raises(stand_in.DeviceAlreadyConnectedError):
        camera.connect()


def test_another_size_of_pictures_is_refused(plugin: Any, camera: Any) -> None:
    with pytest.raises(ValueError, match="8 x 6"):
        plugin.GelslimCameraConfig(bundle="b", calibration="c", width=4)


def test_the_step_adds_the_forces_of_the_picture_in_the_observation(
    plugin: Any, camera: Any
) -> None:
    other = SimpleNamespace()
    step = plugin.GelslimForcesStep(
        {"finger": camera, "wrist": other}, features=("wrench", "known")
    )
    camera.connect()
    observed = {"arm.pos": 0.5, "finger": camera.async_read(), "wrist": PICTURES[1]}
    found = step.observation(observed)
    assert {k: found[k] for k in observed} == observed
    assert found["finger.fz_n"] == pytest.approx(FRAMES[0].wrench.force_n[2], rel=1e-6)
    kind = stand_in.PipelineFeatureType.OBSERVATION
    told = step.transform_features({kind: {"arm.pos": float}})[kind]
    assert set(told) == {"arm.pos", *(n for n in found if n.startswith("finger."))}
    assert json.dumps(step.get_config())
    with pytest.raises(ValueError, match="marker_motion_px"):
        plugin.GelslimForcesStep({}, features=("marker_motion_px",))


def test_lerobot_finds_plugin_by_the_names_of_its_files(plugin: Any) -> None:
    """`make_device_from_device_class` looks for the camera by the name of its configuration."""
    config = plugin.GelslimCameraConfig
    assert config.__name__ == plugin.GelslimCamera.__name__ + "Config"
    assert config.__module__.rpartition(".")[0] == stand_in.PLUGIN
    assert stand_in.CameraConfig.kinds["gelslim"] is config
