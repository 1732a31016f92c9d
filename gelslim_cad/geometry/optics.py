"""Cross-section of this finger's guide and gel: one source for CAD, certificate and tracer."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera
from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.guide.shapes import CurvedGuide, GelSection, MirrorGuide, curved_profile


def gel_section(d: Lookup) -> GelSection:
    """The pad in the plane x = 0, in the sensor frame's y and z."""
    gel = GelShape.of(d)
    rise = -float(gel.surface_z_mm(0.0, gel.width_mm / 2))
    return GelSection(gel.width_mm, gel.thickness_mm - rise, rise)


def curved_guide(d: Lookup) -> CurvedGuide:
    """The finger's own guide."""
    return CurvedGuide(
        flat_width_mm=d["guide.flat_width_mm"],
        thickness_mm=d["design.light_guide.thickness_mm"],
        inner_radius_mm=d["guide.inner_radius_mm"],
        leg_mm=d["design.light_guide.leg_length_mm"],
        window_top_z_mm=d["stack.gel_bottom_z_mm"],
    )


def guide_profile(d: Lookup) -> GuideProfile:
    """Make the cross-section of guide and gel, with exact arcs.

    Args:
        d: Dimensions of the finger.

    Returns:
        The edges in the sensor frame's y and z, in mm.
    """
    return curved_profile(curved_guide(d), gel_section(d))


def straight_guide(d: Lookup) -> MirrorGuide:
    """A guide of the GelSlim 1 type for the same gel: as long a leg, a mirror for each bend.

    Without a bend its LEDs sit higher by R, which is to its favour.
    """
    return MirrorGuide(
        flat_width_mm=d["guide.flat_width_mm"],
        thickness_mm=d["design.light_guide.thickness_mm"],
        leg_mm=d["design.light_guide.leg_length_mm"],
        window_top_z_mm=d["stack.gel_bottom_z_mm"],
    )


def virtual_camera(d: Lookup) -> VirtualCamera:
    """Make the camera of the solved fold, which looks through window and gel.

    Args:
        d: Dimensions of the finger.

    Returns:
        The camera as it is seen in the fold mirror.
    """
    lens = lens_distortion(d)
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
        lens=lens if lens.distorts else None,
    )


def corner_rays(d: Lookup) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Virtual pinhole (3,), and the points (4, 3) where the corner rays meet mirror and window."""
    camera = virtual_camera(d)
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], dtype=float)
    rays = camera.air_directions(corners)
    angle = math.radians(d["mirror.angle_deg"])
    normal = np.array([-math.sin(angle), 0, math.cos(angle)])
    on_mirror = np.array([d["mirror.lower_x_mm"], 0, d["mirror.lower_z_mm"]])
    start = camera.position_mm
    to_mirror = ((on_mirror - start) @ normal) / (rays @ normal)
    to_window = (camera.window_bottom_z_mm - start[2]) / rays[:, 2]
    return start, start + rays * to_mirror[:, None], start + rays * to_window[:, None]


def lens_distortion(d: Lookup) -> LensDistortion:
    """The distortion of the lens as the spec gives it."""
    wide = d["camera.distortion.model"] == "kannala_brandt"
    return LensDistortion(
        k1=d["view.distortion_k1"],
        k2=d["camera.distortion.k2"],
        p1=d["camera.distortion.p1"],
        p2=d["camera.distortion.p2"],
        k3=d["camera.distortion.k3"],
        k4=d["camera.distortion.k4"],
        model="kannala_brandt" if wide else "brown",
    )


def camera_record(d: Lookup) -> dict[str, object]:
    """The virtual camera as plain values for the bundle; lengths mm, angles as unit vectors."""
    return {
        **virtual_camera(d).to_record(),
        "picture": d["camera.picture"],
        "aperture_mm": d["view.aperture_mm"],
        "focus_mm": d["view.focus_mm"],
    }
