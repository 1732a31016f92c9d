"""The way of the camera's cable and of the LED wires from where they leave to outside.

The cable leaves the module at the middle of its rear face or, as the flexible tails of most bare
modules do, at an edge of that face in its plane. One bend turns it towards the gripper; from there
it runs straight through a groove of the mount that is open towards the cover.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_cad.dimensions.fold.housing import CLAMP_BAR_MM, cable_level_mm
from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.led_strips import NO_TIP
from gelslim_cad.geometry.lookup import Lookup

LEAST_RADIUS_MM = 0.2
"""Least inner radius that is drawn, for a cable that may be folded."""
OVER_COVER_MM = 0.2
LEAST_PLUG_MM = 0.6
"""Of the cover's plug under the pad that presses the cable."""
LEAST_ROOF_MM = 1.2
LANE_GAP_MM = 0.15
"""Between an LED wire and the sides of its lane."""
STACK_RATIO = 1.15
"""Distance of the two wires of a board over their diameter: one lies above the other, and goes
down to the cover as much later."""
SIDES = {"top": 1.0, "rear": 0.0, "bottom": -1.0}
"""Sign of the direction in which the cable leaves the middle of the module's rear face."""
PAD_LENGTH_MM = 3.0
PAD_INSET_MM = 0.5
"""Of the pad from the mount's front face: there the cover's screws stand beside it."""
PAD_SQUEEZE_RATIO = 0.1
"""Least part of its thickness by which the silicone pad under the cable is squeezed."""
PAD_MODULUS_MPA = 1.7
"""Silicone sheet of 40 Shore A by Gent's formula,
E = 0.0981 (56 + 7.62 S) / (0.1375 (254 - 2.54 S))."""
FRICTION = 0.2 + 0.5
"""Coulomb's coefficients of the cable on printed plastic and on silicone; our estimates."""
RELAXED = 0.7
"""What relaxation leaves of a squeezed silicone sheet's force; our estimate."""


@dimension("cable.thickness_mm", formula="cable thickness, or the width of a round cable")
def cable_thickness_mm(
    camera_cable_kind: str, camera_cable_thickness_mm: Real, camera_cable_width_mm: Real
) -> Real:
    """Cable across its bend."""
    return camera_cable_width_mm if camera_cable_kind == "round" else camera_cable_thickness_mm


@dimension("cable.radius_mm", formula="max(least bend radius, 0.2) + thickness / 2")
def cable_radius_mm(camera_cable_bend_radius_mm: Real, cable_thickness_mm: Real) -> Real:
    """Radius of the bend along the cable's middle; its inner side has the least bend radius."""
    return np.maximum(camera_cable_bend_radius_mm, LEAST_RADIUS_MM) + cable_thickness_mm / 2


@dimension("wire.beside_mm", formula="1.15 wire, for those of the strip at the tip; 0 without")
def wire_beside_mm(leds_wire_diameter_mm: Real, leds_tip: str) -> Real:
    """Distance of the wires of the strip at the tip from the others, beside which they run."""
    return STACK_RATIO * leds_wire_diameter_mm * float(leds_tip != NO_TIP)


@dimension("cable.behind_mm", formula="max(bend radius, middle radius - fit, wires + 0.4)")
def cable_behind_mm(
    camera_cable_bend_radius_mm: Real,
    cable_radius_mm: Real,
    housing_fit_clearance_mm: Real,
    leds_wire_diameter_mm: Real,
    wire_beside_mm: Real,
) -> Real:
    """Free length behind camera and clamp, for the cable's bend and for the wires that cross it."""
    bend = np.maximum(camera_cable_bend_radius_mm, cable_radius_mm - housing_fit_clearance_mm)
    return np.maximum(bend, leds_wire_diameter_mm + wire_beside_mm + 0.4)


