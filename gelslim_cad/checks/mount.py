"""Rules on the joint to the gripper and on the camera's cable."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.cable import LEAST_PLUG_MM, LEAST_ROOF_MM, OVER_COVER_MM
from gelslim_cad.dimensions.fold.housing import CHANNEL_WALL_MM, LEAST_FLOOR_MM
from gelslim_cad.dimensions.housing import TONGUE_LEAST_MM
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.dimensions.seat import CABLE_GAP_MM
from gelslim_cad.geometry.fasteners import SCREWS

OUTSIDE_MM = 10.0
LONGEST_MM = 5000.0
"""Longest cable that a spec may give, for one whose length is not given."""
LEAST_HOLD_N = 1.0
LEAST_CEILING_MM = 0.6
"""Over a cable that bends above the camera."""
MOST_TILT_DEG = 1.5
LEAST_PRELOAD_N = 0.2


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
    title="Cable and wires pass between the tongues",
    parameter="camera.cable_width_mm",
    why="the groove of cable and wires leads through the middle of the mount, and beside it a "
    "tongue is at least 2.5 mm wide",
    advice="use a narrower cable or a wider finger",
)
def cable_slot(tongue_inner_y_mm: Real, tongue_outer_y_mm: Real) -> Finding:
    """The narrowest tongue beside the groove against the outer side of the tongues."""
    return Finding(tongue_inner_y_mm + TONGUE_LEAST_MM, tongue_outer_y_mm)


@rule(
    "cable.cover_mm",
    title="Cable passes over the back cover",
    parameter="camera.cable_exit",
    why="below the camera the cable turns with its bend radius, and under the cable the plug of "
    "the cover is 0.6 mm thick",
    advice="turn the module so that its cable leaves at another side, or use a more flexible cable",
)
def cable_cover(
    cable_level_z_mm: Real,
    cable_thickness_mm: Real,
    cable_plug_z_mm: Real,
    cover_top_z_mm: Real,
    housing_back_wall_mm: Real,
) -> Finding:
    """Least of the space under the cable in the chamber and of the plug under its pad."""
    under = cable_level_z_mm - cable_thickness_mm / 2 - cover_top_z_mm - OVER_COVER_MM
    plug = cable_plug_z_mm - (cover_top_z_mm - housing_back_wall_mm) - LEAST_PLUG_MM
    return Finding(np.minimum(under, plug), 0.0, least=True)


@rule(
    "cable.roof_mm",
    title="Body is closed over the cable",
    parameter="camera.cable_exit",
    why="the groove leaves 1.2 mm of plastic, which joins the halves of the mount and keeps the "
    "light out",
    advice="turn the module so that its cable leaves at another side, or use a more flexible cable",
)
def cable_roof(
    cable_level_z_mm: Real,
    cable_thickness_mm: Real,
    wire_lane_top_z_mm: Real,
    housing_gel_proud_mm: Real,
) -> Finding:
    """Plastic between the groove's roof and the outside."""
    top = np.maximum(cable_level_z_mm + cable_thickness_mm / 2, wire_lane_top_z_mm)
    return Finding(-housing_gel_proud_mm - top, LEAST_ROOF_MM, least=True)


@rule(
    "cable.window_mm",
    title="Cable's bend above the camera stays under bezel, window and shims",
    parameter="camera.cable_bend_radius_mm",
    why="a cable that leaves at the top turns over the camera, and 0.6 mm of plastic part it from "
    "what lies above",
    advice="use a thinner or more flexible cable, or turn the module so that its cable leaves at "
    "another side (camera.cable_exit)",
)
def cable_window(
    cable_level_z_mm: Real,
    cable_bend_end_x_mm: Real,
    cable_radius_mm: Real,
    cable_thickness_mm: Real,
    camera_cable_exit: str,
    bezel_proximal_x_mm: Real,
    guide_proximal_end_x_mm: Real,
    housing_fit_clearance_mm: Real,
    stack_gel_bottom_z_mm: Real,
    stack_window_bottom_z_mm: Real,
    shim_compressed_mm: Real,
) -> Finding:
    """Least gap over the bend's outer side; the limit, where it reaches under neither."""
    outer = cable_radius_mm + cable_thickness_mm / 2
    bezel = bezel_proximal_x_mm - cable_bend_end_x_mm
    window = guide_proximal_end_x_mm - housing_fit_clearance_mm - cable_bend_end_x_mm

    def over(ahead_mm: Real, ceiling_z_mm: Real) -> Real:
        rise = np.sqrt(np.maximum(outer**2 - np.maximum(ahead_mm, 0.0) ** 2, 0.0))
        gap = ceiling_z_mm - (cable_level_z_mm - cable_radius_mm + rise)
        turned = (camera_cable_exit == "top") & (ahead_mm < outer)
        return np.where(turned, gap, LEAST_CEILING_MM)

    shims = over(window, stack_window_bottom_z_mm - shim_compressed_mm)
    return Finding(
        np.minimum(over(bezel, stack_gel_bottom_z_mm), shims)[()], LEAST_CEILING_MM, least=True
    )


@rule(
    "cable.floor_mm",
    title="Clamp has a floor before a cable that leaves at the bottom",
    parameter="camera.cable_exit",
    why="the cable parts the clamp's rear, so that its floor must join the cheeks",
    advice="turn the module so that its cable leaves at another side",
)
def cable_floor(clamp_base_mm: Real, camera_cable_exit: str) -> Finding:
    """Thickness of the floor under the module; the limit, where it joins nothing."""
    floor = np.where(camera_cable_exit == "bottom", clamp_base_mm, LEAST_FLOOR_MM)[()]
    return Finding(floor, LEAST_FLOOR_MM, least=True)


