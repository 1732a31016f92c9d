"""The LED boards of a finger, two or three, or why one cannot be made."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gelslim_cad.electronics.board import Board
from gelslim_cad.electronics.circuit import (
    TIP_NAMES,
    Circuit,
    side_circuit,
    string_resistors_ohm,
)
from gelslim_cad.electronics.layout import BoardShape, lay_out, resistor_size_mm, room_mm
from gelslim_cad.electronics.netlist import StringPlan
from gelslim_cad.electronics.slots import Spacing
from gelslim_cad.electronics.strings import string_lengths
from gelslim_cad.geometry.led_strips import SIDES, TIP_LIP_MM, Side, shared_light, strip_sides
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name

NAMES: tuple[Name, ...] = (
    *TIP_NAMES,
    "design.leds.board_thickness_mm",
    "electronics.board",
    "electronics.copper_um",
    "electronics.edge_mm",
    "electronics.min_drill_mm",
    "electronics.min_ring_mm",
    "electronics.min_space_mm",
    "electronics.min_trace_mm",
    "guide.distal_end_x_mm",
    "guide.proximal_end_x_mm",
    "led.pitch_mm",
    "led.tip_pitch_mm",
)
"""Names that the boards use."""
UNKNOWN_LED = (
    "no LED of the library has this model, package, height and colour; choose one, or give its "
    "electrical data as electronics.own_forward_v and the other own_ fields"
)


@dataclass(frozen=True)
class FingerBoard:
    """A board with the circuit and the sides on which it is used."""

    board: Board
    circuit: Circuit
    plan: StringPlan
    sides: tuple[Side, ...]


@dataclass(frozen=True)
class FingerBoards:
    """The boards of a finger; where there are none, `problem` says why.

    Attributes:
        boards: One for each side, or one for both where they are alike, and that of the tip.
        problem: Why there are no boards; empty otherwise.
    """

    boards: tuple[FingerBoard, ...]
    problem: str = ""


def finger_boards(d: Lookup) -> FingerBoards:
    """The boards of one finger.

    Args:
        d: Spec fields and dimensions, those of `NAMES`.

    Returns:
        All boards, one for both sides where they are alike, or none with the reason.
    """
    made: list[FingerBoard] = []
    for side in strip_sides(d):
        found = side_circuit(d, side)
        if found is None or not found.known:
            return FingerBoards((), f"{side} board: {UNKNOWN_LED}")
        shape = board_shape(d, side, found)
        problem = layout_problem(shape, found) or _supply_problem(d, found)
        if problem:
            return FingerBoards((), f"{side} board: {problem}")
        plan = _plan(d, found)
        made.append(FingerBoard(lay_out(shape, found, plan), found, plan, (side,)))
    left, right, *tip = made
    if replace(right.board, name=left.board.name) == left.board:
        both = replace(left.board, quantity=2)
        return FingerBoards((replace(left, board=both, sides=SIDES[:2]), *tip))
    return FingerBoards(tuple(made))


def board_shape(d: Lookup, side: Side, found: Circuit) -> BoardShape:
    """What the finger fixes of the board on one side or at the tip."""
    alike = shared_light(d).replace(" ", "")
    colour = alike or found.led.colour
    if side == "tip":
        return _tip_shape(d, colour, bool(alike))
    middle = (d["guide.proximal_end_x_mm"] + d["guide.distal_end_x_mm"]) / 2
    half = d["led.board_length_mm"] / 2
    count, pitch = round(d["led.count"]), d["led.pitch_mm"]
    which = "" if alike else f"{side} side, "
    return BoardShape(
        name="led_board" if alike else f"led_board_{colour}",
        title=f"LED board, {which}{colour}, {count} LEDs",
        label=(f"LED {colour}" if alike else f"{side} {colour}").upper(),
        x_mm=(round(middle - half, 6), round(middle + half, 6)),
        width_mm=round(d["led.board_width_mm"], 6),
        thickness_mm=d["design.leds.board_thickness_mm"],
        led_x_mm=tuple(round((k - (count - 1) / 2) * pitch, 6) for k in range(count)),
        material=d["electronics.board"],
        copper_um=d["electronics.copper_um"],
        spacing=spacing(d),
    )


def _tip_shape(d: Lookup, colour: str, alike: bool) -> BoardShape:
    """The same at the tip: x of the board is -y of the finger, and its wires leave at +y."""
    half = d["led.tip_board_length_mm"] / 2
    count, pitch = round(d["led.tip_count"]), d["led.tip_pitch_mm"]
    return BoardShape(
        name="led_board_tip" if alike else f"led_board_{colour}",
        title=f"LED board, tip, {colour}, {count} LEDs",
        label=f"tip {colour}".upper(),
        x_mm=(round(-half, 6), round(half, 6)),
        width_mm=round(d["led.tip_board_width_mm"], 6),
        thickness_mm=d["design.leds.board_thickness_mm"],
        led_x_mm=tuple(round((k - (count - 1) / 2) * pitch, 6) for k in range(count)),
        material=d["electronics.board"],
        copper_um=d["electronics.copper_um"],
        spacing=spacing(d),
        held_mm=TIP_LIP_MM,
        cathode_to="-y of the finger (+x)",
    )


def spacing(d: Lookup) -> Spacing:
    """What the board house can make."""
    drill = d["electronics.min_drill_mm"]
    return Spacing(
        d["electronics.edge_mm"],
        d["electronics.min_space_mm"],
        d["electronics.min_trace_mm"],
        drill + 2 * d["electronics.min_ring_mm"],
        drill,
    )


def _plan(d: Lookup, found: Circuit) -> StringPlan:
    lengths = string_lengths(round(found.count), round(float(found.series)))
    if d["electronics.driver"] == "constant_current":
        return StringPlan(lengths, ())
    ohms = string_resistors_ohm(found, d["electronics.supply_v"], lengths)
    return StringPlan(lengths, tuple(ohms))


def layout_problem(shape: BoardShape, found: Circuit) -> str:
    """Why a board cannot be laid out; empty where it can."""
    across = max(found.led.pads.anode.size_mm[1], found.led.pads.cathode.size_mm[1])
    needed = shape.spacing.least_width_mm(across, resistor_size_mm(found)[1], found.strings > 1)
    if shape.width_mm < needed - 1e-9:
        return f"it is {shape.width_mm:.2f} mm wide, and its parts need {needed:.2f} mm"
    room = room_mm(shape, found)
    if room < -1e-9:
        return f"its tightest slot lacks {-room:.2f} mm for resistor, vias or the wires' pads"
    return ""


def _supply_problem(d: Lookup, found: Circuit) -> str:
    """Why a board cannot be supplied; empty where it can."""
    if d["electronics.supply_v"] < found.needed_v:
        return f"its strings need {found.needed_v:.2f} V"
    return ""
