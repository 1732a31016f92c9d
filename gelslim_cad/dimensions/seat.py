"""The camera's seat in its clamp: three points before it, two at its side, and two leaf springs.

Rigid points touch the module's front face (three), its side (two) and its floor (one). Two leaf
springs behind the module press it against them; that at +y touches the module's rear edge under
45°, so that it also presses the module to the side. Printed without the camera they stand
forward by their deflection.
"""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.fold.housing import (
    CLAMP_BAR_MM,
    CLAMP_LIP_MM,
    LIP_GAP_MM,
    clamp_floor_mm,
)
from gelslim_cad.dimensions.registry import Real, dimension

FLATNESS_MM = {"sla": 0.05, "fdm": 0.1, "sls": 0.1}
"""Accuracy of a short printed face by process."""
STRAIN = {"sla": 0.010, "fdm": 0.006, "sls": 0.015}
"""Lasting strain of a printed leaf spring by process, our choice: below half of what guides to snap
fits allow for a short time, since a spring under strain creeps; the layers of `fdm` lie across."""
MODULUS_MPA = 2200.0
"""Young's modulus of printed plastics: tough resins, PETG and PA12 have 1.6 to 2.7 GPa."""
LEAST_PRELOAD_MM = 0.1
"""Deflection of a spring that the least favourable print leaves."""
MOST_SPRING_MM = 1.1
LONGEST_SPRING_MM = 8.0
LEAST_SPRING_MM = 0.5
"""Thinnest spring that is printed."""
POINT_MM = 1.0
"""Width of a point, which stands half of it inside the edge of the face that it touches."""
LEAST_LIP_MM = 0.4
LEAST_SPAN_MM = 2.0
LEAST_BASE_MM = 1.0
LEAST_DEPTH_MM = 2.5
LEAST_PRESSED_MM = 0.04
"""Of the module's rear face beside the cable and its gap, for a spring to meet it at all."""
CABLE_GAP_MM = 0.3
"""From the cable to the clamp, where the cable lies behind or under the module."""


@dimension("clamp.lip_mm", formula="min(1.2, lens height - play - 0.2)")
def clamp_lip_mm(
    camera_pose_face_mm: Real, camera_pose_lens_front_mm: Real, clamp_play_mm: Real
) -> Real:
    """Thickness of the clamp's lips before the module, behind the front of the lens."""
    proud = camera_pose_face_mm + camera_pose_lens_front_mm
    return np.minimum(CLAMP_LIP_MM, proud - clamp_play_mm - LIP_GAP_MM)


@dimension("clamp.span_up_mm", formula="lens radius + module height / 2 - point width")
def clamp_span_up_mm(camera_lens_diameter_mm: Real, camera_module_height_mm: Real) -> Real:
    """Distance of the points before the module across the finger's thickness."""
    return camera_lens_diameter_mm / 2 + camera_module_height_mm / 2 - POINT_MM


@dimension("clamp.span_across_mm", formula="lens radius + play + module width / 2")
def clamp_span_across_mm(
    camera_lens_diameter_mm: Real, clamp_play_mm: Real, camera_module_width_mm: Real
) -> Real:
    """Distance of the points before the module across the finger, beside the lens."""
    return camera_lens_diameter_mm / 2 + clamp_play_mm + camera_module_width_mm / 2


@dimension("clamp.point_error_mm", formula="flatness of the print, given or by its process")
def clamp_point_error_mm(
    tolerance_print_flatness_mm: Real | None, manufacturing_print_process: str
) -> Real:
    """Error of the height of a printed point."""
    if tolerance_print_flatness_mm is None:
        return FLATNESS_MM[manufacturing_print_process]
    return tolerance_print_flatness_mm


@dimension("clamp.spring_length_mm", formula="min(3/4 module height + play, 8)")
def clamp_spring_length_mm(camera_module_height_mm: Real, clamp_play_mm: Real) -> Real:
    """Free length L of a leaf spring from its root to the point where it presses."""
    return np.minimum(0.75 * camera_module_height_mm + clamp_play_mm, LONGEST_SPRING_MM)


