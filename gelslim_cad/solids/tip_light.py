"""The board of LEDs at the tip, and the slot of the tip block in which it stands.

Seen from the gel; the slot is open towards the gel, where the bezel closes it. The board stands on
the slot's floor and slides in between the slot's back and a lip in front of each of its ends. Ribs
of the lips press it against the back and are crushed:

      window's end face
    ____________________________
        [led]   [led]   [led]
    |lip=======board=========lip|   ribs between lip and board
    |___________________________|   back, stop at -y

Its wires leave their pads, which are at +y, through a channel from the floor down to the cover.
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import LANE_GAP_MM, STACK_RATIO
from gelslim_cad.dimensions.tip_light import TIP_PLAY_MM
from gelslim_cad.geometry.led_strips import TIP_LIP_MM, has_tip_light
from gelslim_cad.solids.led_seat import LEAD_MM, RIB_LENGTH_MM, SQUEEZE_RATIO
from gelslim_cad.solids.shapes import Point2, box, single, union

OVERLAP_MM = 0.05
FAR_MM = 1.0


def tip_led_positions_mm(d: Dimensions) -> list[float]:
    """Centres of the LEDs across the finger."""
    count, pitch = round(d["led.tip_count"]), d["led.tip_pitch_mm"]
    return [(k - (count - 1) / 2) * pitch for k in range(count)]


def board_x_mm(d: Dimensions) -> Point2:
    """Front and back of the board."""
    front = d["led.tip_face_x_mm"] + d["design.leds.height_mm"]
    return front, front + d["design.leds.board_thickness_mm"]


def board_z_mm(d: Dimensions) -> Point2:
    """Lower edge of the board, on the floor of its slot, and upper edge."""
    half = d["led.tip_board_width_mm"] / 2
    return d["led.tip_z_mm"] - half, d["led.tip_z_mm"] + half


def tip_board(d: Dimensions) -> cq.Solid:
    """The board with its LEDs, which shine towards the gripper."""
    front, back = board_x_mm(d)
    reach, package = d["led.tip_board_length_mm"] / 2, d["design.leds.package_mm"] / 2
    z = (d["led.tip_z_mm"] - package, d["led.tip_z_mm"] + package)
    faces = (d["led.tip_face_x_mm"], front + OVERLAP_MM)
    leds = [box(faces, (y - package, y + package), z) for y in tip_led_positions_mm(d)]
    plate = box((front, back), (-reach, reach), board_z_mm(d))
    return single(union([plate, *leds]), "LED board at the tip")


def tip_slot(d: Dimensions) -> list[cq.Shape]:
    """What the body leaves free for the board at the tip, its light and its wires."""
    if not has_tip_light(d):
        return []
    (front, back), floor = board_x_mm(d), board_z_mm(d)[0]
    start, above = d["led.tip_face_x_mm"] - OVERLAP_MM, d["stack.gel_bottom_z_mm"] + FAR_MM
    reach, y = d["led.tip_board_length_mm"] / 2, d["wire.tip_y_mm"]
    open_y = reach - TIP_LIP_MM
    wire = d["design.leds.wire_diameter_mm"] / 2 + LANE_GAP_MM
    return [
        box(
            (front - TIP_PLAY_MM, back),
            (-reach, reach + d["design.housing.fit_clearance_mm"]),
            (floor, above),
        ),
        box((start, back), (-open_y, open_y), (floor, above)),
        box(
            (start, max(back, max(tip_wires_x_mm(d)) + wire)),
            (y - wire, y + wire),
            (d["cover.top_z_mm"] - FAR_MM, floor + OVERLAP_MM),
        ),
    ]


def tip_wires_x_mm(d: Dimensions) -> Point2:
    """Where the lower and the upper of the two wires go down to the cover, side by side."""
    size = d["design.leds.wire_diameter_mm"]
    near = d["led.tip_face_x_mm"] + LANE_GAP_MM + size / 2
    return near + STACK_RATIO * size, near


def tip_ribs(d: Dimensions) -> list[cq.Shape]:
    """The ribs of the lips as the board has crushed them."""
    return _ribs(d, 0.0)


def uncrushed_tip_ribs(d: Dimensions) -> list[cq.Shape]:
    """The ribs as they are printed, before the board crushes them."""
    return _ribs(d, SQUEEZE_RATIO * d["clamp.point_error_mm"])


def _ribs(d: Dimensions, into_board_mm: float) -> list[cq.Shape]:
    """Upright ribs before both ends of the board, sloped at the top for it to slide in."""
    if not has_tip_light(d):
        return []
    lip, face = board_x_mm(d)[0] - TIP_PLAY_MM, board_x_mm(d)[0] + into_board_mm
    low, high = board_z_mm(d)
    foot, root = low - OVERLAP_MM, lip - OVERLAP_MM
    outline = [(root, foot), (face, foot), (face, high - LEAD_MM), (lip, high), (root, high)]
    middle = (d["led.tip_board_length_mm"] - TIP_LIP_MM) / 2
    ribs: list[cq.Shape] = []
    for y in (-middle - RIB_LENGTH_MM / 2, middle - RIB_LENGTH_MM / 2):
        wire = cq.Wire.makePolygon([cq.Vector(x, y, z) for x, z in [*outline, outline[0]]])
        ribs.append(cq.Solid.extrudeLinear(wire, [], cq.Vector(0, RIB_LENGTH_MM, 0)))
    return ribs
