"""The lens's distortion: from the spec to what fold and virtual camera compute with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.names import Name
from gelslim_cad.spec.distortion import k1_of_tv
from gelslim_optics.camera.radial_scale import radial_scale, undistorted_tan

SOURCE = "docs/physics.md#distortion"
RADIAL: tuple[Name, ...] = (
    "camera.distortion.model",
    "view.distortion_k1",
    "camera.distortion.k2",
    "camera.distortion.k3",
    "camera.distortion.k4",
)
"""What `image_of` and `tangent_of` need."""


def _radial(values: Mapping[str, Any]) -> tuple[Any, ...]:
    return (is_fisheye(values[RADIAL[0]]), *(values[name] for name in RADIAL[1:]))


def is_fisheye(model: str) -> float:
    """1 for the model of Kannala and Brandt, 0 for Brown's."""
    return float(model == "kannala_brandt")


def image_of(values: Mapping[str, Any], tangent: Real) -> Real:
    """Where the ray at this tangent from the axis is drawn, in image distances."""
    scale: Real = radial_scale(np.square(tangent), *_radial(values))[0]
    return tangent * scale


def tangent_of(values: Mapping[str, Any], image: Real) -> Real:
    """The tangent of the ray that is drawn so far from the axis, in image distances."""
    found: Real = undistorted_tan(image, *_radial(values))
    return found


@dimension(
    "view.distortion_k1",
    formula="k1; of a TV distortion D: D / (X² - D Y²), X and Y half the picture's sides over v",
    source=SOURCE,
)
def view_distortion_k1(
    camera_distortion_k1: Real,
    camera_distortion_tv_percent: Real | None,
    camera_focusing: str,
    camera_horizontal_fov_deg: Real | None,
    camera_sensor_width_mm: Real,
    camera_sensor_height_mm: Real,
    view_sheet_image_mm: Real,
) -> Real:
    """First radial coefficient of the lens's distortion."""
    if camera_distortion_tv_percent is None:
        return camera_distortion_k1
    side = camera_sensor_width_mm / 2 / view_sheet_image_mm
    if camera_focusing == "internal" and camera_horizontal_fov_deg is not None:
        side = np.tan(np.radians(camera_horizontal_fov_deg) / 2)
    height = side * camera_sensor_height_mm / camera_sensor_width_mm
    return k1_of_tv(camera_distortion_tv_percent, side, height)


@dimension(
    "view.corner_tan",
    formula="r of r g(r²) = half the sensor's diagonal / v, the lens focused on infinity",
    source=SOURCE,
    inputs=(
        *RADIAL,
        "camera.sensor_width_mm",
        "camera.sensor_height_mm",
        "camera.focal_length_mm",
        "view.fixed_image_mm",
    ),
)
def view_corner_tan(values: Mapping[str, Any]) -> Real:
    """Tangent of the ray to the sensor's corner, as far as the distortion is known."""
    fixed = values["view.fixed_image_mm"]
    image_mm = np.where(np.greater(fixed, 0), fixed, values["camera.focal_length_mm"])
    half = np.hypot(values["camera.sensor_width_mm"], values["camera.sensor_height_mm"]) / 2
    return tangent_of(values, half / image_mm)
