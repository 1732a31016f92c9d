"""A run as an MCAP file of ROS 2 messages: open it in Foxglove, replay it with rosbag2.

Topics: `wrench` (geometry_msgs/msg/WrenchStamped) for frames that have one, and `force_field`
(gelslim_msgs/msg/ForceField) for every frame, each below the recording's namespace.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

from gelslim_core.files.output_error import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs import optional_library
from gelslim_force.outputs.ros_messages import (
    FORCE_FIELD,
    WRENCH_STAMPED,
    force_field,
    nanoseconds,
    schema,
    wrench_stamped,
)

_CHUNK_BYTES = 1 << 18


class McapRecording:
    """Appends frames; a killed process leaves all full chunks (256 KiB), for `mcap recover`."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        frame_id: str = "gelslim_sensor",
        namespace: str = "gelslim",
        about: Mapping[str, str] | None = None,
    ) -> None:
        """`about` goes into the file as metadata, such as `bundle_identity(...)`.

        Raises OutputError without the package mcap, where the file exists or cannot be made.
        """
        mcap = optional_library.load("mcap.writer", "record", "MCAP recordings")
        self.path = Path(path)
        self._frame_id = frame_id
        prefix = "/" + namespace.strip("/")
        if self.path.suffix.lower() != ".mcap":
            raise OutputError(f"{self.path}: a recording must end in .mcap")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self.path, "xb")  # noqa: SIM115  (closed in finish)
            self._writer = mcap.Writer(self._file, chunk_size=_CHUNK_BYTES)
            self._writer.start(profile="ros2", library="gelslim")
            if about:
                self._writer.add_metadata("gelslim", dict(about))
            self._channels = {
                topic: self._channel(f"{prefix.rstrip('/')}/{topic}", kind)
                for topic, kind in (("wrench", WRENCH_STAMPED), ("force_field", FORCE_FIELD))
            }
            self._file.flush()
        except OSError as error:
            raise disk_error(self.path, "starting the recording", error) from error
        self._open = True

    def append(self, result: FrameResult) -> None:
        """Add a frame's messages. Raises OutputError where the disk refuses, or after `finish`."""
        if not self._open:
            raise OutputError(f"{self.path}: the recording is finished")
        stamp = nanoseconds(result.time_s)
        messages = {
            "wrench": wrench_stamped(result, self._frame_id),
            "force_field": force_field(result, self._frame_id),
        }
        try:
            for topic, data in messages.items():
                if data is not None:
                    self._writer.add_message(
                        self._channels[topic], stamp, data, stamp, int(result.index) % 2**32
                    )
            self._file.flush()
        except OSError as error:
            self._open = False
            self._drop()
            raise disk_error(self.path, f"recording frame {result.index}", error) from error

    def finish(self) -> None:
        """Write the index and close; again is harmless. Raises OutputError."""
        if not self._open:
            return
        self._open = False
        try:
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
        except OSError as error:
            self._drop()
            raise disk_error(self.path, "finishing the recording", error) from error

    def _channel(self, topic: str, type_name: str) -> int:
        kind = self._writer.register_schema(type_name, "ros2msg", schema(type_name).encode())
        return int(self._writer.register_channel(topic, "cdr", kind))

    def _drop(self) -> None:
        """Close without a second complaint about what is still buffered."""
        with contextlib.suppress(OSError):
            self._file.close()

    def __enter__(self) -> McapRecording:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Finish."""
        if kind is None:
            self.finish()
            return
        with contextlib.suppress(OutputError):  # the first error is the one to tell
            self.finish()
