"""Lay a board out: parts in a row, tracks on the front, supply and ground on the back."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

from gelslim_cad.electronics.board import GROUND, SUPPLY, Board, Component, Layer, Track, Via
from gelslim_cad.electronics.circuit import Circuit
from gelslim_cad.electronics.legend import legend
from gelslim_cad.electronics.netlist import StringPlan, led_component, resistor_component, wires
from gelslim_cad.electronics.resistors import RESISTORS, ResistorSize, of_size
from gelslim_cad.electronics.slots import (
    PART_MM,
    WEB_MM,
    WIRE_GAP_MM,
    WIRE_PAD_AT_MOST_MM,
    WIRE_PAD_MM,
    Spacing,
    slack_mm,
)

WIDEST_TRACK_MM = 0.6


@dataclass(frozen=True)
class BoardShape:
    """What the finger fixes of a board; lengths in mm, in the frame of the board.

    Attributes:
        name: Name of the board's files.
        title: One line for people.
        label: What stands on the back of the board.
        x_mm: Ends of the outline.
        width_mm: Outline across.
        thickness_mm: Thickness.
        led_x_mm: Centres of the LEDs, from the gripper to the tip.
        material: `fr4` or `flexible`.
        copper_um: Thickness of the copper.
        spacing: What the board house can make.
        held_mm: Length of both ends that lips hold, and that parts and wires leave free.
        cathode_to: Where the cathodes point, in the finger and on the board.
    """

    name: str
    title: str
    label: str
    x_mm: tuple[float, float]
    width_mm: float
    thickness_mm: float
    led_x_mm: tuple[float, ...]
    material: str
    copper_um: float
    spacing: Spacing
    held_mm: float = 0.0
    cathode_to: str = "the tip (+x)"


@dataclass(frozen=True)
class RowGeometry:
    """Lengths that all parts of a row share."""

    shape: BoardShape
    found: Circuit
    size: ResistorSize | None
    lanes: bool

    @property
    def via_y_mm(self) -> float:
        """Distance of the vias from the middle of the board."""
        return float(self.shape.spacing.via_row_mm(self.shape.width_mm))

    @property
    def lane_mm(self) -> float:
        """Width of supply or ground on the back; ground has all of it where it is alone."""
        s, width = self.shape.spacing, self.shape.width_mm
        return float(s.lane_mm(width) if self.lanes else width - 2 * s.edge_mm)

    @property
    def lane_y_mm(self) -> float:
        """Distance of supply and ground from the middle of the board."""
        return self.shape.width_mm / 2 - self.shape.spacing.edge_mm - self.lane_mm / 2

    @property
    def chain_mm(self) -> float:
        """Width of the tracks in the middle: clear of the LED's other pads."""
        pads = self.found.led.pads
        at, across = pads.anode.at_mm[0], min(pads.anode.size_mm[1], pads.cathode.size_mm[1])
        other = pads.thermal or pads.cathode
        room = other.at_mm[0] - other.size_mm[0] / 2 - at - self.shape.spacing.space_mm
        return max(self.shape.spacing.trace_mm, min(WIDEST_TRACK_MM, across, 2 * room))

    @property
    def side_mm(self) -> float:
        """Width of the tracks to the vias."""
        return min(self.chain_mm, self.shape.spacing.via_mm)

    def start_mm(self, x: float) -> float:
        """Where an LED at x begins."""
        return x - self.found.led.reach_mm[0]

    def end_mm(self, x: float) -> float:
        """Where an LED at x ends."""
        return x + self.found.led.reach_mm[1]


