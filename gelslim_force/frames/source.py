"""Frames by the name of their source: a folder, a picture, a video, a NumPy file, a camera."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from threading import Condition, Thread

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError
from gelslim_force.frames.frame_array import FrameArray, read_frame_array
from gelslim_force.frames.opencv_frames import VIDEO_ENDINGS, LiveCamera, VideoFile
from gelslim_force.frames.picture import PICTURE_ENDINGS, PictureFolder

_CAMERA = "camera:"
_STREAMS = ("rtsp://", "rtmp://", "http://", "https://", "udp://", "tcp://")
_JOIN_S = 5.0
_RECORDED_AHEAD, _CAMERA_AHEAD = 4, 64
"""Frames that wait at most: decoding ahead of computing, and those of a camera kept in order."""


def open_frames(
    source: str | os.PathLike[str] | NDArray[np.uint8],
    frames_per_s: float | None = None,
    *,
    latest: bool | None = None,
) -> ThreadedReader:
    """Open a source of frames, which are read ahead in a thread; use it in a `with` block.

    Args:
        source: A folder of pictures, a picture, a video, an `.npy` or `.npz` file, an array
            (n, h, w) or (n, h, w, 3) uint8, or for live frames `camera:0`, `camera:/dev/video0`
            or the address of a stream.
        frames_per_s: Rate in Hz of a source that does not state one; it overrides the rate of a
            video.
        latest: Whether the newest frame takes the place of one that still waits: so no frame is
            old when it is taken, and the reader counts those it dropped. By default this is so for
            cameras; False gives their frames in order, while at most 64 wait.

    Returns:
        An iterable of `Frame`.

    Raises:
        FrameSourceError: No frame can be read from the source, the rate is out of range, or the
            latest frames are asked of a recorded source.
        MissingLibraryError: The library that reads such a source is not installed.
    """
    if frames_per_s is not None and not 0.001 <= frames_per_s <= 1e5:
        raise FrameSourceError(f"{frames_per_s:g} frames per second: must be in 0.001 ... 100000")
    if latest and not is_camera(source):
        raise FrameSourceError(
            f"latest = True for {'an array' if isinstance(source, np.ndarray) else source}: only a "
            "camera or a stream has a latest frame; give camera:0 or its address, or leave it out"
        )
    return ThreadedReader(_source(source, frames_per_s), latest=latest)


def is_camera(source: str | os.PathLike[str] | NDArray[np.uint8]) -> bool:
    """Whether frames of this source arrive in real time."""
    if isinstance(source, np.ndarray):
        return False
    return os.fspath(source).startswith((_CAMERA, *_STREAMS))


def _source(
    source: str | os.PathLike[str] | NDArray[np.uint8], frames_per_s: float | None
) -> FrameSource:
    if isinstance(source, np.ndarray):
        return FrameArray(source, None, frames_per_s)
    text = os.fspath(source)
    if text.startswith(_CAMERA):
        device = text.removeprefix(_CAMERA) or "0"
        return LiveCamera(int(device) if device.isdecimal() else device, frames_per_s)
    if text.startswith(_STREAMS):
        return LiveCamera(text, frames_per_s)
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


class ThreadedReader(FrameSource):
    """Reads a source in a thread of its own, so that decoding and computing overlap.

    The latest frame of a live source replaces one that has not been taken yet; a recorded source
    waits while `ahead` frames are in the buffer. It can be iterated once.

    Attributes:
        source: As given.
        latest: Whether new frames replace those that wait.
        dropped: Number of frames that were replaced.
    """

    def __init__(
        self, source: FrameSource, ahead: int | None = None, latest: bool | None = None
    ) -> None:
        """Reading starts with the first `next`.

        Args:
            source: What is read; it is closed with the reader.
            ahead: Largest number of frames that wait; by default 4, or 64 of a live source.
            latest: Whether new frames replace those that wait; by default, if the source is live.

        Raises:
            ValueError: `ahead` is below 1, or the latest frames of a recorded source are wanted.
        """
        if ahead is not None and ahead < 1:
            raise ValueError(f"ahead = {ahead}: must be at least 1")
        if latest and not source.live:
            raise ValueError("latest = True: the source must be live")
        self.source, self.live = source, source.live
        self.latest = source.live if latest is None else latest
        self.count, self.frames_per_s = source.count, source.frames_per_s
        self._ahead = ahead or (_CAMERA_AHEAD if source.live else _RECORDED_AHEAD)
        self._buffer: deque[Frame] = deque()
        self._changed = Condition()
        self._error: BaseException | None = None
        self._ended = self._stopped = False
        self._thread: Thread | None = None
        self.dropped = 0

    def __iter__(self) -> Iterator[Frame]:
        """Yield frames; an error of the source is raised after the frames before it."""
        if self._thread is None:
            self._thread = Thread(target=self._read, name="frames", daemon=True)
            self._thread.start()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._buffer or self._ended or self._stopped)
                if self._stopped:
                    return
                if not self._buffer:
                    if self._error is not None:
                        raise self._error
                    return
                frame = self._buffer.popleft()
                self._changed.notify_all()
            yield frame

    def close(self) -> None:
        """Stop the thread and close the source."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        self.source.close()
        if self._thread is not None:
            self._thread.join(_JOIN_S)

    def _read(self) -> None:
        try:
            for frame in self.source:
                if not self._put(frame):
                    break
        except BaseException as error:
            self._error = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _put(self, frame: Frame) -> bool:
        with self._changed:
            if not self.latest:
                self._changed.wait_for(lambda: self._stopped or len(self._buffer) < self._ahead)
            elif self._buffer:
                self._buffer.popleft()
                self.dropped += 1
            if self._stopped:
                return False
            self._buffer.append(frame)
            self._changed.notify_all()
            return True
