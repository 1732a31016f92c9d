"""Chip resistors: sizes, ratings and land patterns of thick-film types, and their choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

RATED_C = 70.0
ZERO_C = 155.0
"""Full rating up to 70 °C, none at 155 °C, linear between: IEC 60115-8, as every maker's sheet."""


@dataclass(frozen=True)
class ResistorSize:
    """A size of chip resistor.

    Land patterns by IPC-7351B, nominal density. Bodies and ratings of general-purpose types as
    Yageo's RC series and of the stronger ones as Panasonic's ERJ-P series.

    Attributes:
        name: Size in hundredths of an inch.
        body_mm: Length and width.
        height_mm: Greatest height.
        rated_mw: Power at 70 °C.
        pad_at_mm: Distance of the pads' centres from that of the body.
        pad_mm: Pad along and across the body.
        part: Maker and order number with `{iec}` or `{eia}` for the value's code.
    """

    name: str
    body_mm: tuple[float, float]
    height_mm: float
    rated_mw: float
    pad_at_mm: float
    pad_mm: tuple[float, float]
    part: str

    @property
    def length_mm(self) -> float:
        """Length over the pads."""
        return 2 * self.pad_at_mm + self.pad_mm[0]

    @property
    def width_mm(self) -> float:
        """Width over the pads."""
        return self.pad_mm[1]


RESISTORS = (
    ResistorSize("0402", (1.0, 0.5), 0.4, 63.0, 0.51, (0.54, 0.64), "Yageo RC0402FR-07{iec}L"),
    ResistorSize("0402", (1.0, 0.5), 0.4, 200.0, 0.51, (0.54, 0.64), "Panasonic ERJPA2F{eia}X"),
    ResistorSize("0805", (2.0, 1.25), 0.7, 500.0, 0.9125, (1.025, 1.4), "Panasonic ERJP06F{eia}V"),
)
"""In the order in which they are tried: larger ones do not fit between the LEDs."""


def derated(board_c: Any) -> Any:
    """Part of the rating that is left on a board of this temperature."""
    return np.clip((ZERO_C - board_c) / (ZERO_C - RATED_C), 0.0, 1.0)


def resistor_index(power_mw: Any, board_c: Any) -> NDArray[np.int64]:
    """The smallest of `RESISTORS` that stands the power; the largest where none does."""
    ratings = np.array([r.rated_mw for r in RESISTORS])
    allowed = np.multiply.outer(ratings, derated(np.asarray(board_c, dtype=float)))
    enough = allowed >= np.asarray(power_mw)
    return np.where(enough.any(axis=0), enough.argmax(axis=0), len(RESISTORS) - 1)


def of_size(index: Any, attribute: str) -> NDArray[np.float64]:
    """An attribute of the resistors with these places in `RESISTORS`."""
    return np.array([getattr(r, attribute) for r in RESISTORS])[index]


def order_number(size: ResistorSize, value_ohm: float) -> str:
    """Maker and order number of a resistor of this value, 1 %."""
    return size.part.format(iec=iec_code(value_ohm), eia=eia_code(value_ohm))


def iec_code(value_ohm: float) -> str:
    """A value by IEC 60062, such as 4R7, 47R, 470R and 4K7."""
    for letter, unit in (("M", 1e6), ("K", 1e3), ("R", 1.0)):
        if value_ohm >= unit or letter == "R":
            whole, _, part = f"{value_ohm / unit:.3g}".partition(".")
            return f"{whole}{letter}{part}"
    raise AssertionError(value_ohm)


def eia_code(value_ohm: float) -> str:
    """A value by the four-digit code: 4R70, 47R0, 4700 for 470 Ω and 4701 for 4.7 kΩ."""
    if value_ohm < 100:
        whole, _, part = f"{value_ohm:.2f}".partition(".")
        return f"{whole}R{part}"[:4]
    exponent = len(f"{value_ohm:.0f}") - 3
    return f"{round(value_ohm / 10**exponent)}{exponent}"