def lay_out(shape: BoardShape, found: Circuit, plan: StringPlan) -> Board:
    """The board of a circuit.

    Args:
        shape: What the finger fixes.
        found: The circuit, of one design.
        plan: Its strings and their resistors.

    Returns:
        The board. Whether it fits is told by `slack_mm` and by the rules, before.
    """
    size = RESISTORS[int(found.resistor)] if plan.resistors_ohm else None
    row = RowGeometry(shape, found, size, len(plan.lengths) > 1)
    copper = _Copper(row)
    leds = tuple(
        led_component(f"D{i + 1}", found.led, (x, 0.0), plan.led_nets(i), shape.cathode_to)
        for i, x in enumerate(shape.led_x_mm)
    )
    resistors = _resistors(row, plan)
    waiting = iter(resistors)
    ends = plan.last_leds()
    for i, led in enumerate(leds):
        if any(p.role == "thermal" for p in led.pads):
            heat = led.pad("thermal")
            width = min(row.chain_mm, heat.size_mm[0])
            copper.track(heat.at_mm, led.pad("cathode").at_mm, width, led)
        cathode_mm = led.pad("cathode").at_mm
        if i not in ends:
            copper.track(cathode_mm, leds[i + 1].pad("anode").at_mm, row.chain_mm, led)
            continue
        if resistors:
            copper.resistor(led, next(waiting))
        else:
            end_mm = row.end_mm(shape.led_x_mm[i])
            copper.ground(cathode_mm, end_mm + WEB_MM + shape.spacing.via_mm / 2)
        if i + 1 < len(leds):
            copper.supply(leds[i + 1], row.start_mm(shape.led_x_mm[i + 1]))
    head = _wire_pads(row)
    copper.head(head, leds[0])
    copper.lanes()
    components = (*leds, *resistors, head)
    return Board(
        name=shape.name,
        title=shape.title,
        x_mm=shape.x_mm,
        width_mm=shape.width_mm,
        thickness_mm=shape.thickness_mm,
        material=shape.material,
        copper_um=shape.copper_um,
        components=components,
        tracks=tuple(copper.tracks),
        vias=tuple(copper.vias),
        marks=legend(shape.x_mm, shape.width_mm, components, shape.label),
        spacing=shape.spacing,
    )


def _resistors(row: RowGeometry, plan: StringPlan) -> tuple[Component, ...]:
    """The resistor behind the last LED of each string, in the order of the strings."""
    size = row.size
    if size is None:
        return ()
    made = []
    for number, led in enumerate(sorted(plan.last_leds())):
        end_mm = row.end_mm(row.shape.led_x_mm[led])
        centre_mm = (end_mm + PART_MM + size.length_mm / 2, 0.0)
        resistance_ohm, net = plan.resistors_ohm[number], plan.led_nets(led)[1]
        made.append(resistor_component(f"R{number + 1}", size, resistance_ohm, centre_mm, net))
    return tuple(made)


def room_mm(shape: BoardShape, found: Circuit) -> float:
    """Room to spare in the tightest slot of the row, as the rule has it."""
    first, last = shape.led_x_mm[0], shape.led_x_mm[-1]
    pitch = (last - first) / max(len(shape.led_x_mm) - 1, 1)
    ends = first - shape.x_mm[0] - shape.held_mm, shape.x_mm[1] - last - shape.held_mm
    return float(row_slack_mm(shape.spacing, found, shape.width_mm, pitch, ends))


def row_slack_mm(
    spacing: Spacing, found: Circuit, width_mm: Any, pitch_mm: Any, ends_mm: tuple[Any, Any]
) -> Any:
    """Room to spare in the tightest slot of a row of LEDs.

    Args:
        spacing: What the board house can make.
        found: The circuit.
        width_mm: Width of the board.
        pitch_mm: Distance of neighbouring LEDs.
        ends_mm: From the ends of the board, at the gripper and at the tip, to the next LED.

    Returns:
        The room, a number or an array.
    """
    left, right = found.led.reach_mm
    return slack_mm(
        spacing,
        width_mm=width_mm,
        head_mm=ends_mm[0] - left,
        gap_mm=pitch_mm - left - right,
        tail_mm=ends_mm[1] - right,
        resistor_mm=resistor_size_mm(found),
        lanes=found.strings > 1,
    )


def resistor_size_mm(found: Circuit) -> tuple[Any, Any]:
    """Length and width of the resistors over their pads, 0 where there are none."""
    some = found.resistance_ohm > 0
    return some * of_size(found.resistor, "length_mm"), some * of_size(found.resistor, "width_mm")


def _wire_pads(row: RowGeometry) -> Component:
    """The pads for the wires at the gripper's end, with what room the first LED leaves."""
    shape, s = row.shape, row.shape.spacing
    start = shape.x_mm[0] + shape.held_mm + s.edge_mm
    free = row.start_mm(shape.led_x_mm[0]) - start
    free -= float(s.head_mm(shape.width_mm, row.lanes))
    abreast = bool(s.pads_abreast(shape.width_mm))
    if abreast:
        length = min(max(free, WIRE_PAD_MM), WIRE_PAD_AT_MOST_MM)
        across = float(s.wire_pad_width_mm(shape.width_mm))
        y = (WIRE_GAP_MM + across) / 2
        places = ((start + length / 2, y), (start + length / 2, -y))
    else:
        between = WEB_MM + s.via_mm + s.space_mm
        length = min(max((free - between) / 2, WIRE_PAD_MM), WIRE_PAD_AT_MOST_MM)
        across = shape.width_mm - 2 * s.edge_mm
        places = ((start + 1.5 * length + between, 0.0), (start + length / 2, 0.0))
    return wires("J1", places, (length, across))


