"""`gelslim force` as a user runs it."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Iterator
from itertools import count, islice
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from sensor_samples import NORMAL_N, SHEAR_N, frame, press, sensor_bundle, stream

from gelslim.cli.force_run import until_interrupted
from gelslim.cli.main import main
from gelslim.ending import Terminated
from gelslim_force.frames.frame import Frame
from gelslim_force.frames.opencv_frames import LiveCamera
from gelslim_force.outputs.canvas import encoded
from gelslim_force.outputs.recorded_run import read_run
from ifem_export.bundle.files import write_bundle


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("sensor with spaces é")
    write_bundle(place / "bundle", sensor_bundle())
    (place / "reference.png").write_bytes(encoded(frame(0.0).image, ".png"))
    (place / "frames").mkdir()
    for k, seen in enumerate(stream(5)):
        (place / "frames" / f"f{k}.png").write_bytes(encoded(seen.image, ".png"))
    return place


def run(sensor: Path, *more: str, frames: str = "frames") -> int:
    given = [str(sensor / "bundle"), str(sensor / frames), "-r", str(sensor / "reference.png")]
    return main(["force", *given, *more])


def test_run_folder_and_answer(sensor: Path, tmp_path: Path, capsys) -> None:
    assert run(sensor, "-o", str(tmp_path / "run"), "--pictures", "2", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["frames"] == answer["frames_with_forces"] == 5
    frames = {"linear": 5, "neo_hookean": 0, "deep_linear": 0}
    gel = {"asked": "auto", "law": "auto", "fallback": None, "frames": frames}
    assert answer["gel"] == gel
    settings = read_run(tmp_path / "run").manifest["settings"]
    assert (settings["gel_law"], settings["gel_fallback"]) == ("auto", None)
    assert len(answer["pictures"]) == 2
    assert all(Path(p).stat().st_size > 10_000 for p in answer["pictures"])
    recorded = read_run(tmp_path / "run")
    assert recorded.complete
    last = list(recorded.results())[-1]
    off = np.abs(last.wrench.force_n[:2] - SHEAR_N)
    assert (off < 3 * last.wrench.standard_deviation[:2]).all()
    assert np.isnan(last.wrench.force_n[2])


@pytest.mark.slow
def test_the_drift_that_is_allowed_can_be_chosen(sensor: Path, tmp_path: Path, capsys) -> None:
    """A picture that is shifted by one pixel, of the untouched gel."""
    (sensor / "shifted").mkdir()
    shifted = np.roll(frame(0.0).image, 1, axis=1)
    (sensor / "shifted" / "f0.png").write_bytes(encoded(shifted, ".png"))
    none = ("--pictures", "0", "--json")
    assert run(sensor, "-o", str(tmp_path / "a"), *none, frames="shifted") == 2
    sizes = []
    for name, more in {"b": (), "c": ("--drift", "count")}.items():
        given = (*none, "--drift-px", "1.5", *more)
        assert run(sensor, "-o", str(tmp_path / name), *given, frames="shifted") == 0
        (result,) = read_run(tmp_path / name).results()
        force_n = result.wrench.force_n[:2]
        assert (np.abs(force_n) < 3 * result.wrench.standard_deviation[:2]).all()
        sizes.append(np.hypot(*force_n))
    assert sizes[0] < 0.01
    assert sizes[1] > 0.1


def test_an_unknown_word_for_the_drift_is_refused(sensor: Path, tmp_path: Path, capsys) -> None:
    assert run(sensor, "-o", str(tmp_path / "run"), "--drift", "never") == 2
    assert "--drift never" in capsys.readouterr().err


def test_depth_maps_give_the_normal_force(sensor: Path, tmp_path: Path, capsys) -> None:
    from scipy.interpolate import griddata

    from gelslim_optics.camera.virtual_camera import VirtualCamera

    bundle = sensor_bundle()
    camera = VirtualCamera.from_record(bundle.camera)
    nodes = np.asarray(bundle.mesh.surface_mm)
    rows, columns = np.mgrid[:480, :640]
    maps = []
    for share in np.linspace(0, 1, 5):
        w = share * press().nodes_mm[:, 2]
        places = camera.project(nodes + np.column_stack([0 * w, 0 * w, w]))
        seen = griddata(places, w, (columns, rows), method="linear")
        maps.append(seen.astype(np.float32))
    np.save(tmp_path / "maps.npy", np.stack(maps))
    given = ("-o", str(tmp_path / "run"), "--pictures", "0", "--json", "--gel", "linear")
    assert run(sensor, *given, "--depth-maps", str(tmp_path / "maps.npy")) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["last_wrench"][:3] == pytest.approx([*SHEAR_N, -NORMAL_N], abs=0.05)


@pytest.mark.slow
def test_moving_markers_without_a_patch_leave_the_normal_force_unknown(
    sensor: Path, tmp_path: Path, capsys
) -> None:
    """These frames are not shaded, so no patch can be seen while the markers move."""
    given = ("-o", str(tmp_path / "run"), "--pictures", "0", "--json")
    assert run(sensor, *given, "--indenter", "sphere:10") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["last_wrench"][2] is None
    assert answer["last_wrench"][0] == pytest.approx(SHEAR_N[0], abs=0.3)
    assert answer["problems"]


@pytest.mark.slow
def test_video_and_recording(sensor: Path, tmp_path: Path, capsys) -> None:
    pytest.importorskip("cv2")
    pytest.importorskip("mcap")
    given = ("-o", str(tmp_path / "run"), "--video", str(tmp_path / "v.mp4"))
    assert run(sensor, *given, "--mcap", str(tmp_path / "r.mcap"), "--pictures", "0") == 0
    assert (tmp_path / "v.mp4").stat().st_size > 1000
    with open(tmp_path / "r.mcap", "rb") as stream:
        (about,) = pytest.importorskip("mcap.reader").make_reader(stream).iter_metadata()
    assert about.metadata["gel_law"] == about.metadata["gel_asked"] == "auto"
    recorded = read_run(tmp_path / "run")
    assert len(recorded.wrenches["index"]) == 5


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--method", "magic"), "magic"),
        (("--operator", "spline"), "spline"),
        (("--error", "1%"), "ladder"),
        (("--indenter", "cube:3"), "cube"),
        (("--fields", "xml"), "xml"),
        (("--video", "a.txt"), "a.txt"),
        (("--indenter", "sphere:3", "--depth-maps", "m.npy"), "--depth-maps"),
        (("--latest",), "camera"),
        (("--all-frames",), "camera"),
    ],
)
def test_bad_options_are_refused(sensor, tmp_path, capsys, more, words) -> None:
    assert run(sensor, "-o", str(tmp_path / "run"), *more) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("choice", ["--latest", "--all-frames"])
def test_a_camera_gives_stamped_frames_until_the_number_wanted(
    sensor: Path, tmp_path: Path, capsys, monkeypatch, choice
) -> None:
    """Its system clock counts the pictures, so that the stamps tell which were processed."""
    pytest.importorskip("cv2")
    made: list[LiveCamera] = []

    def camera(device: int, frames_per_s: None) -> LiveCamera:
        clock = map(float, count(1_800_000_000))
        made.append(
            LiveCamera(device, None, lambda _: Still(frame(0.0).image), system_clock=clock.__next__)
        )
        return made[0]

    monkeypatch.setattr("gelslim_force.frames.source.LiveCamera", camera)
    options = ["-r", str(sensor / "reference.png"), "-o", str(tmp_path / "run"), "--pictures", "0"]
    given = [str(sensor / "bundle"), "camera:3", *options, "--frames", "3", choice, "--json"]
    assert main(["force", *given]) == 0
    answer = json.loads(capsys.readouterr().out)
    stamps = read_run(tmp_path / "run").wrenches["stamp_s"] - 1.8e9
    assert (made[0].device, answer["frames"], len(stamps)) == (3, 3, 3)
    if choice == "--all-frames":
        assert stamps.tolist() == [0, 1, 2]
        assert answer["frames_dropped"] == 0
    else:
        assert (np.diff(stamps) >= 1).all()
        assert answer["frames_dropped"] >= stamps[-1] - 2


def interrupted(at: int, by: signal.Signals) -> Iterator[Frame]:
    """Frames of a camera; the signal arrives while frame `at` is waited for."""
    for k in range(at + 9):
        if k == at:
            signal.raise_signal(by)
        yield Frame(k, float(k), None)


def test_ctrl_c_ends_the_frames_of_a_camera() -> None:
    """In the wait for a frame at once; in the work on one, after that work."""
    assert [f.index for f in until_interrupted(interrupted(3, signal.SIGINT))] == [0, 1, 2]
    done = []
    for seen in until_interrupted(interrupted(9, signal.SIGINT)):
        if seen.index == 1:
            signal.raise_signal(signal.SIGINT)
        done.append(seen.index)
    assert done == [0, 1]
    assert [f.index for f in until_interrupted(islice(interrupted(9, signal.SIGINT), 2))] == [0, 1]


def test_termination_and_errors_are_passed_on() -> None:
    def terminate(number: int, place: object) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, terminate)
    try:
        with pytest.raises(Terminated):
            list(until_interrupted(interrupted(2, signal.SIGTERM)))
        assert signal.getsignal(signal.SIGTERM) is terminate
    finally:
        signal.signal(signal.SIGTERM, before)


class Still:
    """A camera that always gives the same picture."""

    def __init__(self, image: np.ndarray) -> None:
        self.image = image if image.ndim == 2 else image[:, :, ::-1]

    def isOpened(self) -> bool:
        return True

    def grab(self) -> bool:
        return True

    def retrieve(self) -> tuple[bool, np.ndarray]:
        return True, self.image

    def get(self, prop: int) -> float:
        return 0.0

    def release(self) -> None:
        self.image = self.image[:0]


def test_missing_reference_and_wrong_frames(sensor: Path, tmp_path: Path, capsys) -> None:
    assert main(["force", str(sensor / "bundle"), str(sensor / "frames")]) == 2
    assert "--reference" in capsys.readouterr().err
    (sensor / "small").mkdir(exist_ok=True)
    small = np.full((240, 320, 3), 120, np.uint8)
    (sensor / "small" / "a.png").write_bytes(encoded(small, ".png"))
    assert run(sensor, "-o", str(tmp_path / "run"), frames="small") == 2
    assert "320 x 240 px" in read_run(tmp_path / "run").wrenches.problems[0]


@pytest.mark.slow
def test_an_earlier_run_is_kept_unless_told(sensor: Path, tmp_path: Path, capsys) -> None:
    given = ("-o", str(tmp_path / "run"), "--pictures", "0", "--frames", "1")
    assert run(sensor, *given) == 0
    before = (tmp_path / "run" / "wrenches.csv").read_bytes()
    assert run(sensor, *given) == 2
    assert str(tmp_path / "run") in capsys.readouterr().err
    assert (tmp_path / "run" / "wrenches.csv").read_bytes() == before
    assert run(sensor, *given, "--force") == 0
