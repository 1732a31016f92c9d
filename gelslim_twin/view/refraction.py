"""Refraction in acrylic and gel: exact, or as apparent depths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera


def apply(
    camera: VirtualCamera, record: Mapping[str, Any], rays: Literal["exact", "paraxial"] = "exact"
) -> VirtualCamera:
    """`camera` looking through the layers of `record`.

    `exact` follows every ray. `paraxial` brings the camera nearer by what the layers lift the
    gel, the sum of h (1 - 1/n), and leaves its rays straight: right for rays along the normal.
    """
    true = VirtualCamera.from_record(record)
    if rays == "exact":
        return replace(camera, layers=true.layers)
    lift = sum(v.thickness_mm * (1 - 1 / v.index) for v in true.layers)
    air = tuple(Layer(v.thickness_mm, 1.0) for v in true.layers)
    position = np.asarray(camera.position_mm) + np.array([0.0, 0.0, lift])
    return replace(camera, layers=air, position_mm=position)
