"""The lens's own distortion, by the coefficients in the sensor's record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gelslim_optics.camera.virtual_camera import VirtualCamera


def apply(camera: VirtualCamera, record: Mapping[str, Any]) -> VirtualCamera:
    """`camera` with the lens of `record`; the same where that has no distortion."""
    lens = VirtualCamera.from_record(record).lens
    return camera if lens is None else replace(camera, lens=lens)
