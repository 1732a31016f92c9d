"""OpenCV's reader of videos and cameras, loaded when needed and kept quiet."""

from __future__ import annotations

import os
from typing import Any, Protocol

from gelslim_force.frames.frame import with_vision


class Capture(Protocol):
    """What is used of `cv2.VideoCapture`."""

    def isOpened(self) -> bool:
        """Whether it can be read."""

    def read(self) -> tuple[bool, Any]:
        """Success, and the picture (h, w, 3) in the order blue, green, red."""

    def get(self, prop: int) -> float:
        """A property; 0 where not known."""

    def set(self, prop: int, value: float) -> bool:
        """Set a property; false where it cannot be."""

    def release(self) -> None:
        """Close."""


POS_MSEC, FRAME_WIDTH, FRAME_HEIGHT, FPS, FRAME_COUNT = 0, 3, 4, 5, 7
"""OpenCV's numbers of properties."""


def open_capture(what: str | int) -> Capture:
    """Return the reader of a video file or a camera by number; it may not be open.

    Raises FrameSourceError without OpenCV.
    """
    # FFmpeg writes its complaints on broken files past Python; they are reported as problems.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    try:
        import cv2
    except ImportError as error:
        raise with_vision("reading videos and cameras", error) from error
    capture: Capture = cv2.VideoCapture(what)
    return capture
