"""The finger's virtual camera, from its dimensions."""

from __future__ import annotations

import math

from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera


def virtual_camera(d: Lookup) -> VirtualCamera:
    """Make the camera of the solved fold, which looks through window and gel.

    Args:
        d: Dimensions of the finger.

    Returns:
        The camera as it is seen in the fold mirror.
    """
    return VirtualCamera.from_fold(
        camera_mm=(d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]),
        pitch_rad=math.radians(d["camera_pose.pitch_deg"]),
        mirror_point_mm=(d["mirror.lower_x_mm"], 0.0, d["mirror.lower_z_mm"]),
        mirror_angle_rad=math.radians(d["mirror.angle_deg"]),
        focal_px=d["view.focal_px"],
        image_width_px=d["camera.image_width_px"],
        image_height_px=d["camera.image_height_px"],
        window_bottom_z_mm=d["stack.window_bottom_z_mm"],
        layers=(
            Layer(d["design.light_guide.thickness_mm"], d["material.acrylic.refractive_index"]),
            Layer(d["stack.gel_total_mm"], d["material.gel.refractive_index"]),
        ),
    )


def camera_record(d: Lookup) -> dict[str, object]:
    """The virtual camera as plain values for the bundle; lengths mm, angles as unit vectors."""
    return {
        **virtual_camera(d).to_record(),
        "aperture_mm": d["view.aperture_mm"],
        "focus_mm": d["view.focus_mm"],
    }
