"""A run as an MCAP file of ROS 2 messages: open it in Foxglove, replay it with rosbag2.

The messages have the stamps of the frames, so that a live recording merges with other logs; frames
without a stamp have their time since the first frame, and begin in 1970.

Topics: `wrench` (geometry_msgs/msg/WrenchStamped) for frames that have one, and `force_field`
(gelslim_msgs/msg/ForceField) for every frame, each below the recording's namespace.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.packed_frame import NO_FIELD, NO_WRENCH

_CHUNK_BYTES = 1 << 18
WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
FORCE_FIELD = "gelslim_msgs/msg/ForceField"
Message = dict[str, Any]
"""Fields of a message by name; a nested message is a dictionary too."""
_SI_UNITS = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
"""Factors from N and N mm to N and N m."""
_SEPARATOR = "=" * 80
_NESTED = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
}


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
        stamp, sequence = log_time_ns(result), int(result.index) % 2**32
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


def force_field_definition() -> str:
    """Return `ForceField.msg`, which belongs into a ROS 2 package named gelslim_msgs."""
    folder = resources.files("gelslim_force.outputs")
    return (folder / "ForceField.msg").read_text(encoding="utf-8")


def schema(type_name: str) -> str:
    """Return a definition together with the nested ones. Raises KeyError for another type."""
    own = {
        WRENCH_STAMPED: "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
        FORCE_FIELD: force_field_definition(),
    }[type_name]
    return own + "".join(f"{_SEPARATOR}\nMSG: {name}\n{text}" for name, text in _NESTED.items())


def nanoseconds(time_s: float) -> int:
    """Return a time for a stamp; 0 for one that a stamp cannot hold (below 0, or after 2038)."""
    valid = math.isfinite(time_s) and 0 < time_s < 2**31 - 1
    return round(time_s * 1e9) if valid else 0


def log_time_ns(result: FrameResult) -> int:
    """Return the stamp of a frame since 1970, or the time since its first frame without one."""
    return nanoseconds(result.time_s if result.stamp_s is None else result.stamp_s)


def wrench_stamped(result: FrameResult, frame_id: str) -> Message | None:
    """Return a geometry_msgs/msg/WrenchStamped in N and N m; None without a wrench."""
    if result.wrench is None:
        return None
    return {"header": _header(result, frame_id), "wrench": _wrench(result.wrench)}


def force_field(result: FrameResult, frame_id: str) -> Message:
    """Return a gelslim_msgs/msg/ForceField; what the frame does not have is NaN or empty."""
    field, wrench = result.field or NO_FIELD, result.wrench or NO_WRENCH
    tracks = result.tracks
    return {
        "header": _header(result, frame_id),
        "frame_index": int(result.index) % 2**32,
        "normal_known": result.normal_known,
        "wrench": _wrench(wrench),
        "wrench_covariance": (wrench.covariance * np.outer(_SI_UNITS, _SI_UNITS)).ravel().tolist(),
        "centre_of_pressure": (np.asarray(field.centre_of_pressure_mm) / 1e3).tolist(),
        "slip_margin": field.slip_margin,
        "misfit": field.misfit,
        "points": _float32(field.points_mm * 1e-3),
        "displacement": _float32(field.displacement_mm * 1e-3),
        "force": _float32(field.force_n),
        "traction": _float32(field.traction_mpa * 1e6),
        "contact": field.contact.tolist(),
        "markers": 0 if tracks is None else len(tracks),
        "markers_tracked": 0 if tracks is None else int(tracks.tracked.sum()),
        "problems": [_text(problem) for problem in result.problems],
    }


def _header(result: FrameResult, frame_id: str) -> Message:
    sec, nanosec = divmod(log_time_ns(result), 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": _text(frame_id)}


def _wrench(wrench: Wrench) -> Message:
    parts = np.split(wrench.vector * _SI_UNITS, 2)
    force, torque = (dict(zip("xyz", part, strict=True)) for part in parts)
    return {"force": force, "torque": torque}


def _float32(values: ArrayLike) -> list[float]:
    """All numbers in order; those beyond the range of single precision become infinite."""
    rounded: list[float] = np.asarray(values).astype(np.float32).ravel().tolist()
    return rounded


def _text(text: str) -> str:
    """Text that UTF-8 can hold and that has no zero byte, which would end it early."""
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "")
