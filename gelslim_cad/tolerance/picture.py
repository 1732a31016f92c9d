"""Pictures of built fingers: exact refraction at flat layers, for n cameras and m points at once.

The layers stay parallel to the gel, so that each mirrored camera is a general pinhole camera below
them. Positions on the sensor are in mm from its middle, u to the right and v down.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.tolerance.built import Built
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.refraction_newton import newton_slope

Array = NDArray[np.float64]
LEAST_FORWARD = 1e-2
"""A ray is taken to have this component along the axis at least, so that no picture is infinite."""
STEP_MM = 0.01


class Rays(NamedTuple):
    """Rays in air from n mirrored cameras to m points of the gel's surface, each (n, m)."""

    slope_x: Array
    slope_y: Array
    right: Array
    """Components along the camera's axes, for a unit component along z."""
    down: Array
    forward: Array


def rays(built: Built, x_mm: Array, y_mm: Array) -> Rays:
    """The rays to points (n, m) of the outer surface."""
    dx = x_mm - built.position_mm[:, :1]
    dy = y_mm - built.position_mm[:, 1:2]
    reach = np.hypot(dx, dy)
    per_mm = newton_slope(reach, built.heights_mm, built.indices) / np.maximum(reach, 1e-12)
    sx, sy = dx * per_mm, dy * per_mm
    right, down, forward = (
        sx * a[:, :1] + sy * a[:, 1:2] + a[:, 2:] for a in np.moveaxis(built.axes, 1, 0)
    )
    return Rays(sx, sy, right, down, np.maximum(forward, LEAST_FORWARD))


def on_sensor(built: Built, ray: Rays) -> tuple[Array, Array]:
    """Positions u and v (n, m) on the sensor, in mm, distorted as the lens of the spec does."""
    x, y = _distorted(built.lens, ray.right / ray.forward, ray.down / ray.forward)
    scale, (u, v) = built.image_mm[:, None], built.principal_mm.T[:, :, None]
    return scale * x + u, scale * y + v


def _distorted(lens: LensDistortion, x: Array, y: Array) -> tuple[Array, Array]:
    """Coordinates in image distances; beyond the lens's valid radius they grow in proportion."""
    if not lens.distorts:
        return x, y
    beyond = np.maximum(1.0, np.hypot(x, y) / (0.999 * lens.monotone_radius))
    seen = lens.distort(np.stack([x / beyond, y / beyond], axis=-1))
    return seen[..., 0] * beyond, seen[..., 1] * beyond


def image_distances_mm(built: Built, ray: Rays) -> tuple[Array, Array]:
    """Distances (n, m) along the axis of the sagittal and the tangential images of the points.

    Coddington's equations at plane faces, as `fold.focus.seen_point` has them.
    """
    cos_squared = 1 / (1 + ray.slope_x**2 + ray.slope_y**2)
    sagittal = tangential = np.zeros_like(cos_squared)
    for height, index in zip(built.heights_mm, built.indices, strict=True):
        inside_squared = 1 - (1 - cos_squared) / index**2
        path = height / (index * np.sqrt(inside_squared))
        sagittal = sagittal + path
        tangential = tangential + path * cos_squared / inside_squared
    off_axis = ray.forward * np.sqrt(cos_squared)
    return sagittal * off_axis, tangential * off_axis


def blur_mm(built: Built, sagittal_mm: Array, tangential_mm: Array) -> Array:
    """Blur A |Z - s| / s (n, m) on the gel, by the image that is less sharp."""
    focus = built.focus_mm[:, None]
    off = np.maximum(np.abs(sagittal_mm - focus), np.abs(tangential_mm - focus))
    return built.aperture_mm[:, None] * off / focus


def scales(built: Built, x_mm: Array, y_mm: Array) -> tuple[Array, Array]:
    """Least scale (n, m) of the picture at points, and the root of its change of area.

    Both are lengths on the sensor per length on the gel, by central differences.
    """
    h = STEP_MM
    ends = [
        on_sensor(built, rays(built, x_mm + sx * h, y_mm + sy * h))
        for sx, sy in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    (xu, xv), (yu, yv) = (
        ((a[0] - b[0]) / (2 * h), (a[1] - b[1]) / (2 * h)) for a, b in (ends[:2], ends[2:])
    )
    area = np.abs(xu * yv - xv * yu)
    half_sum = (xu**2 + xv**2 + yu**2 + yv**2) / 2
    least = half_sum - np.sqrt(np.maximum(half_sum**2 - area**2, 0.0))
    return np.sqrt(np.maximum(least, 0.0)), np.sqrt(area)
