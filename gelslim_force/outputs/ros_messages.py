"""Results as ROS 2 messages: definitions, and their bytes in SI units."""

from __future__ import annotations

import math
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.cdr import CdrMessage

WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
FORCE_FIELD = "gelslim_msgs/msg/ForceField"
_SI = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
_BAR = "=" * 80
_HEADER = "builtin_interfaces/Time stamp\nstring frame_id\n"
_PARTS = {
    "std_msgs/Header": _HEADER,
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
}


def force_field_definition() -> str:
    """Return `ForceField.msg`, to be put in a ROS 2 package named gelslim_msgs."""
    folder = resources.files("gelslim_force.outputs")
    return (folder / "ForceField.msg").read_text(encoding="utf-8")


def schema(type_name: str) -> str:
    """Return a definition with those it needs, as a recording holds it. Raises KeyError."""
    own = {
        WRENCH_STAMPED: "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
        FORCE_FIELD: force_field_definition(),
    }[type_name]
    return own + "".join(f"{_BAR}\nMSG: {name}\n{text}" for name, text in _PARTS.items())


def nanoseconds(time_s: float) -> int:
    """Return a time for a stamp; 0 for one that a stamp cannot hold (under 0, or past 2038)."""
    held = math.isfinite(time_s) and 0 < time_s < 2**31 - 1
    return round(time_s * 1e9) if held else 0


def wrench_stamped(result: FrameResult, frame_id: str) -> bytes | None:
    """Return geometry_msgs/msg/WrenchStamped in N and N m; None without a wrench."""
    if result.wrench is None:
        return None
    message = CdrMessage()
    _add_header(message, result, frame_id)
    message.array(_wrench(result.wrench), "<f8")
    return message.data()


def force_field(result: FrameResult, frame_id: str) -> bytes:
    """Return gelslim_msgs/msg/ForceField; what the frame lacks is NaN or empty."""
    field, tracks = result.field, result.tracks
    message = CdrMessage()
    _add_header(message, result, frame_id)
    message.uint32(int(result.index) % 2**32)
    message.boolean(result.normal_known)
    message.array(_wrench(result.wrench), "<f8")
    message.array(_covariance(result.wrench), "<f8")
    if field is None:
        message.array([math.nan] * 4, "<f8")
        for _ in range(5):
            message.uint32(0)
    else:
        message.array(np.asarray(field.centre_of_pressure_mm) / 1e3, "<f8")
        message.array([field.slip_margin, field.misfit], "<f8")
        for values, to_si in (
            (field.points_mm, 1e-3),
            (field.displacement_mm, 1e-3),
            (field.force_n, 1.0),
            (field.traction_mpa, 1e6),
        ):
            message.sequence(values * to_si, "<f4")
        message.sequence(field.contact, "u1")
    message.uint32(0 if tracks is None else len(tracks))
    message.uint32(0 if tracks is None else int(tracks.tracked.sum()))
    message.uint32(len(result.problems))
    for problem in result.problems:
        message.string(problem)
    return message.data()


def _add_header(message: CdrMessage, result: FrameResult, frame_id: str) -> None:
    sec, nanosec = divmod(nanoseconds(result.time_s), 10**9)
    message.int32(sec)
    message.uint32(nanosec)
    message.string(frame_id)


def _wrench(wrench: Wrench | None) -> NDArray[np.float64]:
    """(6,) in N and N m."""
    return np.full(6, np.nan) if wrench is None else wrench.vector * _SI


def _covariance(wrench: Wrench | None) -> NDArray[np.float64]:
    """(6, 6) in N and N m."""
    if wrench is None:
        return np.full((6, 6), np.nan)
    return np.asarray(wrench.covariance * np.outer(_SI, _SI))
