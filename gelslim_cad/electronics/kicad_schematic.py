"""The circuit of a board as KiCad's .kicad_sch, in the format of KiCad 8.

A row of the sheet is a string: the supply's label, the LEDs, the resistor, and ground.
"""

from __future__ import annotations

from collections.abc import Iterator

from gelslim_cad.electronics.board import GROUND, Board, Component, Point
from gelslim_cad.electronics.kicad_board import LIBRARY, footprint_name, symbol_identifier
from gelslim_cad.electronics.s_expression import NO, YES, Expression, Word, identifier, render
from gelslim_core import __version__

FORMAT = 20231120
"""Format of the file, that of KiCad 8.0."""
LEFT_MM, TOP_MM = 50.8, 50.8
COLUMN_MM, ROW_MM = 25.4, 17.78
LABEL_MM = 10.16
"""Distance of a net's label from the middle of the symbol before it."""
PIN_MM = 3.81
"""Distance of a symbol's pins from its middle."""
THERMAL_MM = 5.08
MARGIN_MM = 40.0
PAPERS = (("A4", 297.0, 210.0), ("A3", 420.0, 297.0))
FONT: Expression = ("effects", ("font", ("size", 1.27, 1.27)))
HIDDEN: Expression = (*FONT, ("hide", YES))
HIDE = Word("hide")
"""How KiCad 8 hides the names of a symbol's pins; later versions read it too."""
SYMBOLS = {
    "LED": ((("2", "A", -PIN_MM, 0.0, 0), ("1", "K", PIN_MM, 0.0, 180))),
    "LED_Pad": (
        ("2", "A", -PIN_MM, 0.0, 0),
        ("1", "K", PIN_MM, 0.0, 180),
        ("3", "PAD", 0.0, -THERMAL_MM, 90),
    ),
    "R": (("1", "", -PIN_MM, 0.0, 0), ("2", "", PIN_MM, 0.0, 180)),
    "Wires": (("1", "+", PIN_MM, 1.27, 180), ("2", "-", PIN_MM, -1.27, 180)),
}
"""Pins of each symbol: number, name, place (y up) and angle."""
Line = tuple[tuple[float, float], ...]
DRAWN: dict[str, tuple[Line, ...]] = {
    "LED": (
        ((-1.27, 1.27), (-1.27, -1.27), (1.27, 0.0), (-1.27, 1.27)),
        ((1.27, 1.27), (1.27, -1.27)),
        ((0.0, 1.778), (1.27, 3.048)),
        ((0.635, 3.048), (1.27, 3.048), (1.27, 2.413)),
        ((-1.27, 1.778), (0.0, 3.048)),
        ((-0.635, 3.048), (0.0, 3.048), (0.0, 2.413)),
    ),
    "R": (((-2.54, 1.016), (2.54, 1.016), (2.54, -1.016), (-2.54, -1.016), (-2.54, 1.016)),),
    "Wires": (((-1.27, 2.54), (1.27, 2.54), (1.27, -2.54), (-1.27, -2.54), (-1.27, 2.54)),),
}
"""Lines of each symbol; LED_Pad has those of LED."""


def kicad_schematic(board: Board) -> bytes:
    """The schematic of a board."""
    rows = list(_rows(board))
    columns = max(len(row) for row in rows)
    width = LEFT_MM + (columns + 1) * COLUMN_MM + MARGIN_MM
    height = TOP_MM + (len(rows) + 1) * ROW_MM + MARGIN_MM
    root = identifier(board.name, "sheet")
    items: list[Expression] = []
    head = next(c for c in board.components if c.kind == "wires")
    items += _head(board, head, root)
    for number, row in enumerate(rows):
        items += _string(board, row, TOP_MM + (number + 1) * ROW_MM, root)
    expression: Expression = (
        "kicad_sch",
        ("version", FORMAT),
        ("generator", "gelslim-cad"),
        ("generator_version", __version__),
        ("uuid", root),
        ("paper", *_paper(width, height)),
        ("title_block", ("title", board.title), ("rev", "1")),
        ("lib_symbols", *map(_symbol, sorted({_kind(c) for c in board.components}))),
        *items,
        ("sheet_instances", ("path", "/", ("page", "1"))),
    )
    return (render(expression) + "\n").encode()


def _paper(width: float, height: float) -> tuple[str | float, ...]:
    for name, wide, high in PAPERS:
        if width <= wide and height <= high:
            return (name,)
    return "User", max(width, 420.0), max(height, 297.0)


def _kind(part: Component) -> str:
    if part.kind == "led":
        return "LED_Pad" if any(p.role == "thermal" for p in part.pads) else "LED"
    return "R" if part.kind == "resistor" else "Wires"


def _rows(board: Board) -> Iterator[list[Component]]:
    """The parts of each string: LEDs in series, then the resistor."""
    leds = [c for c in board.components if c.kind == "led"]
    resistors = {c.pads[0].net: c for c in board.components if c.kind == "resistor"}
    row: list[Component] = []
    for led in leds:
        row.append(led)
        net = led.pad("cathode").net
        if net in resistors:
            row.append(resistors[net])
        if net == GROUND or net in resistors:
            yield row
            row = []