@dimension(
    "cable.level_z_mm",
    formula="exit + R (1 - cos p) behind, - R (1 - sin p) at the bottom, + R (1 + sin p) on top",
)
def cable_level_z_mm(
    camera_pose_z_mm: Real,
    camera_pose_pitch_deg: Real,
    camera_pose_face_mm: Real,
    camera_module_depth_mm: Real,
    camera_module_height_mm: Real,
    camera_cable_exit: str,
    cable_thickness_mm: Real,
    cable_radius_mm: Real,
    clamp_play_mm: Real,
) -> Real:
    """Middle of the cable in the mount."""
    p = np.radians(camera_pose_pitch_deg)
    back = camera_pose_face_mm + camera_module_depth_mm
    level: Any = cable_level_mm(
        camera_pose_z_mm,
        np.cos(p),
        np.sin(p),
        back,
        back + CLAMP_BAR_MM + clamp_play_mm,
        camera_module_height_mm / 2,
        cable_thickness_mm / 2,
        cable_radius_mm,
        SIDES[camera_cable_exit],
    )
    return level[()]


@dimension("cable.bend_end_x_mm", formula="exit - R cos p, or exit - bar - R sin |p| behind")
def cable_bend_end_x_mm(
    camera_pose_x_mm: Real,
    camera_pose_pitch_deg: Real,
    camera_pose_face_mm: Real,
    camera_module_depth_mm: Real,
    camera_module_height_mm: Real,
    camera_cable_exit: str,
    cable_thickness_mm: Real,
    cable_radius_mm: Real,
    clamp_play_mm: Real,
) -> Real:
    """Where the cable's bend ends and it runs straight towards the gripper."""
    p = np.radians(camera_pose_pitch_deg)
    back = camera_pose_face_mm + camera_module_depth_mm
    if camera_cable_exit == "rear":
        straight = back + CLAMP_BAR_MM + clamp_play_mm
        return camera_pose_x_mm - straight * np.cos(p) - cable_radius_mm * np.abs(np.sin(p))
    plane, half = back - cable_thickness_mm / 2, camera_module_height_mm / 2
    side = 1.0 if camera_cable_exit == "top" else -1.0
    edge = camera_pose_x_mm - plane * np.cos(p) + side * half * np.sin(p)
    return edge - cable_radius_mm * np.cos(p)


@dimension("cable.turn_deg", formula="p behind, 90° - p at the bottom, 90° + p at the top")
def cable_turn_deg(camera_pose_pitch_deg: Real, camera_cable_exit: str) -> Real:
    """Angle by which the cable is bent."""
    if camera_cable_exit == "rear":
        return np.abs(camera_pose_pitch_deg)
    return 90.0 + (1.0 if camera_cable_exit == "top" else -1.0) * camera_pose_pitch_deg


@dimension("cable.inside_mm", formula="arc + straight to the outer face of the flange")
def cable_inside_mm(
    cable_radius_mm: Real,
    cable_turn_deg: Real,
    cable_bend_end_x_mm: Real,
    camera_cable_exit: str,
    clamp_play_mm: Real,
    finger_proximal_x_mm: Real,
    flange_thickness_mm: Real,
) -> Real:
    """Length of the cable from the camera to the outer face of the gripper adapter."""
    straight = CLAMP_BAR_MM + clamp_play_mm if camera_cable_exit == "rear" else 0.0
    outside = finger_proximal_x_mm - flange_thickness_mm
    arc = cable_radius_mm * np.radians(cable_turn_deg)
    return straight + arc + cable_bend_end_x_mm - outside


@dimension("cable.slot_half_mm", formula="cable width / 2 + fit + wires + 0.3")
def cable_slot_half_mm(
    camera_cable_width_mm: Real,
    housing_fit_clearance_mm: Real,
    leds_wire_diameter_mm: Real,
    wire_beside_mm: Real,
) -> Real:
    """Half the width of the mount's groove: the cable, and a lane of wires on each side."""
    lane = leds_wire_diameter_mm + wire_beside_mm + 2 * LANE_GAP_MM
    return camera_cable_width_mm / 2 + housing_fit_clearance_mm + lane


@dimension("wire.lane_y_mm", formula="cable width / 2 + fit + gap + wire / 2 + wires of the tip")
def wire_lane_y_mm(
    camera_cable_width_mm: Real,
    housing_fit_clearance_mm: Real,
    leds_wire_diameter_mm: Real,
    wire_beside_mm: Real,
) -> Real:
    """Where the wires of the side boards lie in the lane beside the cable.

    Those of the board at the tip lie between them and the cable.
    """
    side = camera_cable_width_mm / 2 + housing_fit_clearance_mm + LANE_GAP_MM
    return side + leds_wire_diameter_mm / 2 + wire_beside_mm


