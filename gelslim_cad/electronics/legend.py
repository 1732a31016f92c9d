"""The legend of a board: cathodes and plus on the front, side and colour on the back."""

from __future__ import annotations

from gelslim_cad.electronics.board import Component, Mark
from gelslim_cad.electronics.strokes import HEIGHT, WIDTH, text_marks, text_width_mm

STROKE_MM = 0.12
CLEAR_MM = 0.1
"""Least distance of a stroke from a pad and from the board's edge, beside its half width."""
TALLEST_MM = 1.0
LOWEST_MM = 0.6


def legend(
    x_mm: tuple[float, float], width_mm: float, components: tuple[Component, ...], label: str
) -> tuple[Mark, ...]:
    """All strokes of the legend; those that find no room on a narrow board are left out."""
    leds = [c for c in components if c.kind == "led"]
    head = next(c for c in components if c.kind == "wires")
    marks = [m for led in leds for m in _cathode(led, width_mm)]
    marks += _plus(head, leds[0])
    return (*marks, *_back(x_mm, width_mm, head, label))


def _cathode(led: Component, width_mm: float) -> list[Mark]:
    """A bar beside the half of the LED that is the cathode."""
    y = width_mm / 2 - CLEAR_MM - STROKE_MM / 2
    nearest = max(max(p.size_mm[1] for p in led.pads), led.body_mm[1]) / 2
    if y - STROKE_MM / 2 - CLEAR_MM < nearest:
        return []
    start, end = led.at_mm[0] + 0.25, max(p.box_mm[2] for p in led.pads)
    return [Mark((start, y), (end, y), STROKE_MM, "F.SilkS")]


def _plus(head: Component, led: Component) -> list[Mark]:
    """A plus between the wires' pads and the first LED."""
    plus = head.pad("plus")
    start = max(p.box_mm[2] for p in head.pads) + CLEAR_MM + STROKE_MM / 2
    end = min(p.box_mm[0] for p in led.pads) - CLEAR_MM - STROKE_MM / 2
    size = min(end - start, 0.45)
    if size < 0.3:
        return []
    height = size * HEIGHT / WIDTH
    # Nearer to the pad for plus, but clear of the via beside it.
    y = 0.0 if plus.at_mm[1] else -height / 2
    return list(text_marks("+", (start, y), height, "F.SilkS", STROKE_MM))


def _back(x_mm: tuple[float, float], width_mm: float, head: Component, label: str) -> list[Mark]:
    """Side and colour, and the signs of the wires behind their pads."""
    height = min(TALLEST_MM, width_mm - 2 * (CLEAR_MM + STROKE_MM))
    if height < LOWEST_MM:
        return []
    marks: list[Mark] = []
    sign = min(height, 0.8)
    for role, letter in (("plus", "+"), ("minus", "-")):
        x, y = head.pad(role).at_mm
        start = (x - sign * WIDTH / HEIGHT / 2, y + sign / 2)
        marks += text_marks(letter, start, sign, "B.SilkS", STROKE_MM)
    middle = (x_mm[0] + x_mm[1]) / 2
    width = text_width_mm(label, height)
    if width < x_mm[1] - x_mm[0] - 8:
        marks += text_marks(label, (middle - width / 2, height / 2), height, "B.SilkS", STROKE_MM)
    return marks
