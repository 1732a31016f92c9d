"""What the node does with a picture, without ROS: forces, messages, a new rest on request."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.arrow_scale import Extent, LiveScale
from gelslim_force.outputs.overlay import Overlay
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.tracking.drift_filter import TareError
from gelslim_ros.messages import (
    Fields,
    covariance_fields,
    field_fields,
    image_fields,
    status_fields,
    wrench_fields,
)

Picture = NDArray[np.uint8]
Publish = Callable[[str, Fields], None]
TOPICS = ("wrench", "wrench_covariance", "force_field", "overlay", "diagnostics")
"""What is published, below the name of the node; `diagnostics` goes to /diagnostics."""


@dataclass(eq=False)
class ForceServer:
    """Turns pictures into messages.

    Attributes:
        pipeline: The sensor's pipeline.
        publish: Called with a topic of `TOPICS` and the fields of its message.
        frame_id: Frame of the gel in the headers.
        name: Name of the sensor in the diagnostics.
        overlay_every: Every so many frames the picture with arrows is drawn; 0 for never.
    """

    pipeline: ForcePipeline
    publish: Publish
    frame_id: str = "gel"
    name: str = "gelslim"
    overlay_every: int = 6
    _last: Picture | None = None
    _count: int = 0
    _scale: LiveScale = field(default_factory=lambda: LiveScale(Extent()))

    def take(self, picture: Picture, stamp_s: float | None = None) -> FrameResult:
        """Process a picture that was taken at a time since 1970, and publish what it gives."""
        result = self.pipeline.process(picture, stamp_s=stamp_s)
        self._last = picture
        for topic, fields in (
            ("wrench", wrench_fields(result, self.frame_id)),
            ("wrench_covariance", covariance_fields(result, self.frame_id)),
            ("force_field", field_fields(result, self.frame_id)),
            ("diagnostics", status_fields(result, self.name)),
        ):
            if fields is not None:
                self.publish(topic, fields)
        if self.overlay_every and self._count % self.overlay_every == 0:
            drawn = self._overlay.draw(picture, result, self._scale.scale(result))
            header = field_fields(result, self.frame_id)["header"]
            self.publish("overlay", image_fields(drawn, header))
        self._count += 1
        return result

    def tare(self) -> tuple[bool, str]:
        """Take the last picture as the new rest: whether it was one, and why not or how far."""
        if self._last is None:
            return False, "there has been no picture yet"
        try:
            record = self.pipeline.tare(self._last)
        except TareError as error:
            return False, str(error)
        shift = float(np.hypot(*record.shift_px))
        return True, f"the picture has moved by {shift:.2f} px since the calibration"

    def __post_init__(self) -> None:
        camera = self.pipeline.calibration.camera
        size = (camera.image_height_px, camera.image_width_px)
        rest_px = self.pipeline.calibration.reference.positions_px
        self._overlay = Overlay(size, camera.project, rest_px)
