"""The folded pinhole: straight rays, no lens errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera


def apply(record: Mapping[str, Any]) -> VirtualCamera:
    """The camera of a bundle's record with every layer as air and a perfect lens.

    Raises ValueError for a record that is none.
    """
    camera = VirtualCamera.from_record(record)
    air = tuple(Layer(layer.thickness_mm, 1.0) for layer in camera.layers)
    return replace(camera, layers=air, lens=None)