@rule(
    "cable.depth_mm",
    title="Cable at an edge of the module is thinner than the module is deep",
    parameter="camera.cable_exit",
    why="at the top or bottom the cable leaves in the plane of the module's rear face; at the "
    "bottom it parts the clamp, of whose floor 1 mm must join the cheeks before the cable",
    advice="turn the module so that its cable leaves behind (rear), or use a flat or thinner cable "
    "or a deeper module (camera.module_depth_mm)",
)
def cable_depth(
    cable_thickness_mm: Real, camera_module_depth_mm: Real, camera_cable_exit: str
) -> Finding:
    """Depth that cable and floor take of the module's; none, where the cable leaves behind."""
    floor = np.where(camera_cable_exit == "bottom", CABLE_GAP_MM + LEAST_FLOOR_MM, 0.0)
    taken = np.where(camera_cable_exit == "rear", 0.0, cable_thickness_mm + floor)[()]
    return Finding(taken, camera_module_depth_mm)


@rule(
    "cable.length_mm",
    title="Cable reaches out of the finger",
    parameter="camera.cable_length_mm",
    why="the connector lies 10 mm outside of the gripper adapter",
    advice="use a longer cable",
)
def cable_length(
    camera_cable_length_mm: Real | None,
    camera_connector_length_mm: Real,
    cable_inside_mm: Real,
) -> Finding:
    """Length that the finger needs against that of the cable, where it is given."""
    needed = cable_inside_mm + camera_connector_length_mm + OUTSIDE_MM
    return Finding(needed, LONGEST_MM if camera_cable_length_mm is None else camera_cable_length_mm)


@rule(
    "cable.hold_n",
    title="Pad under the cable holds it against a pull",
    parameter="design.housing.shim_thickness_mm",
    why="a pull of 1 N must not reach the camera",
    advice="tie the cable to the flange as well, or print to a closer tolerance",
    unit="N",
)
def cable_hold(cable_hold_n: Real) -> Finding:
    """Friction of cable and pad."""
    return Finding(cable_hold_n, LEAST_HOLD_N, least=True, advisory=True)


@rule(
    "wire.channel_mm",
    title="LED wires pass through the LED channels",
    parameter="design.leds.wire_diameter_mm",
    why="a wire needs 0.1 mm of play on both sides in the channel under its board",
    advice="use thinner wires",
)
def wire_channel(
    leds_wire_diameter_mm: Real, channel_inner_y_mm: Real, channel_outer_y_mm: Real
) -> Finding:
    """Wire with its play against the channel."""
    return Finding(leds_wire_diameter_mm + 0.2, channel_outer_y_mm - channel_inner_y_mm)


@rule(
    "wire.beside_clamp_mm",
    title="LED wires pass beside the camera clamp",
    parameter="design.leds.wire_diameter_mm",
    why="between the LED channel and a clamp that is wider the wires step aside by at most 45°",
    advice="use a narrower camera, or a wider gel",
)
def wire_beside_clamp(
    wire_run_y_mm: Real,
    led_y_mm: Real,
    guide_proximal_end_x_mm: Real,
    housing_fit_clearance_mm: Real,
    clamp_front_x_mm: Real,
) -> Finding:
    """Step to the side less the room before the clamp."""
    room = guide_proximal_end_x_mm - housing_fit_clearance_mm - CHANNEL_WALL_MM - clamp_front_x_mm
    step = wire_run_y_mm - led_y_mm
    return Finding(
        np.where(step > 0, step - np.maximum(room, 0.0), -np.abs(room))[()], 0.0, tolerance=1e-9
    )


@rule(
    "clamp.tilt_deg",
    title="Seat of the camera keeps it from tilting",
    parameter="design.housing.camera_seat",
    why="a tilt shifts the whole picture of the gel",
    advice="choose camera_seat: preloaded, or turn the camera by its live picture",
)
def clamp_tilt(clamp_tilt_deg: Real, housing_camera_seat: str, clamp_preloaded: Real) -> Finding:
    """Largest tilt that the seat leaves."""

    def why() -> str:
        wanted = housing_camera_seat == "preloaded" and not clamp_preloaded
        springs = (
            "the module has no room for lips, points and springs beside its cable, so that it lies "
            "loose; "
        )
        return (springs if wanted else "") + f"it can tilt by {clamp_tilt_deg:.2f}°"

    return Finding(clamp_tilt_deg, MOST_TILT_DEG, advisory=True, reason=why)


@rule(
    "clamp.preload_n",
    title="Springs hold the camera on its points",
    parameter="manufacturing.print_tolerance_mm",
    why="0.2 N carry a camera of 2 g at 10 g, for the print that presses least",
    advice="print to a closer tolerance, or choose camera_seat: loose and glue the camera",
    unit="N",
)
def clamp_preload(clamp_preload_n: Real, clamp_preloaded: Real) -> Finding:
    """Least force of the springs; the limit where there are none."""
    value = np.where(clamp_preloaded > 0, clamp_preload_n, LEAST_PRELOAD_N)[()]
    return Finding(value, LEAST_PRELOAD_N, least=True)
