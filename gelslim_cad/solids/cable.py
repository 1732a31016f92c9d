"""Camera cable, the silicone pad that holds it, and the groove of cable and LED wires.

Side view; the plug of the cover closes the groove of the mount under the cable:

    mount       #################|  camera
    cable  =====================-.  [  ]==   bend with the least radius
    pad    ..........[::]....... |`-[  ]
    plug   ######################|__________ cover
"""

from __future__ import annotations

import math

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import (
    LANE_GAP_MM,
    PAD_INSET_MM,
    PAD_LENGTH_MM,
    STACK_RATIO,
)
from gelslim_cad.dimensions.fold.housing import CHANNEL_WALL_MM, CLAMP_BAR_MM
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import CABLE, SILICONE
from gelslim_cad.solids.shapes import Piece, Point2, box, closed_wire, pair, single
from gelslim_cad.solids.tube import Point3, tube

SLIP_MM = 0.02
"""Between the cable and the roof of its groove, so that the two faces do not coincide."""
STUB_MM = 8.0
"""Cable and wires that are drawn outside of the gripper adapter."""
PLUG_GAP_MM = 0.2
SMALLEST_TURN = 1e-4
FLARE_RATIO = 2.0
"""Radius of the wires' bends over their diameter; so much wider are the lanes at their mouths."""
FAR_MM = 1.0


def camera_cable(d: Dimensions) -> Part:
    """The cable from the module to its far end, which is drawn short outside of the flange."""
    x_out = outside_x_mm(d)
    width, level = d["camera.cable_width_mm"], d["cable.level_z_mm"]
    if d["camera.cable_kind"] == "round":
        cable: cq.Shape = tube(_middle_points(d), d["cable.radius_mm"], width)
    else:
        outline = closed_wire(_strip(d))
        cable = cq.Solid.extrudeLinear(outline, [], cq.Vector(0, width, 0))
    half_w, half_t = d["camera.connector_width_mm"] / 2, d["camera.connector_thickness_mm"] / 2
    end = box(
        (x_out - d["camera.connector_length_mm"], x_out + 0.5),
        (-half_w, half_w),
        (level - half_t, level + half_t),
    )
    length = d["camera.cable_length_mm"]
    told = "" if length is None else f" of {length:g} mm"
    return Part(
        name="camera_cable",
        solid=single(cable.fuse(end), "camera_cable"),
        material=f"{d['camera.cable_kind']} cable{told}, part of the camera",
        process="buy",
        colour=CABLE,
        explode_mm=(0, 0, -26),
        note=f"{d['cable.inside_mm']:.0f} mm lie inside the finger; drawn short outside of it",
    )


def outside_x_mm(d: Dimensions) -> float:
    """Where the drawing of cable and wires ends, outside of the gripper adapter."""
    flange = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    return float(flange - STUB_MM)


def _exit(d: Dimensions) -> tuple[Point2, Point2, float]:
    """Where the cable leaves (x, z), in which direction, and how long it runs straight."""
    p = math.radians(d["camera_pose.pitch_deg"])
    forward, up = (math.cos(p), -math.sin(p)), (math.sin(p), math.cos(p))
    back = d["camera_pose.face_mm"] + d["camera.module_depth_mm"]
    along, across, straight = back, 0.0, CLAMP_BAR_MM + d["clamp.play_mm"]
    direction = (-forward[0], -forward[1])
    if d["camera.cable_exit"] != "rear":
        side = 1.0 if d["camera.cable_exit"] == "top" else -1.0
        along, across = back - d["cable.thickness_mm"] / 2, side * d["camera.module_height_mm"] / 2
        direction, straight = (side * up[0], side * up[1]), 0.0
    x = d["camera_pose.x_mm"] - along * forward[0] + across * up[0]
    z = d["camera_pose.z_mm"] - along * forward[1] + across * up[1]
    return (x, z), direction, straight


