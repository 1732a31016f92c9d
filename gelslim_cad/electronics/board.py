"""A board as data: parts with pads, tracks, vias and marks, in the frame of the finger.

x points to the tip, as in the sensor frame, and y across, from the middle of the board; the board
is seen from the side of the LEDs. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gelslim_cad.electronics.slots import Spacing

Point = tuple[float, float]
Layer = Literal["F.Cu", "B.Cu"]
Legend = Literal["F.SilkS", "B.SilkS"]
Kind = Literal["led", "resistor", "wires"]
SUPPLY = "VCC"
GROUND = "GND"


@dataclass(frozen=True)
class Pad:
    """A rectangular pad on the front: its number, its place on the board, its size and net."""

    number: str
    at_mm: Point
    size_mm: Point
    net: str
    role: str

    @property
    def box_mm(self) -> tuple[float, float, float, float]:
        """Least x and y, greatest x and y."""
        (x, y), (a, b) = self.at_mm, self.size_mm
        return x - a / 2, y - b / 2, x + a / 2, y + b / 2


@dataclass(frozen=True)
class Component:
    """A part on the front of a board.

    Attributes:
        ref: Designator, such as D1.
        kind: What it is.
        value: Value on the schematic.
        maker: Manufacturer; empty for what is not bought.
        part: Order number.
        footprint: Name of the footprint.
        at_mm: Centre.
        body_mm: Size along and across the board.
        height_mm: Height above the board.
        pads: Its pads.
        note: What the one who places it must know.
    """

    ref: str
    kind: Kind
    value: str
    maker: str
    part: str
    footprint: str
    at_mm: Point
    body_mm: Point
    height_mm: float
    pads: tuple[Pad, ...]
    note: str = ""

    def pad(self, role: str) -> Pad:
        """The pad of a role, such as `anode`; StopIteration where there is none."""
        return next(p for p in self.pads if p.role == role)


@dataclass(frozen=True)
class Track:
    """A straight piece of copper with round ends."""

    start_mm: Point
    end_mm: Point
    width_mm: float
    layer: Layer
    net: str


@dataclass(frozen=True)
class Via:
    """A plated hole from front to back, covered by solder mask."""

    at_mm: Point
    net: str


@dataclass(frozen=True)
class Mark:
    """A stroke of the legend."""

    start_mm: Point
    end_mm: Point
    width_mm: float
    layer: Legend


@dataclass(frozen=True)
class Board:
    """One LED board.

    Attributes:
        name: Name of its files.
        title: One line for people.
        x_mm: Ends of the outline along the finger.
        width_mm: Outline across.
        thickness_mm: Thickness of the board.
        material: `fr4` or `flexible`.
        copper_um: Thickness of the copper.
        components: The parts.
        tracks: The copper between them.
        vias: The plated holes.
        marks: The legend.
        spacing: What the board house must be able to make.
        quantity: How many a finger needs.
    """

    name: str
    title: str
    x_mm: tuple[float, float]
    width_mm: float
    thickness_mm: float
    material: str
    copper_um: float
    components: tuple[Component, ...]
    tracks: tuple[Track, ...]
    vias: tuple[Via, ...]
    marks: tuple[Mark, ...]
    spacing: Spacing
    quantity: int = 1

    @property
    def corners_mm(self) -> tuple[Point, Point, Point, Point]:
        """Corners of the outline, counterclockwise from the least x and y."""
        (a, b), half = self.x_mm, self.width_mm / 2
        return (a, -half), (b, -half), (b, half), (a, half)

    @property
    def nets(self) -> tuple[str, ...]:
        """Names of the nets: supply and ground first, then in the order of the pads."""
        found = dict.fromkeys((SUPPLY, GROUND))
        found |= dict.fromkeys(p.net for c in self.components for p in c.pads)
        return tuple(found)

    @property
    def pads(self) -> tuple[tuple[Component, Pad], ...]:
        """All pads with their parts."""
        return tuple((c, p) for c in self.components for p in c.pads)
