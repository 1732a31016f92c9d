"""Frame results as ROS 2 messages in SI units, and the definitions of these messages."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.packed_frame import NO_FIELD, NO_WRENCH

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
    sec, nanosec = divmod(nanoseconds(result.time_s), 10**9)
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