@dimension("wire.run_y_mm", formula="max(LED row, clamp / 2 + fit + wire / 2 + wires of the tip)")
def wire_run_y_mm(
    led_y_mm: Real,
    clamp_width_mm: Real,
    housing_fit_clearance_mm: Real,
    leds_wire_diameter_mm: Real,
    wire_beside_mm: Real,
) -> Real:
    """Where the wires of the side boards run beside the camera clamp."""
    beside = clamp_width_mm / 2 + housing_fit_clearance_mm + leds_wire_diameter_mm / 2 + 0.05
    return np.maximum(led_y_mm, beside + wire_beside_mm)


@dimension("wire.low_z_mm", formula="cover + gap + wire / 2")
def wire_low_z_mm(cover_top_z_mm: Real, leds_wire_diameter_mm: Real) -> Real:
    """Middle of the lower LED wire on the cover; the other of its board lies above it."""
    return cover_top_z_mm + LANE_GAP_MM + leds_wire_diameter_mm / 2


@dimension("wire.lane_top_z_mm", formula="lower wire + 2 wires + gap")
def wire_lane_top_z_mm(wire_low_z_mm: Real, leds_wire_diameter_mm: Real) -> Real:
    """Roof of the lanes of the LED wires."""
    return wire_low_z_mm + (STACK_RATIO + 0.5) * leds_wire_diameter_mm + LANE_GAP_MM


@dimension("cable.squeeze_mm", formula="a tenth of the sheet + two print tolerances")
def cable_squeeze_mm(
    housing_shim_thickness_mm: Real, manufacturing_print_tolerance_mm: Real
) -> Real:
    """How much the plug squeezes the silicone pad under the cable, at most half of it."""
    wanted = PAD_SQUEEZE_RATIO * housing_shim_thickness_mm + 2 * manufacturing_print_tolerance_mm
    return np.minimum(wanted, housing_shim_thickness_mm / 2)


@dimension("cable.plug_z_mm", formula="level - thickness / 2 - squeezed pad")
def cable_plug_z_mm(
    cable_level_z_mm: Real,
    cable_thickness_mm: Real,
    housing_shim_thickness_mm: Real,
    cable_squeeze_mm: Real,
) -> Real:
    """Top of the cover's plug, on which the pad lies that presses the cable."""
    pad = housing_shim_thickness_mm - cable_squeeze_mm
    return cable_level_z_mm - cable_thickness_mm / 2 - pad


@dimension(
    "cable.hold_n",
    formula="0.7 (μ plastic + μ silicone) E (squeeze - 2 tolerance) / sheet · pad area",
)
def cable_hold_n(
    cable_squeeze_mm: Real,
    housing_shim_thickness_mm: Real,
    manufacturing_print_tolerance_mm: Real,
    camera_cable_width_mm: Real,
) -> Real:
    """Pull that the pad's friction holds, at the least squeeze that the print leaves."""
    least = np.maximum(cable_squeeze_mm - 2 * manufacturing_print_tolerance_mm, 0.0)
    pressure = PAD_MODULUS_MPA * least / housing_shim_thickness_mm
    return RELAXED * FRICTION * pressure * camera_cable_width_mm * PAD_LENGTH_MM


def over_cover_mm(half_mm: Real, pad_mm: Real, back_wall_mm: Real) -> Real:
    """Least height of the cable's middle over the cover, in the chamber and on the cover's plug.

    Args:
        half_mm: Half the cable's thickness.
        pad_mm: Thickness of the squeezed pad between plug and cable.
        back_wall_mm: Thickness of the cover, of which the plug is a part.
    """
    return half_mm + np.maximum(OVER_COVER_MM, pad_mm + LEAST_PLUG_MM - back_wall_mm)


def wires_under_board(d: Lookup) -> bool:
    """Whether there is room for both wires between an LED board and the cover."""
    needed = (STACK_RATIO + 1) * d["design.leds.wire_diameter_mm"] + 2 * LANE_GAP_MM
    return bool(d["led.board_bottom_z_mm"] - d["cover.top_z_mm"] >= needed)
