"""Rules on the joint to the gripper and on the camera's cable."""

from __future__ import annotations

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.housing import TONGUE_ROOM_MM
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.geometry.fasteners import SCREWS


@rule(
    "mount.bolt_mm",
    title="Mount tongues are wide enough for their bolts",
    parameter="design.mount.bolt",
    why="a tongue needs 1.5 mm of material on both sides of its hole",
    advice="use a smaller bolt or a narrower cable",
)
def mount_bolt(tongue_inner_y_mm: Real, tongue_outer_y_mm: Real, mount_bolt: str) -> Finding:
    """Width of the tongue minus the diameter of the hole."""
    width = tongue_outer_y_mm - tongue_inner_y_mm
    return Finding(width - SCREWS[mount_bolt].clearance_mm, 3.0, least=True)


@rule(
    "mount.head_mm",
    title="Bolt heads stay inside the mount block",
    parameter="design.mount.bolt",
    why="the sunk head must not break out at the side",
    advice="use a smaller bolt",
)
def mount_head(tongue_inner_y_mm: Real, tongue_outer_y_mm: Real, mount_bolt: str) -> Finding:
    """Half the width of the tongue minus half the diameter of the head."""
    half = (tongue_outer_y_mm - tongue_inner_y_mm) / 2
    return Finding(half - SCREWS[mount_bolt].cap_head_mm / 2, 0.0, least=True)


@rule(
    "mount.block_mm",
    title="Mount block is strong enough around its slots",
    parameter="design.mount.tongue_thickness_mm",
    why="above and below the tongue 2 mm of plastic must take the bolt's load",
    advice="use a thinner tongue",
)
def mount_block(
    finger_thickness_mm: Real,
    housing_gel_proud_mm: Real,
    mount_tongue_thickness_mm: Real,
    housing_fit_clearance_mm: Real,
) -> Finding:
    """Thickness of the material above the slot."""
    height = finger_thickness_mm - housing_gel_proud_mm
    land = (height - mount_tongue_thickness_mm) / 2 - housing_fit_clearance_mm
    return Finding(land, 2.0, least=True)


@rule(
    "mount.cover_screw_mm",
    title="Cover screws hold under the tongue slots",
    parameter="design.mount.tongue_thickness_mm",
    why="the pilot hole ends below the slot",
    advice="use a thinner tongue",
)
def mount_cover_screw(
    tongue_z_mm: Real,
    mount_tongue_thickness_mm: Real,
    housing_fit_clearance_mm: Real,
    cover_top_z_mm: Real,
) -> Finding:
    """Depth of the pilot hole."""
    slot = tongue_z_mm - mount_tongue_thickness_mm / 2 - housing_fit_clearance_mm
    return Finding(slot - cover_top_z_mm - 0.6, 1.5, least=True)


@rule(
    "mount.tongue_mm",
    title="Tongue reaches past its bolt",
    parameter="design.mount.tongue_length_mm",
    why="the bolt's hole needs 1.2 mm of tongue beyond it",
    advice="lengthen the tongue or use a smaller bolt",
)
def mount_tongue(mount_tongue_length_mm: Real, mount_bolt: str) -> Finding:
    """Length of the tongue beyond the hole."""
    size = SCREWS[mount_bolt]
    centre = size.cap_head_mm / 2 + 1.2
    return Finding(mount_tongue_length_mm - centre - size.clearance_mm / 2, 1.2, least=True)


@rule(
    "cable.bend_mm",
    title="Room for the cable's bend",
    parameter="camera.cable_bend_radius_mm",
    why="a sharper bend breaks the flat cable",
    advice="the chamber follows the bend radius; report this as a fault",
)
def cable_bend(
    camera_pose_rear_x_mm: Real, chamber_rear_x_mm: Real, camera_cable_bend_radius_mm: Real
) -> Finding:
    """Length of the chamber behind the camera against the bend radius of the cable."""
    room = camera_pose_rear_x_mm - chamber_rear_x_mm
    return Finding(room, camera_cable_bend_radius_mm, least=True)


@rule(
    "cable.slot_mm",
    title="Cable passes between the tongues",
    parameter="camera.cable_width_mm",
    why="the cable leaves through the middle of the mount",
    advice="use a narrower cable or a wider finger",
)
def cable_slot(camera_cable_width_mm: Real, tongue_outer_y_mm: Real) -> Finding:
    """Half the cable, with gap and tongue beside it, against the outer side of the tongues."""
    return Finding(camera_cable_width_mm / 2 + TONGUE_ROOM_MM, tongue_outer_y_mm)