def _strip(d: Dimensions) -> list[Piece]:
    """Outline of a flat cable in the plane y = -width / 2."""
    half = d["cable.thickness_mm"] / 2
    upper, lower = _side(d, half), _side(d, -half)
    first = 0 if _exit(d)[2] > 0 else 1
    if abs(_heading(d)) < SMALLEST_TURN:
        return [Piece(p) for p in (upper[first], upper[4], lower[4], lower[first])]
    there = [Piece(upper[1], upper[2]), Piece(upper[3]), Piece(upper[4])]
    back = [Piece(lower[4]), Piece(lower[3], lower[2]), Piece(lower[1])]
    return [Piece(upper[0]), *there, *back, Piece(lower[0])] if first == 0 else [*there, *back]


def _heading(d: Dimensions) -> float:
    """Direction in which the cable leaves, as an angle (rad) from -x towards +z."""
    _, (dx, dz), _ = _exit(d)
    return math.atan2(dz, -dx)


def _side(d: Dimensions, offset: float) -> list[cq.Vector]:
    """Exit, start, middle and end of the bend and far end, `offset` beside the cable's middle."""
    (x, z), (dx, dz), straight = _exit(d)
    turn = _heading(d)
    radius = math.copysign(d["cable.radius_mm"], turn)
    end = (d["cable.bend_end_x_mm"], d["cable.level_z_mm"])
    centre = (end[0], end[1] - radius)

    def beside(point: Point2, angle: float, distance: float) -> cq.Vector:
        side = (math.sin(angle), math.cos(angle))
        at = (point[0] + distance * side[0], point[1] + distance * side[1])
        return cq.Vector(at[0], -d["camera.cable_width_mm"] / 2, at[1])

    return [
        beside((x, z), turn, offset),
        beside((x + straight * dx, z + straight * dz), turn, offset),
        beside(centre, turn / 2, radius + offset),
        beside(end, 0.0, offset),
        beside((outside_x_mm(d), end[1]), 0.0, offset),
    ]


def _middle_points(d: Dimensions) -> list[Point3]:
    """Corners of the middle of a round cable, whose bends are arcs of the cable's radius."""
    (x, z), (dx, dz), _ = _exit(d)
    level = d["cable.level_z_mm"]
    out = (outside_x_mm(d), 0.0, level)
    if abs(_heading(d)) < SMALLEST_TURN:
        return [(x, 0.0, z), out]
    run = (level - z) / dz
    return [(x, 0.0, z), (x + run * dx, 0.0, level), out]


def pad_x_mm(d: Dimensions) -> Point2:
    """Ends of the pad along the finger, near the screws of the cover."""
    front = d["chamber.rear_x_mm"] - PAD_INSET_MM
    return front - PAD_LENGTH_MM, front


def cable_pad(d: Dimensions) -> Part:
    """The silicone pad between plug and cable, as it is squeezed."""
    half = d["camera.cable_width_mm"] / 2
    top = d["cable.level_z_mm"] - d["cable.thickness_mm"] / 2
    free = d["design.housing.shim_thickness_mm"]
    return Part(
        name="cable_pad",
        solid=box(pad_x_mm(d), (-half, half), (d["cable.plug_z_mm"], top)),
        material=f"silicone sheet {free:g} mm, 40 Shore A",
        process="buy",
        colour=SILICONE,
        explode_mm=(0, 0, -46),
        note=f"cut {PAD_LENGTH_MM:g} × {2 * half:g} mm from a sheet of its own; squeezed by "
        f"{d['cable.squeeze_mm']:.2f} mm it holds a pull of at least {d['cable.hold_n']:.1f} N",
    )


