"""A video file as frames; what cannot be decoded is flagged, and where the file breaks off."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from gelslim_force.frames.frame import Frame, FrameSourceError, SourceContext
from gelslim_force.frames.opencv_capture import FPS, FRAME_COUNT, Capture, open_capture

VIDEO_ENDINGS = (
    ".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".mjpg", ".mjpeg", ".wmv",
)  # fmt: skip
_TRIES = 10
"""Reads that fail in a row before the file is taken to have broken off."""
_MOST_FRAMES = 10**8


class VideoFile(SourceContext):
    """Frames of a video, in colour. Iterating again reads it from its beginning."""

    live = False

    def __init__(
        self,
        path: str | os.PathLike[str],
        frames_per_s: float | None = None,
        capture: Callable[[str], Capture] = open_capture,
    ) -> None:
        """`frames_per_s` overrides the file's own rate.

        Raises FrameSourceError where not one frame can be read.
        """
        self.path, self._open = Path(path), capture
        if not self.path.is_file():
            raise FrameSourceError(f"{self.path}: no such file")
        reader = self._open(str(self.path))
        try:
            if not reader.isOpened() or not any(reader.read()[0] for _ in range(_TRIES)):
                raise FrameSourceError(
                    f"{self.path}: no frame can be read; the video is damaged (an .mp4 cut short "
                    "lacks its index), empty, or of a codec that OpenCV lacks"
                )
            rate, count = reader.get(FPS), reader.get(FRAME_COUNT)
        finally:
            reader.release()
        known = math.isfinite(rate) and 0.01 <= rate <= 1e5
        self.frames_per_s = frames_per_s or (float(rate) if known else None)
        self.count = int(count) if 1 <= count <= _MOST_FRAMES else None

    def __iter__(self) -> Iterator[Frame]:
        """Yield every frame; one that cannot be decoded is flagged and counts."""
        reader = self._open(str(self.path))
        try:
            yield from self._frames(reader)
        finally:
            reader.release()

    def _frames(self, reader: Capture) -> Iterator[Frame]:
        index = failed = 0
        while failed < _TRIES:
            good, image = reader.read()
            if not good or image is None:
                failed += 1
                # Past the end of a whole video there is nothing more to try.
                if self.count is None or index + failed > self.count:
                    break
                continue
            for gap in range(failed):
                yield self._frame(index + gap, None, "cannot be decoded")
            index, failed = index + failed, 0
            yield self._frame(index, np.ascontiguousarray(image[:, :, ::-1]), "")
            index += 1
        # The count of some containers is an estimate: one frame short is no breach.
        if self.count is not None and index < self.count - 1:
            text = f"the video breaks off after {index} of {self.count} frames"
            yield self._frame(index, None, text)

    def _frame(self, index: int, image: np.ndarray | None, problem: str) -> Frame:
        text = f"{self.path.name}: frame {index}: {problem}" if problem else ""
        return Frame(index, index / (self.frames_per_s or 1.0), image, text)
