"""Videos and cameras as frames, through OpenCV, which is imported when it is needed."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gelslim_core import optional_library
from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError, size_problem

VIDEO_ENDINGS = (
    ".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".mjpg", ".mjpeg", ".wmv",
)  # fmt: skip
_VIDEO_ATTEMPTS = 10
"""Failed reads in succession after which a video is taken to be incomplete."""
_MAX_FRAMES = 10**8
_CAMERA_ATTEMPTS = 30
"""Failed reads in succession after which a camera is taken to be disconnected."""
_POSITION_MS, _FPS, _FRAME_COUNT = 0, 5, 7
"""OpenCV's numbers of these properties."""


class Capture(Protocol):
    """The part of `cv2.VideoCapture` that is used here."""

    def isOpened(self) -> bool:
        """Return whether frames can be read."""

    def read(self) -> tuple[bool, Any]:
        """Return success and the picture (h, w, 3) in the order blue, green, red."""

    def grab(self) -> bool:
        """Wait for the next picture without decoding it; return success."""

    def retrieve(self) -> tuple[bool, Any]:
        """Decode the picture that was grabbed; return as `read` does."""

    def get(self, prop: int) -> float:
        """Return a property; 0 if it is not known."""

    def set(self, prop: int, value: float) -> bool:
        """Set a property and return whether that is possible."""

    def release(self) -> None:
        """Close."""


def open_capture(source: str | int) -> Capture:
    """Return the reader of a video file, or of a camera by its number; it may not be open.

    Raises MissingLibraryError without OpenCV.
    """
    # FFmpeg prints its messages on damaged files itself; they are reported as problems.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    cv = optional_library.load("cv2", "reading videos and cameras")
    capture: Capture = cv.VideoCapture(source)
    return capture


def _known_rate(frames_per_s: float) -> float | None:
    known = math.isfinite(frames_per_s) and 0.01 <= frames_per_s <= 1e5
    return float(frames_per_s) if known else None


def _sensor_time_s(capture: Capture) -> float | None:
    """Time of the grabbed picture by the clock of the camera's driver; None if it has none."""
    milliseconds = capture.get(_POSITION_MS)
    return milliseconds / 1000 if math.isfinite(milliseconds) and milliseconds > 0 else None


class VideoFile(FrameSource):
    """Frames of a video, in colour. A second iteration starts at the beginning again."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        frames_per_s: float | None = None,
        capture: Callable[[str], Capture] = open_capture,
    ) -> None:
        """Open a video; `frames_per_s` overrides the rate that the file states.

        Raises FrameSourceError if no frame can be read.
        """
        self.path, self._open = Path(path), capture
        if not self.path.is_file():
            raise FrameSourceError(f"{self.path}: no such file")
        reader = self._open(str(self.path))
        try:
            if not reader.isOpened() or not any(reader.read()[0] for _ in range(_VIDEO_ATTEMPTS)):
                raise FrameSourceError(
                    f"{self.path}: no frame can be read; the video is damaged (an incomplete .mp4 "
                    "has no index), empty, or of a codec that OpenCV does not have"
                )
            rate, count = reader.get(_FPS), reader.get(_FRAME_COUNT)
        finally:
            reader.release()
        self.frames_per_s = frames_per_s or _known_rate(rate)
        self.count = int(count) if 1 <= count <= _MAX_FRAMES else None

    def __iter__(self) -> Iterator[Frame]:
        """Yield every frame; one that cannot be decoded has a problem instead of a picture."""
        reader = self._open(str(self.path))
        try:
            yield from self._frames(reader)
        finally:
            reader.release()

    def _frames(self, reader: Capture) -> Iterator[Frame]:
        index = failed = 0
        while failed < _VIDEO_ATTEMPTS:
            good, image = reader.read()
            if not good or image is None:
                failed += 1
                # After the last frame of a complete video there is nothing more to read.
                if self.count is None or index + failed > self.count:
                    break
                continue
            for gap in range(failed):
                yield self._frame(index + gap, None, "cannot be decoded")
            index, failed = index + failed, 0
            yield self._frame(index, np.ascontiguousarray(image[:, :, ::-1]), "")
            index += 1
        # Some containers only estimate the count: one frame less is no fault.
        if self.count is not None and index < self.count - 1:
            text = f"the video ends after {index} of {self.count} frames"
            yield self._frame(index, None, text)

    def _frame(self, index: int, image: np.ndarray | None, problem: str) -> Frame:
        text = f"{self.path.name}: frame {index}: {problem}" if problem else ""
        return Frame(index, index / (self.frames_per_s or 1.0), image, text)


class LiveCamera(FrameSource):
    """Frames of a camera until `close`, or until the camera gives no more frames.

    Read it through `ThreadedReader`, which drops frames that arrive during the work on another.
    """

    live = True

    def __init__(
        self,
        device: int | str = 0,
        frames_per_s: float | None = None,
        capture: Callable[[int | str], Capture] = open_capture,
        clock: Callable[[], float] = time.monotonic,
        system_clock: Callable[[], float] = time.time,
    ) -> None:
        """Open a camera and request a rate.

        `device` is a number, a file such as /dev/video0 or the address of a stream. `clock` gives
        the times of the frames, `system_clock` their stamps in seconds since 1970.
        Raises FrameSourceError if the camera does not open.
        """
        self.device, self._clock, self._system_clock = device, clock, system_clock
        self._capture = capture(device)
        if not self._capture.isOpened():
            self._capture.release()
            raise FrameSourceError(
                f"camera {device}: does not open; is it plugged in, and free of other programs?"
            )
        if frames_per_s is not None:
            self._capture.set(_FPS, frames_per_s)
        self.frames_per_s = _known_rate(self._capture.get(_FPS)) or frames_per_s
        self._shape: tuple[int, ...] | None = None
        self._closed = self._reading = False

    def __iter__(self) -> Iterator[Frame]:
        """Yield frames with the time since the first; a read that fails gives a problem.

        Each has the system's time at which it was grabbed and, if the driver tells it, the time by
        the driver's clock (Video4Linux: that of the kernel's buffer).
        """
        self._reading = True
        try:
            yield from self._frames()
        finally:
            self._capture.release()

    def _frames(self) -> Iterator[Frame]:
        index = failed = 0
        start = self._clock()
        while not self._closed and failed < _CAMERA_ATTEMPTS:
            good = self._capture.grab()
            # Decoding comes after the clocks are read, so that its time is not in the stamps.
            time_s, stamp_s = self._clock() - start, self._system_clock()
            sensor_s = _sensor_time_s(self._capture) if good else None
            if index == 0:
                start, time_s = start + time_s, 0.0
            good, image = self._capture.retrieve() if good else (False, None)
            problem = "the camera gave no picture"
            if good and image is not None:
                image = np.ascontiguousarray(image[:, :, ::-1] if image.ndim == 3 else image)
                self._shape = self._shape or image.shape
                problem = size_problem(image, self._shape)
            failed = failed + 1 if not good else 0
            if failed == _CAMERA_ATTEMPTS:
                problem = f"the camera gave no picture {_CAMERA_ATTEMPTS} times in succession"
            if not self._closed:
                seen = None if problem else image
                yield Frame(index, time_s, seen, problem, stamp_s=stamp_s, sensor_s=sensor_s)
            index += 1

    def close(self) -> None:
        """End the frames and release the camera; during a read, it is released after the read."""
        # OpenCV crashes if a capture is released while another thread reads from it.
        self._closed = True
        if not self._reading:
            self._capture.release()