def groove(d: Dimensions) -> list[cq.Shape]:
    """Space of cable and wires in the mount, open towards the cover."""
    at = Layout(d)
    cable = d["camera.cable_width_mm"] / 2 + d["design.housing.fit_clearance_mm"]
    rear, prox = d["chamber.rear_x_mm"], d["finger.proximal_x_mm"]
    roof = d["cable.level_z_mm"] + d["cable.thickness_mm"] / 2 + SLIP_MM
    flare = FLARE_RATIO * d["design.leds.wire_diameter_mm"]
    front = rear + FAR_MM
    # A bend above the camera reaches forward, below the roof and the beam of the window's ledge.
    under_beam = roof > beam_bottom_z_mm(d) and foremost_x_mm(d) > at.beam_x_mm
    if under_beam or roof > d["stack.window_bottom_z_mm"]:
        front = max(front, foremost_x_mm(d) + 0.5)
    low, top, outer = at.back_z_mm - FAR_MM, d["wire.lane_top_z_mm"], d["cable.slot_half_mm"]
    return [
        box((prox - FAR_MM, front), (-cable, cable), (low, roof)),
        *pair((prox - FAR_MM, rear + FAR_MM), (cable - 0.05, outer), (low, top)),
        *pair((rear - flare, rear + FAR_MM), (cable - 0.05, outer + flare), (low, top)),
    ]


def notch_top_z_mm(d: Dimensions) -> float:
    """Top of the notches through which the wires leave the LED channels."""
    size = d["design.leds.wire_diameter_mm"]
    upper = d["wire.low_z_mm"] + (STACK_RATIO + 0.5) * size
    return float(max(d["led.top_z_mm"], upper + LANE_GAP_MM))


def notch_end_x_mm(d: Dimensions) -> float:
    """Gripper side of the notches: of the web, or of the beam where that reaches down to them."""
    at = Layout(d)
    web = at.pocket_x_mm[0] - CHANNEL_WALL_MM
    return min(web, at.beam_x_mm) if beam_bottom_z_mm(d) < notch_top_z_mm(d) else web


def beam_bottom_z_mm(d: Dimensions) -> float:
    """Lower side of the beam under the window's end near the camera."""
    return float(d["stack.window_bottom_z_mm"] - d["ledge.depth_mm"])


def foremost_x_mm(d: Dimensions) -> float:
    """Foremost point of the cable's bend at its upper side."""
    return float(d["cable.bend_end_x_mm"] + d["cable.radius_mm"] + d["cable.thickness_mm"] / 2)


def plug(d: Dimensions) -> list[cq.Shape]:
    """What the cover has in the groove: a tongue under the mount, and the rise to the pad."""
    at = Layout(d)
    fit = d["design.housing.fit_clearance_mm"]
    start, rear = d["finger.proximal_x_mm"] + PLUG_GAP_MM, d["chamber.rear_x_mm"]
    half, top = d["cable.slot_half_mm"] - fit, d["cover.top_z_mm"]
    pieces: list[cq.Shape] = [box((start, at.cover_x_mm + 0.1), (-half, half), (at.back_z_mm, top))]
    if d["cable.plug_z_mm"] > top:
        width = d["camera.cable_width_mm"] / 2
        pieces.append(
            box((start, rear - PLUG_GAP_MM), (-width, width), (top - 0.1, d["cable.plug_z_mm"]))
        )
    return pieces


def plug_recess(d: Dimensions) -> list[cq.Shape]:
    """Recess of the cover under the pad, where the cable lies close to the cover."""
    top = d["cover.top_z_mm"]
    if d["cable.plug_z_mm"] >= top:
        return []
    x0, x1 = pad_x_mm(d)
    half = d["camera.cable_width_mm"] / 2 + 0.1
    return [box((x0 - 0.1, x1 + 0.1), (-half, half), (d["cable.plug_z_mm"], top + FAR_MM))]


def flange_slot(d: Dimensions) -> cq.Shape:
    """Slot of the adapter's flange for cable and wires, open towards the gel's side."""
    prox, thick = d["finger.proximal_x_mm"], d["flange.thickness_mm"]
    half = d["cable.slot_half_mm"]
    low = min(d["cover.top_z_mm"], d["cable.level_z_mm"] - d["cable.thickness_mm"] / 2 - 0.3)
    return box((prox - thick - FAR_MM, prox + FAR_MM), (-half, half), (low, FAR_MM))
