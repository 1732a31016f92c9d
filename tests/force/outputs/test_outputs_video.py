"""Videos read back: as many frames as were given, in their colours and order."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gelslim_core.errors import OutputError
from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.outputs.overlay_video import OverlayVideo

cv2 = pytest.importorskip("cv2")
COLOURS = [(200, 40, 30), (40, 190, 60), (30, 60, 210), (220, 210, 40)]


def pictures(shape: tuple[int, int]) -> list[np.ndarray]:
    return [np.full((*shape, 3), colour, dtype=np.uint8) for colour in COLOURS]


@pytest.mark.parametrize("ending", [".mp4", ".avi"])
@pytest.mark.parametrize("shape", [(96, 128), (97, 131)])
def test_frames_come_back(tmp_path: Path, ending: str, shape: tuple[int, int]) -> None:
    path = tmp_path / f"ein Video ü{ending}"
    with OverlayVideo(path, shape, 25.0) as video:
        for picture in pictures(shape):
            video.append(picture)
        assert not path.exists(), "in place only when it is whole"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    capture = cv2.VideoCapture(str(path))
    assert capture.get(cv2.CAP_PROP_FPS) == pytest.approx(25.0)
    for colour in COLOURS:
        fine, frame = capture.read()
        assert fine
        assert frame.shape == (shape[0] + shape[0] % 2, shape[1] + shape[1] % 2, 3)
        np.testing.assert_allclose(frame[40:60, 40:60, ::-1].mean(axis=(0, 1)), colour, atol=12)
    assert not capture.read()[0]
    capture.release()


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"a\.gif"):
        OverlayVideo(tmp_path / "a.gif", (96, 128), 25.0)
    with pytest.raises(OutputError, match=r"0.1 ... 1000"):
        OverlayVideo(tmp_path / "a.mp4", (96, 128), float("nan"))
    (tmp_path / "file").write_text("x")
    with pytest.raises(OutputError, match=r"a\.mp4"):
        OverlayVideo(tmp_path / "file" / "a.mp4", (96, 128), 25.0)
    video = OverlayVideo(tmp_path / "a.mp4", (96, 128), 25.0)
    with pytest.raises(OutputError, match="128, 96, 3"):
        video.append(np.zeros((128, 96, 3), np.uint8))
    video.finish()
    video.finish()
    with pytest.raises(OutputError, match=r"a\.mp4"):
        video.append(np.zeros((96, 128, 3), np.uint8))
    assert [p.name for p in tmp_path.iterdir()] == ["file"], "an empty video is dropped"


def test_an_error_in_the_block_keeps_the_frames_so_far(tmp_path: Path) -> None:
    def stream() -> None:
        with OverlayVideo(tmp_path / "a.avi", (96, 128), 25.0) as video:
            video.append(pictures((96, 128))[0])
            raise RuntimeError("camera unplugged")

    with pytest.raises(RuntimeError, match="unplugged"):
        stream()
    assert int(cv2.VideoCapture(str(tmp_path / "a.avi")).get(cv2.CAP_PROP_FRAME_COUNT)) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file size are POSIX")
def test_a_full_disk_is_noticed(tmp_path: Path) -> None:
    """OpenCV says nothing when it cannot write; counting the frames does."""
    code = f"""
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
import numpy as np
from gelslim_core.errors import OutputError
from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.outputs.overlay_video import OverlayVideo
resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
noise = np.random.default_rng(0).integers(0, 255, (40, 240, 320, 3)).astype(np.uint8)
try:
    with OverlayVideo({str(tmp_path / "a.avi")!r}, (240, 320), 25.0) as video:
        for picture in noise:
            video.append(picture)
except OutputError as error:
    print(error)
"""
    end = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert end.returncode == 0, end.stderr
    assert "of 40 frames can be read back; is the disk full?" in end.stdout
    assert not (tmp_path / "a.avi").exists()


def test_without_opencv_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingLibraryError) as refused:
        OverlayVideo(tmp_path / "a.mp4", (96, 128), 25.0)
    assert (refused.value.name, refused.value.extra) == ("cv2", "vision")
