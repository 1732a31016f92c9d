"""A video of one shard, in an encoding that the loader of LeRobot decodes."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_core.errors import disk_error
from gelslim_twin.datasets.formats import DataSetError

_LOSSLESS = 100
"""Quality whose pictures are those that were written, bit for bit."""
_WORST_CRF = 63
_LEAST_PX = 32
"""The encoder of AV1 ends the process for pictures of 16 px."""
_LOSSLESS_OPTIONS = {"preset": "veryfast", "threads": "1"}
_OPTIONS = {"preset": "10", "svtav1-params": "lp=1"}
"""One thread, so that the bytes do not depend on the number of processors."""
_GROUP = "2"
"""Frames from one key frame to the next: few, because training jumps to and fro."""


class VideoFile:
    """Encodes pictures, one after the other.

    Quality 100 is H.264 in RGB without loss; below, it is AV1, whose blur moves markers.
    """

    def __init__(self, path: Path, frames_per_s: float, quality: int) -> None:
        """Begin a video.

        Args:
            path: The new file; its name ends in .mp4.
            frames_per_s: Rate in Hz.
            quality: 1 to 100.

        Raises:
            MissingLibraryError: PyAV is not installed.
            DataSetError: PyAV was built without the encoder.
            OutputError: The file cannot be made.
        """
        self._av = library()
        self.path = path
        lossless = quality >= _LOSSLESS
        crf = 0 if lossless else round(_WORST_CRF * (1 - quality / _LOSSLESS))
        codec, self._pixels = ("libx264rgb", "rgb24") if lossless else ("libsvtav1", "yuv420p")
        self._is_begun = False
        self._least_px = 1 if lossless else _LEAST_PX
        options = {"crf": str(crf), "g": _GROUP, **(_LOSSLESS_OPTIONS if lossless else _OPTIONS)}
        rate = Fraction(frames_per_s).limit_denominator(1001)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._av.open(str(path), "w")
            self._stream = self._file.add_stream(codec, rate, options=options)
        except OSError as error:
            raise disk_error(path, "starting the video", error) from error
        except ValueError as error:
            raise DataSetError(
                f"PyAV has no encoder {codec} here ({error}); install its wheel with `pip install "
                "av`, or write single pictures with --pictures png"
            ) from error

    def append(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture (h, w, 3).

        Raises:
            DataSetError: It is too small for the encoder.
            OutputError: The disk refuses it.
        """
        if min(picture.shape[:2]) < self._least_px:
            raise DataSetError(
                f"pictures of {picture.shape[1]} x {picture.shape[0]} px: videos with losses need "
                f"{self._least_px} px at least; write --quality {_LOSSLESS} or --pictures png"
            )
        if not self._is_begun:
            # Newer versions of PyAV refuse to be told of the size once the encoder is open.
            self._stream.height, self._stream.width = picture.shape[:2]
            self._stream.pix_fmt = self._pixels
            self._is_begun = True
        self._write(self._av.VideoFrame.from_ndarray(picture, format="rgb24"))

    def finish(self) -> None:
        """Write what is still in the encoder, and close the file. Raises OutputError."""
        self._write(None)
        self.close()

    def close(self) -> None:
        """Close the file, complete or not. Raises OutputError."""
        try:
            self._file.close()
        except OSError as error:
            raise disk_error(self.path, "closing the video", error) from error

    def _write(self, frame: Any) -> None:
        try:
            for packet in self._stream.encode(frame):
                self._file.mux(packet)
        except OSError as error:
            raise disk_error(self.path, "writing the video", error) from error


def library() -> Any:
    """The module `av`, quiet but for errors. Raises MissingLibraryError."""
    av = optional_library.load("av", "a data set of LeRobot with videos")
    # The encoder of AV1 writes its settings to the terminal itself; 1 is errors alone.
    os.environ.setdefault("SVT_LOG", "1")
    av.logging.set_level(av.logging.ERROR)
    return av


def video_problem(path: Path) -> str:
    """Why a video cannot be read; empty if all its frames can."""
    av = library()
    try:
        with av.open(str(path)) as file:
            for _ in file.decode(video=0):
                pass
    except (OSError, ValueError, IndexError) as error:
        return getattr(error, "strerror", "") or str(error)
    return ""
