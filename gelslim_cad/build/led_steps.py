"""Steps of BUILD.md on the LED boards and their wires, with the finger's own numbers."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.cable import wires_under_board
from gelslim_cad.electronics.finger import FingerBoards


def side_board_step(d: Dimensions, boards: FingerBoards) -> str:
    """A board on its pedestal of the cover, with its wires."""
    under = "under" if wires_under_board(d) else "to"
    return (
        f"Solder two wires of {d['design.leds.wire_diameter_mm']:g} mm {under} the gripper end of "
        f"the board.{_tried(boards)} Put a drop of silicone or slow epoxy on its pedestal "
        "and lay the board there against the stop at the tip end. Before the glue sets, close the "
        "cover once: the ribs of the body's channel press the board against the edges of its "
        f"outer wall, which locate it to {d['clamp.point_error_mm']:g} mm. Lead the wires along "
        "the chamber's side, behind the clamp, into the lane beside the plug."
    )


def tip_board_step(d: Dimensions, boards: FingerBoards, name: str) -> str:
    """The board in its slot of the tip block, with its wires through their channel."""
    return (
        f"Solder two wires of {d['design.leds.wire_diameter_mm']:g} mm to the pads at the end of "
        f"the board.{_tried(boards)} Put a drop of silicone or slow epoxy on the back of the "
        "slot in the tip of `body`, at both ends. Thread the wires down through the channel at +y "
        f"and press `{name}` down to the floor of its slot, its LEDs to the gripper, against the "
        "stop at -y: the ribs of the lips press it to the slot's back, which locates it to "
        f"{d['clamp.point_error_mm']:g} mm."
    )


def tip_wires_step() -> str:
    """The wires of that board along the chamber."""
    return (
        "Turn `body` over. Lay the two wires along its inside from the channel towards the "
        "gripper, one above the other, where the cover will be: inside of the baffle and clear of "
        "the mirror, past the place of the clamp and into the lane at +y, next to the groove of "
        "the cable. A strip of adhesive tape holds them until the cover does."
    )


def _tried(boards: FingerBoards) -> str:
    """How the wires are soldered and the boards tried."""
    if not boards.boards:
        return ""
    currents = " and ".join(
        f"{float(b.circuit.supply_ma):.0f} mA ({', '.join(b.sides)})" for b in boards.boards
    )
    return (
        " Solder them to the pads there, plus to the pad marked +, joints flatter than the LEDs; "
        f"try the board at the supply of `electronics/wiring.svg`: the boards take {currents}."
    )
