"""A camera as frames, through OpenCV."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator

import numpy as np

from gelslim_force.frames.frame import Frame, FrameSourceError, SourceContext, size_problem
from gelslim_force.frames.opencv_capture import (
    FPS,
    FRAME_HEIGHT,
    FRAME_WIDTH,
    Capture,
    open_capture,
)

_TRIES = 30
"""Reads that fail in a row before the camera is taken to be gone."""


class LiveCamera(SourceContext):
    """Frames of a camera until `close`, or until it gives none any more.

    Read it through `ThreadedReader`, which drops frames that came while the last was in work.
    """

    live = True
    count: int | None = None

    def __init__(
        self,
        device: int | str = 0,
        size_px: tuple[int, int] | None = None,
        frames_per_s: float | None = None,
        capture: Callable[[int | str], Capture] = open_capture,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`device` is a number, a file such as /dev/video0 or a stream's address.

        `size_px` (width, height) and `frames_per_s` are asked of the camera.
        Raises FrameSourceError where it does not open, or has another size.
        """
        self.device, self._clock = device, clock
        self._capture = capture(device)
        if not self._capture.isOpened():
            self._capture.release()
            raise FrameSourceError(
                f"camera {device}: does not open; is it plugged in, and free of other programs?"
            )
        if size_px is not None:
            self._capture.set(FRAME_WIDTH, size_px[0])
            self._capture.set(FRAME_HEIGHT, size_px[1])
        if frames_per_s is not None:
            self._capture.set(FPS, frames_per_s)
        rate = self._capture.get(FPS)
        known = math.isfinite(rate) and 0.01 <= rate <= 1e5
        self.frames_per_s = float(rate) if known else frames_per_s
        self._shape = None if size_px is None else (size_px[1], size_px[0], 3)
        self._closed = self._reading = False

    def __iter__(self) -> Iterator[Frame]:
        """Yield frames with the time since the first; a read that fails is flagged."""
        self._reading = True
        try:
            yield from self._frames()
        finally:
            self._capture.release()

    def _frames(self) -> Iterator[Frame]:
        index = failed = 0
        start = self._clock()
        while not self._closed and failed < _TRIES:
            good, image = self._capture.read()
            time_s = self._clock() - start
            if index == 0:
                start, time_s = start + time_s, 0.0
            problem = "the camera gave no picture"
            if good and image is not None:
                image = np.ascontiguousarray(image[:, :, ::-1] if image.ndim == 3 else image)
                self._shape = self._shape or image.shape
                problem = size_problem(image, self._shape)
            failed = failed + 1 if not good else 0
            if failed == _TRIES:
                problem = f"the camera gave no picture {_TRIES} times in a row: it is gone"
            if not self._closed:
                yield Frame(index, time_s, None if problem else image, problem)
            index += 1

    def close(self) -> None:
        """End the frames and let go of the camera, if in the midst of a read then after it."""
        # Releasing a capture that another thread reads from crashes OpenCV.
        self._closed = True
        if not self._reading:
            self._capture.release()
