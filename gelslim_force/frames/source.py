"""Frames by the name of their source: a folder, a picture, a video, a NumPy file, a camera."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError
from gelslim_force.frames.frame_array import FrameArray, read_frame_array
from gelslim_force.frames.opencv_frames import VIDEO_ENDINGS, LiveCamera, VideoFile
from gelslim_force.frames.picture import PICTURE_ENDINGS
from gelslim_force.frames.picture_folder import PictureFolder
from gelslim_force.frames.threaded_reader import ThreadedReader

__all__ = ["Frame", "FrameSource", "FrameSourceError", "open_frames"]

_CAMERA = "camera:"
_STREAMS = ("rtsp://", "rtmp://", "http://", "https://", "udp://", "tcp://")


def open_frames(
    source: str | os.PathLike[str] | NDArray[np.uint8], frames_per_s: float | None = None
) -> ThreadedReader:
    """Open a source of frames, which are read ahead in a thread; use it in a `with` block.

    Args:
        source: A folder of pictures, a picture, a video, an `.npy` or `.npz` file, an array
            (n, h, w) or (n, h, w, 3) uint8, or for live frames `camera:0`, `camera:/dev/video0`
            or the address of a stream.
        frames_per_s: Rate in Hz of a source that does not state one; it overrides the rate of a
            video.

    Returns:
        An iterable of `Frame`.

    Raises:
        FrameSourceError: No frame can be read from the source, or the rate is out of range.
        MissingLibraryError: The library that reads such a source is not installed.
    """
    if frames_per_s is not None and not 0.001 <= frames_per_s <= 1e5:
        raise FrameSourceError(f"{frames_per_s:g} frames per second: must be in 0.001 ... 100000")
    return ThreadedReader(_source(source, frames_per_s))


def _source(
    source: str | os.PathLike[str] | NDArray[np.uint8], frames_per_s: float | None
) -> FrameSource:
    if isinstance(source, np.ndarray):
        return FrameArray(source, None, frames_per_s)
    text = os.fspath(source)
    if text.startswith(_CAMERA):
        device = text.removeprefix(_CAMERA) or "0"
        return LiveCamera(int(device) if device.isdecimal() else device, None, frames_per_s)
    if text.startswith(_STREAMS):
        return LiveCamera(text, None, frames_per_s)
    path = Path(text)
    if path.is_dir():
        return PictureFolder(path, frames_per_s)
    if not path.is_file():
        raise FrameSourceError(
            f"{path}: no such file or folder; give a folder of pictures, a video, an .npy or "
            ".npz file, or camera:0"
        )
    ending = path.suffix.lower()
    if ending in (".npy", ".npz"):
        return read_frame_array(path, frames_per_s)
    if ending in PICTURE_ENDINGS:
        return PictureFolder(path, frames_per_s)
    if ending in VIDEO_ENDINGS:
        return VideoFile(path, frames_per_s)
    raise FrameSourceError(
        f"{path}: the ending {ending or 'none'} is neither a picture's "
        f"({', '.join(PICTURE_ENDINGS)}) nor a video's ({', '.join(VIDEO_ENDINGS)}) nor .npz"
    )
