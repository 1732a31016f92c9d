"""Everything that a board house needs of a finger's boards, and what to know before ordering."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gelslim_cad.electronics.finger import FingerBoard, FingerBoards
from gelslim_cad.electronics.gerber_layers import layer_files
from gelslim_cad.electronics.heat import SOFT_C
from gelslim_cad.electronics.kicad_project import kicad_files
from gelslim_cad.electronics.tables import bom_csv, grouped, places_csv
from gelslim_cad.electronics.wiring import wiring_svg
from gelslim_cad.geometry.lookup import Lookup
from gelslim_core.files.archive import archive

MATERIAL = {"fr4": "FR-4", "flexible": "polyimide, flexible"}
FIGURES = {
    "package_mm": "size of the package",
    "height_mm": "height",
    "pads": "pads",
    "polarity": "polarity mark",
    "viewing_angle_deg": "viewing angle",
    "part": "order number",
    "wavelength_nm": "wavelength",
    "test_current_ma": "test current",
    "max_current_ma": "greatest current",
    "radiant_flux_mw": "radiant flux",
    "flux_exponent": "flux below the test current",
    "thermal_k_per_w": "thermal resistance",
    "max_junction_c": "greatest junction temperature",
    **dict.fromkeys(
        ("forward_v", "forward_at_c", "forward_mv_per_k", "ideality", "series_ohm"),
        "forward voltage",
    ),
}
"""Figures of an LED in words."""

OrderFiles = dict[str, tuple[bytes, str]]
"""Content and purpose of files by their path."""


def order_files(boards: FingerBoards, d: Lookup) -> OrderFiles:
    """All files of the boards; where there are no boards, a page that says why.

    Args:
        boards: The boards of a finger.
        d: Its spec fields.

    Returns:
        Files by their path in the folder of the electronics.
    """
    files: OrderFiles = {"ORDER.md": (order_page(boards, d), "what to order, or why it cannot be")}
    if not boards.boards:
        return files
    driven = d["electronics.driver"] == "constant_current"
    drawing = wiring_svg(boards, d["electronics.supply_v"], driven)
    files["wiring.svg"] = (drawing, "wires from the LED boards to the supply")
    for item in boards.boards:
        name = item.board.name
        layers = layer_files(item.board)
        files |= {
            f"{name}/{file}": (data, "KiCad 8 project of an LED board")
            for file, data in kicad_files(item.board).items()
        }
        files |= {
            f"{name}/gerber/{file}": (data, "layer or holes of an LED board")
            for file, data in layers.items()
        }
        files[f"{name}/{name}_gerber.zip"] = (archive(layers), "to upload to a board house")
        files[f"{name}/{name}_BOM.csv"] = (bom_csv(item.board), "parts of an LED board")
        files[f"{name}/{name}_CPL.csv"] = (places_csv(item.board), "places of its parts")
    return files


@dataclass(frozen=True)
class BoughtPart:
    """A part on the boards of a finger.

    Attributes:
        name: Kind and value.
        quantity: How many all boards of this design take.
        manufacturer: Manufacturer; empty where the spec does not tell.
        part_number: Its order number.
        board: Name of the board.
    """

    name: str
    quantity: int
    manufacturer: str
    part_number: str
    board: str


def bought_parts(boards: FingerBoards) -> tuple[BoughtPart, ...]:
    """Parts on the boards of a finger, in the order of the boards."""
    return tuple(
        BoughtPart(
            f"{parts[0].kind}_{parts[0].value.replace(' ', '_')}",
            len(parts) * item.board.quantity,
            parts[0].maker,
            parts[0].part,
            item.board.name,
        )
        for item in boards.boards
        for parts in grouped(item.board)
    )


def order_page(boards: FingerBoards, d: Lookup) -> bytes:
    """Markdown: what to enter at the board house, and the circuit in figures."""
    if not boards.boards:
        text = (
            "# LED boards\n\n**No LED board can be made from this spec.** "
            f"{boards.problem[0].upper()}{boards.problem[1:]}. The finger itself is complete.\n"
        )
        return text.encode()
    tip = any("tip" in item.sides for item in boards.boards)
    across = (
        " The board at the tip lies across the finger: its x runs from +y, where its wires leave, "
        "to -y."
    )
    cathodes = "to the tip, away from the wires' pads"
    if tip:
        cathodes = "away from the wires' pads, on the side boards to the tip"
    sections = [
        "# LED boards",
        "Upload each `*_gerber.zip`; for assembly add its `*_BOM.csv` and `*_CPL.csv`. The KiCad "
        "projects are of version 8.0. `wiring.svg` shows the wires. All lengths in mm; the "
        "coordinates are those of the finger, x to the tip, seen from the LEDs."
        + (across if tip else ""),
        _board_table(boards),
        *(_circuit_section(item, d) for item in boards.boards),
        "## Before you order\n\n"
        "- Compare part numbers and pads with the manufacturer's sheet: figures that the library "
        "marks as assumed are listed above.\n"
        f"- In the assembly service's preview every LED's cathode points {cathodes}; a bar on the "
        "legend marks it. Services count rotations from different positions.\n"
        "- Order LEDs of one bin of forward voltage and of one bin of wavelength for a board.\n"
        "- Joints on the wires' pads must stay below the LEDs: the foot of the guide"
        f"{', and at the tip its end face,' if tip else ''} comes to "
        f"{d['design.housing.fit_clearance_mm']:g} mm above them.",
    ]
    return ("\n\n".join(sections) + "\n").encode()


def _board_table(boards: FingerBoards) -> str:
    rows = [
        "| board | pieces | size | thickness | material | layers | copper | hole | trace, space |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for item in boards.boards:
        b, s = item.board, item.board.spacing
        rows.append(
            f"| `{b.name}` | {b.quantity} | {b.x_mm[1] - b.x_mm[0]:.2f} × {b.width_mm:.2f} | "
            f"{b.thickness_mm:g} | {MATERIAL[b.material]} | 2 | {b.copper_um:g} µm | "
            f"{s.drill_mm:g} | {s.trace_mm:g}, {s.space_mm:g} |"
        )
    return "\n".join(rows) + "\n\nTolerance of the outline ± 0.1 mm; vias covered by solder mask."


def _circuit_section(item: FingerBoard, d: Lookup) -> str:
    c, led = item.circuit, item.circuit.led
    ohms = ", ".join(f"{ohm:g} Ω" for ohm in dict.fromkeys(item.plan.resistors_ohm))
    lines = [
        f"## {item.board.title[0].upper()}{item.board.title[1:]}",
        f"- LED: {led.manufacturer or 'as you chose'} {led.variant.part}, {led.polarity}",
        f"- {len(item.plan.lengths)} strings of {_lengths(item.plan.lengths)} at "
        f"{d['electronics.supply_v']:g} V",
        f"- Resistors: {ohms or 'none; a constant-current driver at the supply'}"
        + (f" (at most {float(c.resistor_mw):.0f} mW each)" if ohms else ""),
        f"- Current of an LED: {float(c.current_ma):.1f} mA, from {float(c.least_ma):.1f} to "
        f"{float(c.greatest_ma):.1f} mA over the forward voltages of the sheet; limit "
        f"{led.variant.max_current_ma:g} mA",
        f"- Current of the board: {float(c.supply_ma):.0f} mA",
        f"- Radiant flux of an LED: {float(c.flux_mw):.1f} mW; exposures are "
        f"{d['design.leds.radiant_flux_mw'] / float(c.flux_mw):.2f} times those of `light.json`, "
        f"which has {d['design.leds.radiant_flux_mw']:g} mW",
        f"- With the light always on, in still air of {d['electronics.ambient_c']:g} °C: board "
        f"{float(c.board_c):.0f} °C, junction {float(c.junction_c):.0f} °C of at most "
        f"{led.variant.max_junction_c:g} °C",
    ]
    soft_c, air_c = SOFT_C[d["manufacturing.print_process"]], d["electronics.ambient_c"]
    if c.board_c > soft_c:
        bearable = d["design.leds.radiant_flux_mw"] * (soft_c - air_c) / (c.board_c - air_c)
        lines.append(
            f"- **Too warm for the printed parts, which bear {soft_c:g} °C, with the light always "
            "on**: switch it on for exposures only, or set design.leds.radiant_flux_mw to about "
            f"{bearable:.1f}; the exposure gets longer in proportion"
        )
    if led.assumed:
        named = ", ".join(dict.fromkeys(FIGURES[name] for name in led.assumed))
        lines.append(f"- Assumed, to be compared with the sheet: {named}")
    return lines[0] + "\n\n" + "\n".join(lines[1:])


def _lengths(lengths: tuple[int, ...]) -> str:
    words = (f"{n} LEDs in series" if n > 1 else "one LED" for n in set(lengths))
    return " or ".join(sorted(words))


def circuit_record(boards: FingerBoards) -> dict[str, Any]:
    """The circuits as plain values, for other programs."""
    return {
        "format": "gelslim-electronics/1",
        "problem": boards.problem,
        "boards": [
            {
                "name": item.board.name,
                "sides": list(item.sides),
                "quantity": item.board.quantity,
                "led": item.circuit.led.variant.part,
                "led_x_mm": [c.at_mm[0] for c in item.board.components if c.kind == "led"],
                "outline_mm": [list(p) for p in item.board.corners_mm],
                "strings": list(item.plan.lengths),
                "resistors_ohm": list(item.plan.resistors_ohm),
                **{
                    name: round(float(getattr(item.circuit, name)), 6)
                    for name in (
                        "current_ma",
                        "least_ma",
                        "greatest_ma",
                        "supply_ma",
                        "forward_v",
                        "needed_v",
                        "flux_mw",
                        "heat_mw",
                        "resistor_mw",
                        "board_c",
                        "junction_c",
                    )
                },
                "assumed": list(item.circuit.led.assumed),
            }
            for item in boards.boards
        ],
    }
