"""The wiring from the LED boards to their supply as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from gelslim_cad.electronics.circuit import DRIVER_DROPOUT_V
from gelslim_cad.electronics.finger import FingerBoard, FingerBoards

PLUS, MINUS, INK, COPPER = "#c62828", "#222222", "#222222", "#2e7d32"
WIDTH, ROW, TOP = 200.0, 46.0, 20.0
BOARD_X, BOARD_WIDTH, BOARD_HEIGHT = 96.0, 84.0, 16.0
SUPPLY_X, SUPPLY_WIDTH = 8.0, 34.0
PADS_X = BOARD_X + 6.0
WIRE_A_PER_MM2 = 3.0
"""Current that a thin wire in a closed housing carries with little warming."""


def wiring_svg(boards: FingerBoards, supply_v: float, driven: bool) -> bytes:
    """The wiring of a finger: two wires from each board to the supply or to its driver.

    Args:
        boards: The boards; at least one.
        supply_v: Supply in V.
        driven: Whether a constant-current driver feeds each board.

    Returns:
        The drawing, in mm.
    """
    rows = [(side, board) for board in boards.boards for side in board.sides]
    height = TOP + len(rows) * ROW + 12.0
    total = sum(float(board.circuit.supply_ma) for _, board in rows)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {WIDTH:g} {height:g}" font-family="sans-serif" font-size="3.6">',
        f'<rect width="{WIDTH:g}" height="{height:g}" fill="white"/>',
        _text(8.0, 9.0, "Wiring of the LED boards, seen from the LEDs", 5.0),
        _box(SUPPLY_X, TOP, SUPPLY_WIDTH, len(rows) * ROW - 8.0, "#eeeeee"),
        _text(SUPPLY_X + 3, TOP + 8, "Supply", 4.4),
        _text(SUPPLY_X + 3, TOP + 14, f"{supply_v:g} V DC"),
        _text(SUPPLY_X + 3, TOP + 19, f"{1.5 * total:.0f} mA or more"),
        _text(SUPPLY_X + 3, TOP + 24, f"(needs {total:.0f} mA)"),
    ]
    for number, (side, board) in enumerate(rows):
        parts += _row(side, board, TOP + number * ROW, driven)
    told = "red is plus, black is minus; fuse or limit the supply"
    parts += [_text(8.0, height - 6.0, f"Wires: {_wire(rows)}; {told}."), "</svg>", ""]
    return "\n".join(parts).encode()


def _row(side: str, item: FingerBoard, y: float, driven: bool) -> list[str]:
    circuit, board = item.circuit, item.board
    top = y + 8.0
    plus_y, minus_y = top + 4.5, top + 11.5
    start = SUPPLY_X + SUPPLY_WIDTH
    lines = [
        _box(BOARD_X, top, BOARD_WIDTH, BOARD_HEIGHT, COPPER),
        _text(BOARD_X, top - 2.0, f"{board.name}, {_place(side)}", 4.0),
        _line(start, plus_y, PADS_X, plus_y, PLUS),
        _line(start, minus_y, PADS_X, minus_y, MINUS),
    ]
    for sign, at in (("+", plus_y), ("−", minus_y)):
        lines.append(_box(PADS_X, at - 2.0, 6.0, 4.0, "#d9b44a"))
        lines.append(_text(start + 2.0, at - 1.0, sign, 4.4))
    step = (BOARD_WIDTH - 22.0) / max(int(circuit.count), 1)
    lines += [
        _box(PADS_X + 10.0 + k * step, top + 5.0, min(step * 0.6, 6.0), 6.0, "#fff3c4")
        for k in range(int(circuit.count))
    ]
    lines.append(_text(BOARD_X, top + BOARD_HEIGHT + 5.0, _words(item, driven)))
    if driven:
        lines.append(_box(start + 12.0, top + 1.0, 34.0, 14.0, "#dde8f7"))
        lines.append(_text(start + 14.0, top + 6.5, "constant current"))
        volts = float(circuit.needed_v) - DRIVER_DROPOUT_V
        lines.append(_text(start + 14.0, top + 12.0, f"{circuit.current_ma:.0f} mA, {volts:.1f} V"))
    return lines


def _place(side: str) -> str:
    return "tip of the finger" if side == "tip" else f"{side} side of the finger"


def _words(item: FingerBoard, driven: bool) -> str:
    circuit, lengths = item.circuit, item.plan.lengths
    kinds = " and ".join(
        f"{lengths.count(n)} string{'s' if lengths.count(n) > 1 else ''} of {n} "
        f"LED{'s' if n > 1 else ''}"
        for n in sorted(set(lengths), reverse=True)
    )
    if driven:
        return f"{kinds}, {circuit.current_ma:.1f} mA"
    ohms = " and ".join(f"{ohm:g} Ω" for ohm in dict.fromkeys(item.plan.resistors_ohm))
    currents = f"{circuit.current_ma:.1f} mA per LED, {circuit.supply_ma:.0f} mA in all"
    return f"{kinds}, {ohms} each: {currents}"


def _wire(rows: Sequence[tuple[str, FingerBoard]]) -> str:
    """The cross-section of the wires, from AWG 30 upwards."""
    worst = max(float(b.circuit.supply_ma) for _, b in rows) / 1000
    for name, area in (("AWG 30, 0.05 mm²", 0.05), ("AWG 28, 0.08 mm²", 0.08)):
        if worst <= WIRE_A_PER_MM2 * area:
            return name
    return f"{max(worst / WIRE_A_PER_MM2, 0.13):.2f} mm²"


def _text(x: float, y: float, text: str, size: float | None = None) -> str:
    font = "" if size is None else f' font-size="{size:g}"'
    return f'<text x="{x:.2f}" y="{y:.2f}" fill="{INK}"{font}>{escape(text)}</text>'


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return (
        f'<rect x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}" '
        f'fill="{fill}" stroke="{INK}" stroke-width="0.3"/>'
    )


def _line(x0: float, y0: float, x1: float, y1: float, colour: str) -> str:
    return (
        f'<line x1="{x0:.2f}" y1="{y0:.2f}" x2="{x1:.2f}" y2="{y1:.2f}" '
        f'stroke="{colour}" stroke-width="0.9"/>'
    )
