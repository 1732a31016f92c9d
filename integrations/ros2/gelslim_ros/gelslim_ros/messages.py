"""Pictures from messages, and messages from results. Needs no ROS: messages are objects with
attributes, as `rosidl` generates them.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.mcap_recording import force_field, wrench_stamped

Fields = Mapping[str, Any]
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}
"""Bytes of a pixel by the encodings of `sensor_msgs/Image` that are read."""
OK, WARN = 0, 1
"""Levels of a diagnostic status."""


class PictureMessageError(ValueError):
    """A picture message that cannot be read."""


def picture_of(message: Any) -> NDArray[np.uint8]:
    """The picture of a `sensor_msgs/Image`, (h, w, 3) in the order red, green, blue, or (h, w).

    Raises:
        PictureMessageError: The encoding is not one of `CHANNELS`, or the data are too short.
    """
    channels = CHANNELS.get(message.encoding)
    if channels is None:
        raise PictureMessageError(
            f"pictures of encoding {message.encoding!r}: must be one of {', '.join(CHANNELS)}"
        )
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = np.frombuffer(bytes(message.data), dtype=np.uint8)
    if step < width * channels or len(data) < height * step:
        raise PictureMessageError(
            f"a picture of {width} x {height} px has rows of {step} bytes and {len(data)} bytes in "
            "all, which are too few"
        )
    rows = data[: height * step].reshape(height, step)[:, : width * channels]
    pixels = rows.reshape(height, width, channels)
    if channels == 1:
        return np.ascontiguousarray(pixels[..., 0])
    colours = pixels[..., :3]
    return np.ascontiguousarray(colours[..., ::-1] if message.encoding[0] == "b" else colours)


def image_fields(picture: NDArray[np.uint8], header: Fields) -> Fields:
    """Fields of a `sensor_msgs/Image` with a picture (h, w, 3)."""
    height, width, channels = picture.shape
    return {
        "header": header,
        "height": height,
        "width": width,
        "encoding": "rgb8",
        "is_bigendian": 0,
        "step": width * channels,
        "data": array("B", np.ascontiguousarray(picture).tobytes()),
    }


def wrench_fields(result: FrameResult, frame_id: str) -> Fields | None:
    """Fields of a `geometry_msgs/WrenchStamped`; None without a wrench."""
    return wrench_stamped(result, frame_id)


def covariance_fields(result: FrameResult, frame_id: str) -> Fields | None:
    """Fields of a `gelslim_msgs/WrenchWithCovarianceStamped`; None without a wrench."""
    if result.wrench is None:
        return None
    whole = force_field(result, frame_id)
    return {
        "header": whole["header"],
        "wrench": whole["wrench"],
        "covariance": whole["wrench_covariance"],
    }


def field_fields(result: FrameResult, frame_id: str) -> Fields:
    """Fields of a `gelslim_msgs/ForceField`."""
    fields = dict(force_field(result, frame_id))
    # Messages of rclpy check every element of a list, and none of an array.
    for name in ("points", "displacement", "force", "traction"):
        fields[name] = array("f", fields[name])
    return fields


def status_fields(result: FrameResult, name: str) -> Fields:
    """Fields of a `diagnostic_msgs/DiagnosticStatus`, its values as (key, value) pairs."""
    drift = result.extra.get("drift", {})
    shift = drift.get("shift_px") if isinstance(drift, Mapping) else None
    values = {
        "frame": str(result.index),
        "markers seen": f"{result.coverage:.0%}",
        "time, ms": f"{sum(result.stage_ms.values()):.1f}",
        "normal force known": str(result.normal_known),
    }
    if shift is not None:
        values["drift, px"] = ", ".join(f"{value:+.2f}" for value in shift)
    return {
        "level": bytes([WARN if result.problems else OK]),
        "name": name,
        "message": "; ".join(result.problems) or "forces are measured",
        "hardware_id": name,
        "values": tuple(values.items()),
    }


def fill(message: Any, fields: Fields) -> Any:
    """Set the attributes of a message, also of those within it; returns the message."""
    for name, value in fields.items():
        if isinstance(value, Mapping):
            fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message
