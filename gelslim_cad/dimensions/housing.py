"""The printed finger around the optics: ledge, channels, cover, chamber, mount."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.cable import LANE_GAP_MM
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.fold.housing import (
    LEDGE_GAP_MM,
    SEAT_STOP_MM,
    clamp_ends_x_mm,
    lip_front_mm,
)
from gelslim_cad.dimensions.fold.housing import (
    clamp_front_x_mm as foremost_of_clamp_mm,
)
from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.fasteners import SCREWS

CLAMP_CHEEK_MM = 3.5
COVER_TAB_MM = 4.0
"""Least; a larger screw needs its head and 0.4 mm of cover on both sides."""
TONGUE_LEAST_MM = 2.5
"""Least width of a tongue."""
GROOVE_WALL_MM = 1.1
"""Plastic between the cable's groove and the slot of a tongue."""
BEAM_MM = 2.0
MOUNT_WALL_MM = 1.5


@dimension("shim.compressed_mm", formula="free thickness - precompression")
def shim_compressed_mm(housing_shim_thickness_mm: Real, housing_precompression_mm: Real) -> Real:
    """Shim thickness once the bezel is screwed down."""
    return housing_shim_thickness_mm - housing_precompression_mm


@dimension("ledge.depth_mm", formula="compressed shim + ledge")
def ledge_depth_mm(shim_compressed_mm: Real, housing_ledge_mm: Real) -> Real:
    """How far the ledge under the window's ends reaches down."""
    return shim_compressed_mm + housing_ledge_mm


@dimension("ledge.reach_mm", formula="end support + fit + beam under the roof's edge")
def ledge_reach_mm(light_guide_end_support_mm: Real, housing_fit_clearance_mm: Real) -> Real:
    """How far ledge and beam reach from the ledge's edge towards the camera."""
    return light_guide_end_support_mm + housing_fit_clearance_mm + BEAM_MM


@dimension("ledge.edge_x_mm", formula="min(-L/2 - 0.2, near ray at the ledge's foot - clearance)")
def ledge_edge_x_mm(fold_layout: Fold) -> Real:
    """Edge of the proximal ledge, outside the camera's view."""
    return fold_layout.ledge_edge_x_mm


