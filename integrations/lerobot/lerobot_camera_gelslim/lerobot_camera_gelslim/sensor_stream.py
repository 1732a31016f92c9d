"""Pictures of a sensor with what its pipeline makes of them, newest first. Needs no LeRobot."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass
from threading import Condition, Lock, Thread

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.frames.frame import Frame, FrameSource
from gelslim_force.frames.upright import upright
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.tracking.drift_filter import TareRecord

Picture = NDArray[np.uint8]
_JOIN_S = 5.0
_LOG = logging.getLogger(__name__)


class NoPictureError(GelslimError, TimeoutError):
    """The sensor gave no new picture in time."""


class RecordingEndedError(NoPictureError):
    """The recording that takes the place of a camera has no further picture."""


@dataclass(frozen=True, eq=False)
class Reading:
    """A picture and what it showed.

    Attributes:
        image: (h, w) or (h, w, 3) uint8 in RGB, upright.
        result: Its forces.
        taken_s: When it was read, by `time.monotonic`.
    """

    image: Picture
    result: FrameResult
    taken_s: float

    @property
    def picture(self) -> Picture:
        """(h, w, 3); a grey picture has three equal channels."""
        return self.image if self.image.ndim == 3 else np.repeat(self.image[..., None], 3, axis=2)


class SensorStream:
    """Reads a sensor.

    A thread follows a camera and keeps its newest picture. A recording gives its pictures one after
    the other, each when it is asked for, so that none is lost.
    """

    def __init__(self, pipeline: ForcePipeline, source: FrameSource) -> None:
        """Begin to read a source; `close` closes it."""
        self.pipeline, self._source = pipeline, source
        self._frames: Iterator[Frame] = iter(source)
        self._new, self._one_at_a_time = Condition(), Lock()
        self._last: Reading | None = None
        self._taken = self._closed = False
        self._error: BaseException | None = None
        self._thread: Thread | None = None
        if source.live:
            self._thread = Thread(target=self._follow, name="tactile sensor", daemon=True)
            self._thread.start()

    def next(self, timeout_s: float) -> Reading:
        """The newest reading that was not taken before; the next one of a recording.

        Raises:
            NoPictureError: None came within the time.
            RecordingEndedError: The recording has ended.
            GelslimError: The camera failed.
        """
        if self._thread is None:
            return self._next_recorded()
        with self._new:
            self._new.wait_for(lambda: self._fresh or self._error, timeout_s)
            if not self._fresh:
                if self._error is not None:
                    raise self._error
                raise NoPictureError(
                    f"the sensor gave no picture within {1000 * timeout_s:.0f} ms: is its camera "
                    "connected, and does it run at the rate that you expect?"
                )
            self._taken = True
            assert self._last is not None
            return self._last

    def latest(self, oldest_s: float) -> Reading:
        """The newest reading, taken before or not; the next one of a recording.

        Raises:
            NoPictureError: There is none, or it is older than `oldest_s`.
            RecordingEndedError: The recording has ended.
        """
        if self._thread is None:
            return self._next_recorded()
        with self._new:
            last = self._last
            if last is None:
                raise NoPictureError("the sensor has not given a picture yet")
            age_s = time.monotonic() - last.taken_s
            if age_s > oldest_s:
                raise NoPictureError(
                    f"the newest picture is {1000 * age_s:.0f} ms old, more than "
                    f"{1000 * oldest_s:.0f} ms: has the camera been unplugged?"
                ) from self._error
            self._taken = True
            return last

    def tare(self, reading: Reading) -> TareRecord:
        """Take a reading of the untouched gel as the new rest. Raises TareError."""
        with self._one_at_a_time:
            return self.pipeline.tare(reading.image)

    def close(self) -> None:
        """Stop reading, and close the source; a second call does nothing."""
        self._closed = True
        self._source.close()
        if self._thread is not None:
            self._thread.join(_JOIN_S)

    @property
    def _fresh(self) -> bool:
        return self._last is not None and not self._taken

    def _next_recorded(self) -> Reading:
        for frame in self._frames:
            reading = self._read(frame)
            if reading is not None:
                return reading
        raise RecordingEndedError("the recording has no further picture; give a longer one")

    def _follow(self) -> None:
        try:
            for frame in self._frames:
                reading = self._read(frame)
                if self._closed:
                    break
                if reading is not None:
                    with self._new:
                        self._last, self._taken = reading, False
                        self._new.notify_all()
            else:
                raise NoPictureError("the camera has stopped giving pictures")
        except BaseException as error:
            with self._new:
                self._error = error
                self._new.notify_all()

    def _read(self, frame: Frame) -> Reading | None:
        if frame.image is None:
            _LOG.warning("frame %d is left out: %s", frame.index, frame.problem)
            return None
        taken_s = time.monotonic()
        with self._one_at_a_time:
            result = self.pipeline.process(frame)
        return Reading(upright(frame.image, self.pipeline.calibration.camera), result, taken_s)