@dimension("clamp.spring_deflection_mm", formula="δ = 0.1 + print tolerance")
def clamp_spring_deflection_mm(manufacturing_print_tolerance_mm: Real) -> Real:
    """Deflection of a leaf spring by the camera; at least 0.1 mm stay when the print is off."""
    return LEAST_PRELOAD_MM + manufacturing_print_tolerance_mm


@dimension(
    "clamp.spring_mm",
    formula="t = min(1.1, ε L² / (1.5 (δ + tolerance)))",
    source="cantilever with an end load: ε = 3 t δ / (2 L²)",
)
def clamp_spring_mm(
    clamp_spring_length_mm: Real,
    clamp_spring_deflection_mm: Real,
    manufacturing_print_tolerance_mm: Real,
    manufacturing_print_process: str,
) -> Real:
    """Thickness of the leaf springs: the largest that keeps the strain of the process."""
    most = clamp_spring_deflection_mm + manufacturing_print_tolerance_mm
    allowed = STRAIN[manufacturing_print_process] * clamp_spring_length_mm**2 / (1.5 * most)
    return np.minimum(MOST_SPRING_MM, allowed)


@dimension("clamp.strain_percent", formula="ε = 3 t (δ + tolerance) / (2 L²)")
def clamp_strain_percent(
    clamp_spring_mm: Real,
    clamp_spring_deflection_mm: Real,
    manufacturing_print_tolerance_mm: Real,
    clamp_spring_length_mm: Real,
) -> Real:
    """Strain at the root of a leaf spring, the print at the end of its tolerance."""
    most = clamp_spring_deflection_mm + manufacturing_print_tolerance_mm
    return 100 * 1.5 * clamp_spring_mm * most / clamp_spring_length_mm**2


