"""The finger as a camera of LeRobot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lerobot.cameras import Camera
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from gelslim_force.frames.source import open_frames
from gelslim_force.outputs.tactile_features import Features, ForceGrid, TactileFeatures
from gelslim_force.sensor import open_sensor
from gelslim_force.tracking.drift_filter import TareRecord
from lerobot_camera_gelslim.config_gelslim import GelslimCameraConfig
from lerobot_camera_gelslim.sensor_stream import Picture, Reading, SensorStream

_FIRST_PICTURE_S = 10.0
"""A camera may take seconds to start, and the pipeline compiles with its first frame."""


class GelslimCamera(Camera):
    """A finger whose pictures LeRobot reads, with the forces of the picture that it read last.

    Attributes:
        config: As given.
        features: Type, shape and names of what `observation` returns; after `connect`.
    """

    def __init__(self, config: GelslimCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._stream: SensorStream | None = None
        self._features: TactileFeatures | None = None
        self._last: Reading | None = None

    def __str__(self) -> str:
        """`GelslimCamera(camera:0)`."""
        return f"{type(self).__name__}({self.config.source})"

    @property
    def is_connected(self) -> bool:
        """Whether pictures are read."""
        return self._stream is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """The cameras of this computer by the names that `source` takes; on Linux only.

        Which of them looks into a finger, no program can tell.
        """
        devices = sorted(Path("/dev").glob("video*"))
        return [
            {"name": f"GelSlim finger at {d}", "type": "gelslim", "id": f"camera:{d}"}
            for d in devices
        ]

    def connect(self, warmup: bool = True) -> None:
        """Open sensor and pictures; with `warmup`, wait for the first picture.

        Raises:
            DeviceAlreadyConnectedError: It is connected.
            GelslimError: Bundle, calibration or pictures cannot be read, or no picture comes.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError(f"{self} is already connected")
        config = self.config
        pipeline = open_sensor(
            config.bundle,
            calibration=config.calibration,
            indenter=config.indenter or None,
            gel_calibration=config.gel_calibration or None,
            light_calibration=config.light_calibration or None,
        )
        grid = ForceGrid.of(pipeline.points_mm, tuple(config.grid))
        self._features = TactileFeatures(grid, len(pipeline.calibration.reference.positions_px))
        frames = open_frames(config.source, config.fps)
        self._stream = SensorStream(pipeline, frames)
        if warmup and frames.live:
            pipeline.prepare()
            try:
                self._stream.next(_FIRST_PICTURE_S)
            except BaseException:
                self.disconnect()
                raise

    def disconnect(self) -> None:
        """Close the camera. Raises DeviceNotConnectedError."""
        self._connected.close()
        self._stream = self._last = None

    def read(self) -> Picture:
        """Wait for the next picture (h, w, 3). Raises as `async_read`, after ten seconds."""
        return self._given(self._connected.next(_FIRST_PICTURE_S))

    def async_read(self, timeout_ms: float = 200) -> Picture:
        """The newest picture (h, w, 3) that was not read yet, and the next one of a recording.

        Raises:
            DeviceNotConnectedError: It is not connected.
            NoPictureError: None came in time, or the recording has ended (a TimeoutError).
        """
        return self._given(self._connected.next(timeout_ms / 1000))

    def read_latest(self, max_age_ms: int = 500) -> Picture:
        """The newest picture (h, w, 3), read before or not, without waiting.

        Raises:
            DeviceNotConnectedError: It is not connected.
            NoPictureError: It is older than `max_age_ms`, or there is none (a TimeoutError).
        """
        return self._given(self._connected.latest(max_age_ms / 1000))

    @property
    def reading(self) -> Reading:
        """The picture read last, with its whole result. Raises DeviceNotConnectedError."""
        if self._last is None:
            raise DeviceNotConnectedError(f"{self}: no picture has been read yet")
        return self._last

    @property
    def features(self) -> dict[str, dict[str, object]]:
        """As in the description of the class. Raises DeviceNotConnectedError."""
        if self._features is None:
            raise DeviceNotConnectedError(f"{self} has not been connected yet")
        return self._features.description

    def observation(self) -> Features:
        """The features of the picture that was read last; NaN where it does not show a value.

        Raises:
            DeviceNotConnectedError: No picture has been read.
        """
        reading = self.reading
        assert self._features is not None
        return self._features.of(reading.result)

    def tare(self) -> TareRecord:
        """Take the picture read last, of an untouched gel, as the new rest.

        Raises:
            TareError: It cannot be a rest.
            DeviceNotConnectedError: No picture has been read.
        """
        return self._connected.tare(self.reading)

    @property
    def _connected(self) -> SensorStream:
        if self._stream is None:
            raise DeviceNotConnectedError(f"{self} is not connected; call connect() first")
        return self._stream

    def _given(self, reading: Reading) -> Picture:
        self._last = reading
        return reading.picture
