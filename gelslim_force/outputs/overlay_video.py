"""Overlay pictures as a video, `.mp4` (MPEG-4) or `.avi` (Motion JPEG), through OpenCV."""

from __future__ import annotations

import math
import os
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_core.files.file_lock import beside
from gelslim_force.outputs.canvas import Image

_CODECS = {".mp4": "mp4v", ".avi": "MJPG"}


class OverlayVideo(AbstractContextManager["OverlayVideo"]):
    """Takes pictures of one size; `finish` checks the video and gives it its name.

    Until then its name is `.NAME.part.mp4` in the same folder. A killed process leaves this file:
    most players show the frames of an incomplete `.avi`, but not of an incomplete `.mp4`.
    """

    def __init__(
        self, path: str | os.PathLike[str], size_px: tuple[int, int], frames_per_s: float
    ) -> None:
        """Start a video.

        Args:
            path: The video; its name ends in .mp4 or .avi.
            size_px: (h, w) of the pictures, such as `Overlay.size_px`. An odd side is padded by
                one pixel.
            frames_per_s: Rate, 0.1 ... 1000.

        Raises:
            OutputError: Another suffix, a rate out of range or a folder that cannot be written.
            MissingLibraryError: OpenCV is not installed.
        """
        self.path = Path(path)
        self._cv: Any = optional_library.load("cv2", "writing videos")
        codec = _CODECS.get(self.path.suffix.lower())
        if codec is None:
            raise OutputError(f"{self.path}: a video must end in .mp4 or .avi")
        if not (math.isfinite(frames_per_s) and 0.1 <= frames_per_s <= 1000):
            raise OutputError(f"{frames_per_s!r} frames per second: must be in 0.1 ... 1000")
        self._size = size_px
        self._padded = (size_px[0] + size_px[0] % 2, size_px[1] + size_px[1] % 2)
        self._part = beside(self.path.with_suffix(""), f".part{self.path.suffix.lower()}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._part.write_bytes(b"")
        except OSError as error:
            raise disk_error(self.path, "starting the video", error) from error
        height, width = self._padded
        four = self._cv.VideoWriter_fourcc(*codec)
        self._writer = self._cv.VideoWriter(str(self._part), four, frames_per_s, (width, height))
        self.frames = 0
        self._open = True
        if not self._writer.isOpened():
            self._discard()
            raise OutputError(
                f"{self.path}: this OpenCV cannot write {codec} of {width} x {height} px; "
                "try the other ending (.avi or .mp4)"
            )

    def append(self, picture: Image) -> None:
        """Add an RGB picture. Raises OutputError for another size, or after `finish`."""
        if not self._open:
            raise OutputError(f"{self.path}: the video is already finished")
        if picture.shape != (*self._size, 3) or picture.dtype != np.uint8:
            raise OutputError(
                f"{self.path}: a picture {picture.shape} of {picture.dtype} in a video of "
                f"{(*self._size, 3)} uint8; all must have the same size"
            )
        height, width = self._padded
        if self._padded != self._size:
            more = ((0, height - self._size[0]), (0, width - self._size[1]), (0, 0))
            picture = np.pad(picture, more, mode="edge")
        self._writer.write(np.ascontiguousarray(picture[:, :, ::-1]))
        self.frames += 1

    def finish(self) -> None:
        """Close the video, count the frames that can be read back, and give it its name.

        A video without frames is deleted. Raises OutputError if frames are missing, for example
        because the disk is full; the file keeps its provisional name then.
        """
        if not self._open:
            return
        self._open = False
        self._writer.release()
        if not self.frames:
            self._part.unlink(missing_ok=True)
            return
        found = self._readable()
        if found != self.frames:
            raise OutputError(
                f"{self.path}: only {max(found, 0)} of {self.frames} frames can be read back; is "
                f"the disk full? The incomplete video is {self._part.name}"
            )
        try:
            os.replace(self._part, self.path)
        except OSError as error:
            raise disk_error(self.path, "putting the video in place", error) from error

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the video; after an error in the block it has the frames up to that error."""
        with nullcontext() if kind is None else suppress(OutputError):
            self.finish()

    def _readable(self) -> int:
        capture = self._cv.VideoCapture(str(self._part))
        try:
            return int(capture.get(self._cv.CAP_PROP_FRAME_COUNT)) if capture.isOpened() else 0
        finally:
            capture.release()

    def _discard(self) -> None:
        self._open = False
        self._writer.release()
        self._part.unlink(missing_ok=True)
