"""Room along a board: what fits between its LEDs and at its ends.

The LEDs stand in a row with the anode towards the gripper. A string's resistor follows its last
LED; supply and ground run along the back, one beside the other, and vias lead to them. Each slot
between two LEDs where one string ends and the next begins takes, from the left, the resistor, a
via to ground and a via to the supply:

    cathode |p1 [ R ] p2|      (+) anode
                      (-)

Vias lie beside the resistor where the board is wide enough, else behind it, one after the other on
the narrowest boards. Functions take numbers or arrays; lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

WEB_MM = 0.1
"""Least web of solder mask between a pad and a via or track of its own net."""
PART_MM = 0.2
"""Least distance of a resistor's pads from an LED's package and pads."""
WIRE_GAP_MM = 0.4
"""Distance of the wires' pads, for a soldering iron."""
WIRE_PAD_MM = 1.0
WIRE_PAD_AT_MOST_MM = 1.6
"""Length of the pads for the wires, which get what room there is."""
NARROW_PAD_MM = 0.7
"""Least width of the pads for wires of 0.25 mm² side by side; narrower ones follow each other."""


@dataclass(frozen=True)
class Spacing:
    """What the board house can make, in mm, numbers or arrays: edge and space of the copper, trace,
    diameter and drill of a via."""

    edge_mm: Any
    space_mm: Any
    trace_mm: Any
    via_mm: Any
    drill_mm: Any

    def via_row_mm(self, width_mm: Any) -> Any:
        """Distance of the vias from the middle of the board: as far out as they can be."""
        return width_mm / 2 - self.edge_mm - self.via_mm / 2

    def lane_mm(self, width_mm: Any) -> Any:
        """Width of supply and ground on the back: half the board, clear of the other's vias."""
        room = width_mm - 2 * self.edge_mm - self.space_mm
        return np.minimum(room / 2, room - self.via_mm)

    def vias_abreast(self, width_mm: Any) -> Any:
        """Whether two vias can stand side by side across the board."""
        return self.via_row_mm(width_mm) - self.via_mm / 2 >= self.space_mm / 2 - 1e-9

    def vias_beside(self, width_mm: Any, part_mm: Any) -> Any:
        """Whether a via fits beside a part of this width in the middle of the board."""
        row = self.via_row_mm(width_mm)
        return row - self.via_mm / 2 - part_mm / 2 >= self.space_mm - 1e-9

    def wire_pad_width_mm(self, width_mm: Any) -> Any:
        """Width of two pads side by side."""
        return (width_mm - 2 * self.edge_mm - WIRE_GAP_MM) / 2

    def gap_mm(self, width_mm: Any, resistor_mm: tuple[Any, Any]) -> Any:
        """Length that resistor and vias need between two LEDs."""
        length, across = resistor_mm
        far = np.maximum(WEB_MM, self.space_mm)
        beside = PART_MM + length + np.maximum(PART_MM, self.space_mm)
        beside = np.maximum(beside, WEB_MM + self.via_mm + self.space_mm)
        abreast = PART_MM + length + far + self.via_mm + far
        inline = PART_MM + length + 2 * WEB_MM + 2 * self.via_mm + self.space_mm
        return np.where(
            self.vias_beside(width_mm, across),
            beside,
            np.where(self.vias_abreast(width_mm), abreast, inline),
        )

    def tail_mm(self, width_mm: Any, resistor_mm: tuple[Any, Any]) -> Any:
        """Length that the last resistor and its via need behind the last LED, up to the copper's
        distance from the edge; a resistor of no length leaves the via."""
        length, across = resistor_mm
        beside = self.vias_beside(width_mm, across) & (np.asarray(length) > 0)
        return (
            np.where(length > 0, PART_MM, 0.0)
            + length
            + np.where(beside, 0.0, WEB_MM + self.via_mm)
        )

    def head_mm(self, width_mm: Any, lanes: Any) -> Any:
        """Length between the wires' pads and the first LED, with a via to the supply where there
        are two `lanes`."""
        one = WEB_MM + self.via_mm + self.space_mm
        two = np.where(self.vias_abreast(width_mm), one, one + self.via_mm + WEB_MM)
        own = WEB_MM + np.where(lanes, self.via_mm + WEB_MM, 0.0)
        return np.where(self.pads_abreast(width_mm), np.where(lanes, two, one), own)

    def pads_abreast(self, width_mm: Any) -> Any:
        """Whether the pads of the wires lie side by side."""
        return self.wire_pad_width_mm(width_mm) >= NARROW_PAD_MM - 1e-9

    def pads_mm(self, width_mm: Any, pad_mm: Any) -> Any:
        """Length of the pads of the wires: one, or two with a via between."""
        both = 2 * pad_mm + WEB_MM + self.via_mm + self.space_mm
        return np.where(self.pads_abreast(width_mm), pad_mm, both)

    def least_width_mm(self, pad_across_mm: Any, resistor_across_mm: Any, lanes: Any) -> Any:
        """Width of the board that pads, resistors and vias need."""
        parts = np.maximum(pad_across_mm, resistor_across_mm)
        vias = self.via_mm + np.where(lanes, self.space_mm + self.trace_mm, 0.0)
        return 2 * self.edge_mm + np.maximum(parts, vias)


def slack_mm(
    spacing: Spacing,
    *,
    width_mm: Any,
    head_mm: Any,
    gap_mm: Any,
    tail_mm: Any,
    resistor_mm: tuple[Any, Any],
    lanes: Any,
) -> Any:
    """Room to spare in the tightest slot with wire pads of 1 mm; negative where something is over.

    Args:
        spacing: What the board house can make.
        width_mm: Width of the board.
        head_mm: Length from the board's end to the first LED.
        gap_mm: Length between neighbouring LEDs, packages and pads.
        tail_mm: Length from the last LED to the board's other end.
        resistor_mm: Length and width of a resistor over its pads; 0 without.
        lanes: Whether there are several strings, so that the supply runs along the board too.

    Returns:
        The slack.
    """
    head = head_mm - spacing.edge_mm - spacing.pads_mm(width_mm, WIRE_PAD_MM)
    head = head - spacing.head_mm(width_mm, lanes)
    between = np.where(lanes, gap_mm - spacing.gap_mm(width_mm, resistor_mm), np.inf)
    tail = tail_mm - spacing.edge_mm - spacing.tail_mm(width_mm, resistor_mm)
    return np.minimum(np.minimum(head, between), np.minimum(tail, gap_mm - spacing.space_mm))
