"""Bill of materials and places of a board, as assembly services read them."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence

from gelslim_cad.electronics.board import Board, Component

BOM_COLUMNS = (
    "Comment",
    "Designator",
    "Footprint",
    "Quantity",
    "Manufacturer",
    "Manufacturer part",
    "Note",
)
PLACE_COLUMNS = ("Designator", "Mid X", "Mid Y", "Layer", "Rotation")


def bom_csv(board: Board) -> bytes:
    """Bill of materials of one board, a line for each part number."""
    rows = [
        (
            parts[0].value,
            ",".join(p.ref for p in parts),
            parts[0].footprint,
            len(parts),
            parts[0].maker,
            parts[0].part,
            parts[0].note,
        )
        for parts in grouped(board)
    ]
    return _csv(BOM_COLUMNS, rows)


def places_csv(board: Board) -> bytes:
    """Centre and rotation of each part, in mm in the frame of the Gerber files.

    A rotation of 0 is that of the footprint, an LED's anode at -x.
    """
    rows = [
        (c.ref, f"{c.at_mm[0]:.4f}mm", f"{c.at_mm[1]:.4f}mm", "Top", "0")
        for c in board.components
        if c.kind != "wires"
    ]
    return _csv(PLACE_COLUMNS, rows)


def grouped(board: Board) -> Iterator[list[Component]]:
    """Bought parts by their order number, in the order of the board."""
    groups: dict[tuple[str, str, str], list[Component]] = {}
    for part in board.components:
        if part.kind != "wires":
            groups.setdefault((part.maker, part.part, part.value), []).append(part)
    yield from groups.values()


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode()