@dimension("clamp.spring_width_mm", formula="cheek + 1, or less beside a wide cable")
def clamp_spring_width_mm(
    camera_module_width_mm: Real,
    camera_cable_width_mm: Real,
    clamp_width_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Real:
    """Width of a leaf spring, between the cable and the outside of the clamp."""
    inner = np.maximum(
        camera_cable_width_mm / 2 + housing_fit_clearance_mm,
        camera_module_width_mm / 2 - POINT_MM,
    )
    return clamp_width_mm / 2 - inner


@dimension("clamp.preload_n", formula="2 E b t³ δ / (4 L³) at the least deflection")
def clamp_preload_n(
    clamp_spring_mm: Real, clamp_spring_width_mm: Real, clamp_spring_length_mm: Real
) -> Real:
    """Least force of the two leaf springs on the camera."""
    inertia = clamp_spring_width_mm * np.maximum(clamp_spring_mm, 0.0) ** 3 / 12
    return 2 * 3 * MODULUS_MPA * inertia * LEAST_PRELOAD_MM / clamp_spring_length_mm**3


@dimension(
    "clamp.base_mm",
    formula="floor over the cover at the clamp's front or rear, the lower of both",
)
def clamp_base_mm(
    camera_pose_z_mm: Real,
    camera_pose_pitch_deg: Real,
    camera_pose_face_mm: Real,
    camera_module_depth_mm: Real,
    camera_module_height_mm: Real,
    clamp_play_mm: Real,
    cover_top_z_mm: Real,
) -> Real:
    """Thickness of what joins springs and cheeks under the module."""
    p = np.radians(camera_pose_pitch_deg)
    below = camera_module_height_mm / 2 + clamp_play_mm
    back = camera_pose_face_mm + camera_module_depth_mm + clamp_play_mm + CLAMP_BAR_MM
    return clamp_floor_mm(
        camera_pose_z_mm, np.cos(p), np.sin(p), camera_pose_face_mm, back, below, cover_top_z_mm
    )


@dimension(
    "clamp.preloaded",
    formula="1 where it is wanted, and lips, points, springs and base have room, else 0",
)
def clamp_preloaded(
    housing_camera_seat: str,
    clamp_lip_mm: Real,
    clamp_span_up_mm: Real,
    camera_module_width_mm: Real,
    camera_module_depth_mm: Real,
    camera_lens_diameter_mm: Real,
    clamp_play_mm: Real,
    clamp_spring_mm: Real,
    clamp_spring_width_mm: Real,
    clamp_base_mm: Real,
    camera_cable_width_mm: Real,
    camera_cable_exit: str,
    housing_fit_clearance_mm: Real,
) -> Real:
    """Whether springs press the camera against three points.

    A cable comes down between the springs, which meet the rear face beside it. One that leaves at
    the top stays above them, and is as wide as the module at most.
    """
    beside_cable = (camera_module_width_mm - camera_cable_width_mm) / 2
    least = housing_fit_clearance_mm + LEAST_PRESSED_MM
    pressed = np.where(camera_cable_exit == "top", 0.0, least)
    beside = camera_module_width_mm / 2 - camera_lens_diameter_mm / 2 - clamp_play_mm
    room = (
        (housing_camera_seat == "preloaded")
        & (clamp_lip_mm > LEAST_LIP_MM)
        & (beside > LEAST_LIP_MM)
        & (clamp_span_up_mm >= LEAST_SPAN_MM)
        & (camera_module_depth_mm >= LEAST_DEPTH_MM)
        & (clamp_spring_mm >= LEAST_SPRING_MM)
        & (clamp_spring_width_mm >= POINT_MM)
        & (beside_cable >= pressed)
        & (clamp_base_mm >= LEAST_BASE_MM)
    )
    return np.where(room, 1.0, 0.0)[()]


@dimension(
    "clamp.pitch_tilt_deg", formula="2 e / span of the points, or 2 play / height in a loose clamp"
)
def clamp_pitch_tilt_deg(
    clamp_preloaded: Real,
    clamp_point_error_mm: Real,
    clamp_span_up_mm: Real,
    clamp_play_mm: Real,
    camera_module_height_mm: Real,
) -> Real:
    """Largest pitch of the camera in its clamp, as it falls into it."""
    loose = 2 * clamp_play_mm / camera_module_height_mm
    seated = 2 * clamp_point_error_mm / np.maximum(clamp_span_up_mm, 0.1)
    return np.degrees(np.where(clamp_preloaded > 0, seated, loose))[()]


@dimension(
    "clamp.yaw_tilt_deg", formula="2 e / span of the points, or 2 play / width in a loose clamp"
)
def clamp_yaw_tilt_deg(
    clamp_preloaded: Real,
    clamp_point_error_mm: Real,
    clamp_span_across_mm: Real,
    clamp_play_mm: Real,
    camera_module_width_mm: Real,
) -> Real:
    """Largest yaw of the camera in its clamp."""
    loose = 2 * clamp_play_mm / camera_module_width_mm
    seated = 2 * clamp_point_error_mm / clamp_span_across_mm
    return np.degrees(np.where(clamp_preloaded > 0, seated, loose))[()]


@dimension(
    "clamp.roll_tilt_deg", formula="2 e / span of the side points, or 2 play / height when loose"
)
def clamp_roll_tilt_deg(
    clamp_preloaded: Real,
    clamp_point_error_mm: Real,
    clamp_play_mm: Real,
    camera_module_height_mm: Real,
) -> Real:
    """Largest roll of the camera in its clamp."""
    loose = 2 * clamp_play_mm / camera_module_height_mm
    span = np.maximum(camera_module_height_mm - 2 * POINT_MM, 0.1)
    return np.degrees(np.where(clamp_preloaded > 0, 2 * clamp_point_error_mm / span, loose))[()]


@dimension("clamp.tilt_deg", formula="max(pitch, yaw, roll)")
def clamp_tilt_deg(
    clamp_pitch_tilt_deg: Real, clamp_yaw_tilt_deg: Real, clamp_roll_tilt_deg: Real
) -> Real:
    """Largest residual tilt of the camera in its clamp."""
    return np.maximum(np.maximum(clamp_pitch_tilt_deg, clamp_yaw_tilt_deg), clamp_roll_tilt_deg)
