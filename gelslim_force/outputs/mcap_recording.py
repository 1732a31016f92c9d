"""A run as an MCAP file of ROS 2 messages: open it in Foxglove, replay it with rosbag2.

Topics: `wrench` (geometry_msgs/msg/WrenchStamped) for frames that have one, and `force_field`
(gelslim_msgs/msg/ForceField) for every frame, each below the recording's namespace.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.ros_messages import (
    FORCE_FIELD,
    WRENCH_STAMPED,
    force_field,
    nanoseconds,
    schema,
    wrench_stamped,
)

_CHUNK_BYTES = 1 << 18


class McapRecording(AbstractContextManager["McapRecording"]):
    """Appends frames to a recording.

    A process that is killed leaves all full chunks of 256 KiB; `mcap recover` reads them.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        frame_id: str = "gelslim_sensor",
        namespace: str = "gelslim",
        about: Mapping[str, str] | None = None,
    ) -> None:
        """Start a recording.

        Args:
            path: The new file; its name ends in .mcap.
            frame_id: Name of the sensor frame in the messages' headers.
            namespace: First part of the topics' names.
            about: Metadata of the recording, such as `bundle_identity(...)`.

        Raises:
            OutputError: The file exists or cannot be made.
            MissingLibraryError: mcap-ros2-support is not installed.
        """
        writers = optional_library.load("mcap_ros2.writer", "MCAP recordings")
        self.path = Path(path)
        self._frame_id = frame_id
        self._prefix = f"/{namespace.strip('/')}".rstrip("/")
        if self.path.suffix.lower() != ".mcap":
            raise OutputError(f"{self.path}: the name of a recording must end in .mcap")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(self.path, "xb")  # noqa: SIM115  (closed in finish)
            self._writer = writers.Writer(self._file, chunk_size=_CHUNK_BYTES)
            if about:
                self._writer.add_metadata("gelslim", dict(about))
            self._wrench, self._field = (
                self._writer.register_msgdef(kind, schema(kind))
                for kind in (WRENCH_STAMPED, FORCE_FIELD)
            )
            self._file.flush()
        except OSError as error:
            raise disk_error(self.path, "starting the recording", error) from error
        self._open = True

    def append(self, result: FrameResult) -> None:
        """Add a frame's messages.

        Raises OutputError if the disk refuses them or the recording is finished.
        """
        if not self._open:
            raise OutputError(f"{self.path}: the recording is already finished")
        stamp, sequence = nanoseconds(result.time_s), int(result.index) % 2**32
        wrench = wrench_stamped(result, self._frame_id)
        field = force_field(result, self._frame_id)
        try:
            for topic, kind, message in (
                ("wrench", self._wrench, wrench),
                ("force_field", self._field, field),
            ):
                if message is not None:
                    name = f"{self._prefix}/{topic}"
                    self._writer.write_message(name, kind, message, stamp, stamp, sequence)
            self._file.flush()
        except OSError as error:
            self._open = False
            self._discard()
            raise disk_error(self.path, f"recording frame {result.index}", error) from error

    def finish(self) -> None:
        """Write the index and close the file; a second call does nothing. Raises OutputError."""
        if not self._open:
            return
        self._open = False
        try:
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
        except OSError as error:
            self._discard()
            raise disk_error(self.path, "finishing the recording", error) from error

    def _discard(self) -> None:
        """Close the file without a second error for what is still in its buffer."""
        with contextlib.suppress(OSError):
            self._file.close()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the recording; after an error in the block that error is the one to report."""
        with contextlib.nullcontext() if kind is None else contextlib.suppress(OutputError):
            self.finish()
