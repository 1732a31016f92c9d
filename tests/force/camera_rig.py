"""A finger's camera for the force tests: strong keystone, dots two-fold in size."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera, reflect_point


def finger_view(
    tilt_deg: float = 30.0,
    height_mm: float = 22.0,
    focal_px: float = 640.0,
    aside_mm: float = 0.0,
    lens_offset_px: tuple[float, float] = (0.0, 0.0),
):
    """VGA camera tilted by `tilt_deg` from the gel's normal, looking at the gel's middle.

    It may stand aside in y, and its lens may be off the picture's middle.
    """
    tilt = math.radians(tilt_deg)
    mirror_angle = math.radians(32)
    mirror = np.array([-2.0, 0.0, -14.3])
    normal = np.array([-math.sin(mirror_angle), 0.0, math.cos(mirror_angle)])
    virtual = np.array([-(height_mm + 3.1) * math.tan(tilt), 0.0, -4.5 - height_mm])
    view = VirtualCamera.from_fold(
        camera_mm=reflect_point(virtual, mirror, normal),
        pitch_rad=math.pi / 2 - 2 * mirror_angle - tilt,
        mirror_point_mm=mirror,
        mirror_angle_rad=mirror_angle,
        focal_px=focal_px,
        image_width_px=640,
        image_height_px=480,
        window_bottom_z_mm=-4.5,
        layers=(Layer(2.5, 1.4906), Layer(2.0, 1.41)),
    )
    return dataclasses.replace(
        view,
        principal_offset_px=lens_offset_px,
        position_mm=view.position_mm + np.array([0.0, aside_mm, 0.0]),
    )


def off_centre_view():
    """The camera with no symmetry left: x and y, rows and columns cannot be exchanged unnoticed."""
    return finger_view(aside_mm=-0.6, lens_offset_px=(3.0, 2.0))