class _Copper:
    """Tracks and vias of a row while it grows."""

    def __init__(self, row: RowGeometry) -> None:
        self.row = row
        self.tracks: list[Track] = []
        self.vias: list[Via] = []

    def track(
        self, start: tuple[float, float], end: tuple[float, float], width: float, led: Component
    ) -> None:
        """A track on the front from the cathode of an LED."""
        self._put(start, end, width, "F.Cu", led.pad("cathode").net)

    def resistor(self, led: Component, part: Component) -> None:
        """From the LED's cathode through the resistor to ground."""
        size = self.row.size
        assert size is not None
        first, second = part.pads
        width = min(self.row.chain_mm, size.width_mm)
        self.track(led.pad("cathode").at_mm, first.at_mm, width, led)
        s = self.row.shape.spacing
        x = second.at_mm[0]
        if not s.vias_beside(self.row.shape.width_mm, size.width_mm):
            x += second.size_mm[0] / 2 + WEB_MM + s.via_mm / 2
        self.ground(second.at_mm, x)

    def ground(self, start: tuple[float, float], x: float) -> None:
        """From a pad across the board, along it to x and through a via to ground."""
        self._to_row(start, x, -self.row.via_y_mm, GROUND)
        self.vias.append(Via((x, -self.row.via_y_mm), GROUND))

    def supply(self, led: Component, start: float) -> None:
        """From a via in front of an LED, which begins at `start`, to its anode."""
        anode = led.pad("anode")
        x = start - WEB_MM - self.row.shape.spacing.via_mm / 2
        self._to_row(anode.at_mm, x, self.row.via_y_mm, SUPPLY)
        self.vias.append(Via((x, self.row.via_y_mm), SUPPLY))

    def head(self, pads: Component, led: Component) -> None:
        """From the wires' pads to ground, to the supply's via and to the first LED."""
        plus, minus = pads.pads
        x = minus.box_mm[2] + WEB_MM + self.row.shape.spacing.via_mm / 2
        self.ground(minus.at_mm, x)
        if self.row.lanes:
            self.supply(led, self.row.start_mm(led.at_mm[0]))
        anode, y = led.pad("anode"), self.row.via_y_mm
        self._to_row(anode.at_mm, plus.at_mm[0], y, SUPPLY)
        self._put((plus.at_mm[0], y), plus.at_mm, self.row.side_mm, "F.Cu", SUPPLY)

    def lanes(self) -> None:
        """Ground and, for several strings, the supply on the back, from via to via.

        Wide lanes end before the outermost vias, where a narrow track goes on, so that no round
        end comes closer to the edge than the via does.
        """
        lane, via = self.row.lane_mm, self.row.shape.spacing.via_mm
        narrow, inset = min(lane, via), max(0.0, (lane - via) / 2)
        for net, sign in ((SUPPLY, 1.0), (GROUND, -1.0)):
            places = sorted((v.at_mm for v in self.vias if v.net == net), key=lambda p: p[0])
            y = sign * self.row.lane_y_mm
            for place in places:
                self._put((place[0], y), place, narrow, "B.Cu", net)
            for a, b in itertools.pairwise(places):
                self._put((a[0], y), (b[0], y), narrow, "B.Cu", net)
            if places and places[-1][0] - places[0][0] > 2 * inset > 0:
                ends = places[0][0] + inset, places[-1][0] - inset
                self._put((ends[0], y), (ends[1], y), lane, "B.Cu", net)

    def _to_row(self, start: tuple[float, float], x: float, y: float, net: str) -> None:
        corner = (start[0], y)
        self._put(start, corner, self.row.side_mm, "F.Cu", net)
        self._put(corner, (x, y), self.row.side_mm, "F.Cu", net)

    def _put(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        width: float,
        layer: Layer,
        net: str,
    ) -> None:
        a, b = ((round(p[0], 6), round(p[1], 6)) for p in (start, end))
        track = Track(a, b, round(width, 6), layer, net)
        if a != b and track not in self.tracks:
            self.tracks.append(track)