@dimension(
    "ledge.distal_x_mm",
    formula="L/2 + 0.2, or the mirror's rear edge + fit where it reaches up to the ledge",
)
def ledge_distal_x_mm(
    gel_length_mm: Real,
    mirror_rear_x_mm: Real,
    mirror_upper_z_mm: Real,
    stack_window_bottom_z_mm: Real,
    ledge_depth_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Real:
    """Edge of the ledge under the window's tip end."""
    fit = housing_fit_clearance_mm
    beside = mirror_upper_z_mm > stack_window_bottom_z_mm - ledge_depth_mm - fit
    clear = np.where(beside, mirror_rear_x_mm + fit, -np.inf)
    return np.maximum(gel_length_mm / 2 + LEDGE_GAP_MM, clear)


@dimension("channel.inner_y_mm", formula="flat width / 2 + R - fit")
def channel_inner_y_mm(
    guide_flat_width_mm: Real, guide_inner_radius_mm: Real, housing_fit_clearance_mm: Real
) -> Real:
    """Inner side of the LED channel, the outer face of the baffle."""
    return guide_flat_width_mm / 2 + guide_inner_radius_mm - housing_fit_clearance_mm


@dimension("channel.outer_y_mm", formula="guide outer width / 2 + fit")
def channel_outer_y_mm(guide_outer_width_mm: Real, housing_fit_clearance_mm: Real) -> Real:
    """Outer side of the LED channel, the inner face of the side wall."""
    return guide_outer_width_mm / 2 + housing_fit_clearance_mm


@dimension("baffle.inner_y_mm", formula="channel inner side - baffle thickness")
def baffle_inner_y_mm(channel_inner_y_mm: Real, housing_baffle_mm: Real) -> Real:
    """Face of the baffle towards the camera's view."""
    return channel_inner_y_mm - housing_baffle_mm


@dimension("baffle.top_z_mm", formula="window bottom - R (bend centre)")
def baffle_top_z_mm(stack_window_bottom_z_mm: Real, guide_inner_radius_mm: Real) -> Real:
    """Upper edge of the baffle, just under the bend."""
    return stack_window_bottom_z_mm - guide_inner_radius_mm


@dimension("clamp.play_mm", formula="camera play, or the fit clearance where it is not given")
def clamp_play_mm(housing_camera_play_mm: Real | None, housing_fit_clearance_mm: Real) -> Real:
    """Gap on each side of the camera in its clamp."""
    return housing_fit_clearance_mm if housing_camera_play_mm is None else housing_camera_play_mm


@dimension("clamp.width_mm", formula="module width + 2 (play + cheek)")
def clamp_width_mm(camera_module_width_mm: Real, clamp_play_mm: Real) -> Real:
    """Camera clamp across the finger."""
    return camera_module_width_mm + 2 * (clamp_play_mm + CLAMP_CHEEK_MM)


@dimension("bezel.thickness_mm", formula="gel total - proud")
def bezel_thickness_mm(stack_gel_total_mm: Real, housing_gel_proud_mm: Real) -> Real:
    """Thickness of the bezel plate between acrylic and outside."""
    return stack_gel_total_mm - housing_gel_proud_mm


@dimension("bezel.proximal_x_mm", formula="guide end - fit - tip wall")
def bezel_proximal_x_mm(
    guide_proximal_end_x_mm: Real, housing_fit_clearance_mm: Real, housing_tip_wall_mm: Real
) -> Real:
    """Gripper end of the bezel, which is screwed to the roof there."""
    return guide_proximal_end_x_mm - housing_fit_clearance_mm - housing_tip_wall_mm


@dimension("finger.depth_mm", formula="max(mirror, camera + clearance, guide stack)")
def finger_depth_mm(fold_layout: Fold) -> Real:
    """Depth below the window that mirror, camera and guide need."""
    return fold_layout.depth_mm


@dimension("finger.mirror_depth_mm", formula="window bottom - lowest corner of the mirror")
def finger_mirror_depth_mm(fold_layout: Fold) -> Real:
    """Depth below the window that the mirror needs."""
    return fold_layout.mirror_depth_mm


@dimension("finger.camera_depth_mm", formula="window bottom - lowest corner of the housing + gap")
def finger_camera_depth_mm(fold_layout: Fold) -> Real:
    """Depth below the window that the camera needs."""
    return fold_layout.camera_depth_mm


@dimension(
    "finger.thickness_mm",
    formula="T = back wall + depth + guide thickness + gel total",
    source="docs/physics.md#camera-and-fold",
)
def finger_thickness_mm(
    housing_back_wall_mm: Real,
    finger_depth_mm: Real,
    light_guide_thickness_mm: Real,
    stack_gel_total_mm: Real,
) -> Real:
    """Finger thickness from the back to the gel's outer surface."""
    return housing_back_wall_mm + finger_depth_mm + light_guide_thickness_mm + stack_gel_total_mm


@dimension(
    "finger.width_mm",
    formula="2 · max(channel outer side, LED wires beside the clamp + 0.15) + 2 side wall",
)
def finger_width_mm(
    channel_outer_y_mm: Real,
    wire_run_y_mm: Real,
    leds_wire_diameter_mm: Real,
    housing_side_wall_mm: Real,
) -> Real:
    """Finger width."""
    wires = wire_run_y_mm + leds_wire_diameter_mm / 2 + LANE_GAP_MM
    return 2 * (np.maximum(channel_outer_y_mm, wires) + housing_side_wall_mm)


@dimension("finger.tip_x_mm", formula="guide tip end + fit + strip at the tip + tip wall")
def finger_tip_x_mm(
    guide_distal_end_x_mm: Real,
    housing_fit_clearance_mm: Real,
    led_tip_depth_mm: Real,
    housing_tip_wall_mm: Real,
) -> Real:
    """Tip of the finger."""
    behind_guide = guide_distal_end_x_mm + housing_fit_clearance_mm
    return behind_guide + led_tip_depth_mm + housing_tip_wall_mm


@dimension("cover.top_z_mm", formula="-T + back wall")
def cover_top_z_mm(finger_thickness_mm: Real, housing_back_wall_mm: Real) -> Real:
    """Inner face of the back cover."""
    return housing_back_wall_mm - finger_thickness_mm


@dimension(
    "clamp.rear_x_mm", formula="rearmost of the clamp's bar, at its foot on the cover or at its top"
)
def clamp_rear_x_mm(
    camera_pose_x_mm: Real,
    camera_pose_z_mm: Real,
    camera_pose_pitch_deg: Real,
    camera_pose_face_mm: Real,
    camera_module_depth_mm: Real,
    camera_module_height_mm: Real,
    clamp_play_mm: Real,
    cover_top_z_mm: Real,
) -> Real:
    """Rearmost point of the camera clamp, which is pitched with the camera."""
    pitch = np.radians(camera_pose_pitch_deg)
    back = camera_pose_face_mm + camera_module_depth_mm + clamp_play_mm
    ends = clamp_ends_x_mm(
        camera_pose_x_mm,
        camera_pose_z_mm,
        np.cos(pitch),
        np.sin(pitch),
        back,
        camera_module_height_mm / 2,
        cover_top_z_mm,
    )
    return np.minimum(*ends)


@dimension(
    "clamp.front_x_mm", formula="foremost of the clamp's lips between the cover and the mirror"
)
def clamp_front_x_mm(
    camera_pose_x_mm: Real,
    camera_pose_z_mm: Real,
    camera_pose_pitch_deg: Real,
    camera_pose_face_mm: Real,
    camera_pose_lens_front_mm: Real,
    clamp_play_mm: Real,
    cover_top_z_mm: Real,
    mirror_lower_z_mm: Real,
) -> Real:
    """Foremost point of the camera clamp beside the mirror's seat."""
    pitch = np.radians(camera_pose_pitch_deg)
    proud = camera_pose_face_mm + camera_pose_lens_front_mm
    return foremost_of_clamp_mm(
        camera_pose_x_mm,
        camera_pose_z_mm,
        np.cos(pitch),
        np.sin(pitch),
        lip_front_mm(camera_pose_face_mm, proud, clamp_play_mm),
        cover_top_z_mm,
        mirror_lower_z_mm,
    )


@dimension("mirror.seat_x_mm", formula="mirror's lower end - stop")
def mirror_seat_x_mm(mirror_lower_x_mm: Real) -> Real:
    """Gripper end of the mirror's seat."""
    return mirror_lower_x_mm - SEAT_STOP_MM


@dimension("chamber.rear_x_mm", formula="rear of clamp and camera - room for cable and wires - fit")
def chamber_rear_x_mm(
    camera_pose_rear_x_mm: Real,
    clamp_rear_x_mm: Real,
    bezel_proximal_x_mm: Real,
    cable_behind_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Real:
    """Rear wall of the camera chamber."""
    rear = np.minimum(camera_pose_rear_x_mm, clamp_rear_x_mm)
    behind = cable_behind_mm + housing_fit_clearance_mm
    return np.minimum(rear - behind, bezel_proximal_x_mm - 1.0)


@dimension("cover.tab_mm", formula="max(4, screw head + 0.8)")
def cover_tab_mm(housing_screw: str) -> Real:
    """How far the cover reaches under the mount block, where it is screwed to it."""
    return np.maximum(COVER_TAB_MM, SCREWS[housing_screw].countersunk_head_mm + 0.8)


@dimension("mount.length_mm", formula="max(tongue + fit + wall, bolt head + 2.4 + gap + cover tab)")
def mount_length_mm(
    mount_tongue_length_mm: Real,
    housing_fit_clearance_mm: Real,
    mount_bolt: str,
    cover_tab_mm: Real,
) -> Real:
    """Solid block behind the camera chamber that takes the tongues."""
    head_mm = SCREWS[mount_bolt].cap_head_mm
    return np.maximum(
        mount_tongue_length_mm + housing_fit_clearance_mm + MOUNT_WALL_MM,
        head_mm + 2.4 + 0.8 + cover_tab_mm,
    )


@dimension("finger.proximal_x_mm", formula="chamber rear - mount length")
def finger_proximal_x_mm(chamber_rear_x_mm: Real, mount_length_mm: Real) -> Real:
    """Gripper end of the body."""
    return chamber_rear_x_mm - mount_length_mm


@dimension("finger.length_mm", formula="tip - gripper end (flange not counted)")
def finger_length_mm(finger_tip_x_mm: Real, finger_proximal_x_mm: Real) -> Real:
    """Overall length of the finger."""
    return finger_tip_x_mm - finger_proximal_x_mm


@dimension("tongue.inner_y_mm", formula="half the cable's groove + wall + fit")
def tongue_inner_y_mm(cable_slot_half_mm: Real, housing_fit_clearance_mm: Real) -> Real:
    """Inner side of the mount tongues, beside the cable's groove."""
    return cable_slot_half_mm + GROOVE_WALL_MM + housing_fit_clearance_mm


@dimension("tongue.outer_y_mm", formula="finger width / 2 - side wall - fit")
def tongue_outer_y_mm(
    finger_width_mm: Real, housing_side_wall_mm: Real, housing_fit_clearance_mm: Real
) -> Real:
    """Outer side of the mount tongues."""
    return finger_width_mm / 2 - housing_side_wall_mm - housing_fit_clearance_mm


@dimension("tongue.z_mm", formula="middle of the mount block")
def tongue_z_mm(finger_thickness_mm: Real, housing_gel_proud_mm: Real) -> Real:
    """Mid-plane of the mount tongues."""
    return -(finger_thickness_mm + housing_gel_proud_mm) / 2
