"""Strings, nets and parts of a board."""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_cad.electronics.board import GROUND, SUPPLY, Component, Pad, Point
from gelslim_cad.electronics.leds import BoardLed
from gelslim_cad.electronics.resistors import ResistorSize, iec_code, order_number


@dataclass(frozen=True)
class StringPlan:
    """Strings of a board, from the gripper to the tip.

    Attributes:
        lengths: LEDs of each string.
        resistors_ohm: Resistor of each; empty with a constant-current driver.
    """

    lengths: tuple[int, ...]
    resistors_ohm: tuple[float, ...]

    def place(self, led: int) -> tuple[int, int]:
        """String of an LED and its place in it, both from 0; IndexError beyond the last LED."""
        for number, length in enumerate(self.lengths):
            if led < length:
                return number, led
            led -= length
        raise IndexError(led)

    def led_nets(self, led: int) -> tuple[str, str]:
        """Nets of the anode and of the cathode of an LED, counted from 0."""
        number, place = self.place(led)
        anode = SUPPLY if place == 0 else f"S{number + 1}_{place}"
        last = place + 1 == self.lengths[number]
        open_end = last and not self.resistors_ohm
        return anode, GROUND if open_end else f"S{number + 1}_{place + 1}"

    def last_leds(self) -> frozenset[int]:
        """The last LED of each string."""
        return frozenset(sum(self.lengths[: n + 1]) - 1 for n in range(len(self.lengths)))


def led_component(
    ref: str, led: BoardLed, at_mm: Point, nets: tuple[str, str], cathode_to: str
) -> Component:
    """An LED with its anode towards the wires' pads. Pins as in KiCad: 1 cathode, 2 anode."""
    pads = [("1", "cathode", led.pads.cathode, nets[1]), ("2", "anode", led.pads.anode, nets[0])]
    if led.pads.thermal is not None:
        pads.append(("3", "thermal", led.pads.thermal, nets[1]))
    size = "x".join(f"{v:g}" for v in led.package_mm)
    return Component(
        ref=ref,
        kind="led",
        value=f"{led.colour} {led.variant.wavelength_nm:g} nm",
        maker=led.manufacturer,
        part=led.variant.part,
        footprint=f"LED_{size}mm",
        at_mm=at_mm,
        body_mm=led.package_mm,
        height_mm=led.height_mm,
        pads=tuple(
            Pad(number, (at_mm[0] + p.at_mm[0], at_mm[1] + p.at_mm[1]), p.size_mm, net, role)
            for number, role, p, net in pads
        ),
        note=f"cathode towards {cathode_to}; {led.polarity}",
    )


def resistor_component(
    ref: str, size: ResistorSize, value_ohm: float, at_mm: Point, net: str
) -> Component:
    """A resistor from a string to ground."""
    maker, _, part = order_number(size, value_ohm).partition(" ")
    x, y = at_mm
    return Component(
        ref=ref,
        kind="resistor",
        value=iec_code(value_ohm),
        maker=maker,
        part=part,
        footprint=f"R_{size.name}",
        at_mm=at_mm,
        body_mm=size.body_mm,
        height_mm=size.height_mm,
        pads=(
            Pad("1", (x - size.pad_at_mm, y), size.pad_mm, net, "first"),
            Pad("2", (x + size.pad_at_mm, y), size.pad_mm, GROUND, "second"),
        ),
        note="1 %, thick film",
    )


def wires(ref: str, places_mm: tuple[Point, Point], size_mm: Point) -> Component:
    """The pads for the wires, plus first."""
    plus, minus = places_mm
    low_x, high_x = sorted((plus[0], minus[0]))
    low_y, high_y = sorted((plus[1], minus[1]))
    return Component(
        ref=ref,
        kind="wires",
        value="wires",
        maker="",
        part="",
        footprint=f"WirePads_{size_mm[0]:.2f}x{size_mm[1]:.2f}mm",
        at_mm=((low_x + high_x) / 2, (low_y + high_y) / 2),
        body_mm=(high_x - low_x + size_mm[0], high_y - low_y + size_mm[1]),
        height_mm=0.0,
        pads=(
            Pad("1", plus, size_mm, SUPPLY, "plus"),
            Pad("2", minus, size_mm, GROUND, "minus"),
        ),
        note="pads only: solder two wires of 0.05 to 0.1 mm², plus to the pad marked +",
    )
