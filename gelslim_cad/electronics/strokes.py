"""Letters as strokes for the legend of a board.

Each glyph stands in a cell of 4 by 6 units, its strokes written as points `xy` with blanks between
strokes, so that the same lines go to KiCad and to Gerber.
"""

from __future__ import annotations

import itertools

from gelslim_cad.electronics.board import Legend, Mark, Point

GLYPHS = {
    "A": "00 04 26 44 40|02 42", "B": "00 06 36 45 44 33 03|33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41", "D": "00 06 26 44 42 20 00", "E": "40 00 06 46|03 33",
    "F": "00 06 46|03 33", "G": "45 36 16 05 01 10 30 41 43 23", "H": "00 06|40 46|03 43",
    "I": "10 30|16 36|20 26", "J": "01 10 20 31 36", "K": "00 06|46 03 40", "L": "06 00 40",
    "M": "00 06 23 46 40", "N": "00 06 40 46", "O": "10 01 05 16 36 45 41 30 10",
    "P": "00 06 36 45 44 33 03", "Q": "10 01 05 16 36 45 41 30 10|22 40",
    "R": "00 06 36 45 44 33 03|23 40", "S": "01 10 30 41 42 33 13 04 05 16 36 45",
    "T": "06 46|20 26", "U": "06 01 10 30 41 46", "V": "06 20 46", "W": "06 10 23 30 46",
    "X": "00 46|06 40", "Y": "06 23 46|23 20", "Z": "06 46 00 40",
    "0": "10 01 05 16 36 45 41 30 10|11 35", "1": "15 26 20|10 30", "2": "05 16 36 45 44 00 40",
    "3": "05 16 36 45 44 33 13|33 42 41 30 10 01", "4": "30 36 02 42",
    "5": "46 06 03 33 42 41 30 10 01", "6": "45 36 16 05 01 10 30 41 42 33 03",
    "7": "06 46 10", "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "01 10 30 41 45 36 16 05 04 13 43", "+": "03 43|21 25", "-": "03 43", ".": "20 21",
    "/": "00 46", ">": "05 43 01", "<": "45 03 41", ":": "21 22|24 25", " ": "",
}  # fmt: skip
WIDTH, HEIGHT, ADVANCE = 4, 6, 6


def text_width_mm(text: str, height_mm: float) -> float:
    """Width of a line of text without the gap behind its last letter."""
    return max(len(text) * ADVANCE - (ADVANCE - WIDTH), 0) * height_mm / HEIGHT


def text_marks(
    text: str, start_mm: Point, height_mm: float, layer: Legend, width_mm: float = 0.12
) -> tuple[Mark, ...]:
    """A line of text as strokes.

    On the back the letters are mirrored across the board's long axis, so that they read rightly
    when the board is turned over about this axis.

    Args:
        text: Capitals, digits and a few signs; KeyError for another.
        start_mm: Lower left corner of the first letter as it is read.
        height_mm: Height of the letters.
        layer: Front or back.
        width_mm: Width of the strokes.

    Returns:
        The strokes.
    """
    unit = height_mm / HEIGHT
    up = 1.0 if layer == "F.SilkS" else -1.0
    marks = []
    for place, letter in enumerate(text):
        for stroke in filter(None, GLYPHS[letter].split("|")):
            points = [
                (
                    start_mm[0] + (place * ADVANCE + int(p[0])) * unit,
                    start_mm[1] + up * int(p[1]) * unit,
                )
                for p in stroke.split()
            ]
            marks += [Mark(a, b, width_mm, layer) for a, b in itertools.pairwise(points)]
    return tuple(marks)