def _symbol(kind: str) -> Expression:
    """A symbol with its drawing and its pins."""
    name = f"{LIBRARY}:{kind}"
    lines = DRAWN["LED" if kind == "LED_Pad" else kind]
    drawn = tuple(
        (
            "polyline",
            ("pts", *(("xy", *point) for point in line)),
            ("stroke", ("width", 0.254), ("type", Word("default"))),
            ("fill", ("type", Word("none"))),
        )
        for line in lines
    )
    pins = tuple(
        (
            "pin",
            Word("passive"),
            Word("line"),
            ("at", x, y, angle),
            ("length", _pin_length(kind, number)),
            ("name", label, FONT),
            ("number", number, FONT),
        )
        for number, label, x, y, angle in SYMBOLS[kind]
    )
    letter = {"LED": "D", "LED_Pad": "D", "R": "R", "Wires": "J"}[kind]
    return (
        "symbol",
        name,
        *((("pin_numbers", HIDE),) if kind == "R" else ()),
        ("pin_names", ("offset", 0.254), *(() if kind == "Wires" else (HIDE,))),
        ("exclude_from_sim", NO),
        ("in_bom", YES),
        ("on_board", YES),
        ("property", "Reference", letter, ("at", 0, 5.08, 0), FONT),
        ("property", "Value", kind, ("at", 0, -3.81, 0), FONT),
        ("property", "Footprint", "", ("at", 0, 0, 0), HIDDEN),
        ("property", "Datasheet", "", ("at", 0, 0, 0), HIDDEN),
        ("symbol", f"{kind}_0_1", *drawn),
        ("symbol", f"{kind}_1_1", *pins),
    )


def _pin_length(kind: str, number: str) -> float:
    if kind == "LED_Pad" and number == "3":
        return THERMAL_MM - 1.27
    return PIN_MM - (2.54 if kind == "R" else 1.27)


def _placed(board: Board, part: Component, at: Point, root: str) -> Expression:
    bought = YES if part.kind != "wires" else NO
    fields = (
        ("Reference", part.ref, -6.35, False),
        ("Value", part.value, -4.445, False),
        ("Footprint", footprint_name(part), 0.0, True),
        ("Datasheet", "", 0.0, True),
        ("Manufacturer", part.maker, 0.0, True),
        ("Part", part.part, 0.0, True),
    )
    return (
        "symbol",
        ("lib_id", f"{LIBRARY}:{_kind(part)}"),
        ("at", *at, 0),
        ("unit", 1),
        ("exclude_from_sim", NO),
        ("in_bom", bought),
        ("on_board", YES),
        ("dnp", NO),
        ("uuid", symbol_identifier(board, part.ref)),
        *(
            ("property", name, text, ("at", at[0], at[1] + up, 0), HIDDEN if hidden else FONT)
            for name, text, up, hidden in fields
        ),
        *(
            ("pin", pad.number, ("uuid", identifier(board.name, "pin", part.ref, pad.number)))
            for pad in part.pads
        ),
        (
            "instances",
            ("project", board.name, ("path", f"/{root}", ("reference", part.ref), ("unit", 1))),
        ),
    )


def _head(board: Board, head: Component, root: str) -> Iterator[Expression]:
    """The pads for the wires with the labels of supply and ground."""
    at = (LEFT_MM, TOP_MM)
    yield _placed(board, head, at, root)
    for pad, (_, _, x, y, _) in zip(head.pads, SYMBOLS["Wires"], strict=True):
        pin = at[0] + x, at[1] - y
        end = pin[0] + 5.08, pin[1]
        yield _wire(board, pin, end)
        yield _label(board, pad.net, end, 0)


def _string(board: Board, row: list[Component], y: float, root: str) -> Iterator[Expression]:
    """Label, LEDs and resistor of a string in a row, joined by wires, and ground."""
    before: Point = (LEFT_MM, y)
    yield _label(board, row[0].pads[1].net, before, 180)
    for place, part in enumerate(row):
        x = LEFT_MM + (place + 1) * COLUMN_MM
        yield _placed(board, part, (x, y), root)
        yield _wire(board, before, (x - PIN_MM, y))
        before = (x + PIN_MM, y)
        if _kind(part) == "LED_Pad":
            foot, corner = (x, y + THERMAL_MM), (before[0] + 2.54, y + THERMAL_MM)
            joint = (before[0] + 2.54, y)
            yield _wire(board, foot, corner)
            yield _wire(board, corner, joint)
            yield _wire(board, before, joint)
            yield ("junction", ("at", *joint), ("diameter", 0), ("color", 0, 0, 0, 0),
                   ("uuid", identifier(board.name, "junction", part.ref)))  # fmt: skip
            before = joint
        net = part.pads[1 if part.kind == "resistor" else 0].net
        if net != GROUND:
            yield _label(board, net, (x + LABEL_MM, y), 90)
    end = (before[0] + 2.54, y)
    yield _wire(board, before, end)
    yield _label(board, GROUND, end, 0)


def _wire(board: Board, start: Point, end: Point) -> Expression:
    name = f"{start[0]:.3f},{start[1]:.3f}-{end[0]:.3f},{end[1]:.3f}"
    return (
        "wire",
        ("pts", ("xy", *start), ("xy", *end)),
        ("stroke", ("width", 0), ("type", Word("default"))),
        ("uuid", identifier(board.name, "wire", name)),
    )


def _label(board: Board, net: str, at: Point, angle: int) -> Expression:
    side = Word("right" if angle == 180 else "left")
    return (
        "global_label",
        net,
        ("shape", Word("passive")),
        ("at", *at, angle),
        ("fields_autoplaced", YES),
        ("effects", ("font", ("size", 1.27, 1.27)), ("justify", side)),
        ("uuid", identifier(board.name, "label", net, f"{at[0]:.3f},{at[1]:.3f}")),
    )
