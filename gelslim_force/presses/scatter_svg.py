"""Points with error bars and a curve as an SVG picture, for reports that need no library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

_WIDTH, _HEIGHT = 460, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 14, 12, 46
_TICKS = 5


@dataclass(frozen=True)
class Scatter:
    """What one picture shows.

    Attributes:
        x: Abscissae of n points.
        y: Ordinates of the points.
        sigma: Standard deviations of the ordinates, drawn as bars.
        x_title: Title of the horizontal axis, with its unit.
        y_title: Title of the vertical axis, with its unit.
        curve: Points (x, y) of a line; empty for none.
    """

    x: Sequence[float]
    y: Sequence[float]
    sigma: Sequence[float]
    x_title: str
    y_title: str
    curve: Sequence[tuple[float, float]] = ()


def scatter_svg(shown: Scatter) -> str:
    """The picture as an `<svg>` element."""
    x_low, x_high = _range([*shown.x, *(p[0] for p in shown.curve)])
    ends = [v + k * s for v, s in zip(shown.y, shown.sigma, strict=True) for k in (-1, 1)]
    y_low, y_high = _range([*ends, *(p[1] for p in shown.curve)])

    def place(x: float, y: float) -> tuple[float, float]:
        right = _LEFT + (x - x_low) / (x_high - x_low) * (_WIDTH - _LEFT - _RIGHT)
        down = _TOP + (y_high - y) / (y_high - y_low) * (_HEIGHT - _TOP - _BOTTOM)
        return right, down

    parts = [_axes(place, (x_low, x_high), (y_low, y_high), shown)]
    if shown.curve:
        line = " ".join(f"{a:.1f},{b:.1f}" for a, b in (place(x, y) for x, y in shown.curve))
        parts.append(f'<polyline points="{line}" fill="none" stroke="#888"/>')
    for x, y, sigma in zip(shown.x, shown.y, shown.sigma, strict=True):
        (a, low), (_, high), (_, b) = place(x, y - sigma), place(x, y + sigma), place(x, y)
        parts.append(f'<path d="M{a:.1f} {low:.1f}V{high:.1f}" stroke="#06c"/>')
        parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5" fill="#06c"/>')
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}" role="img" '
        f'font-size="12" fill="#333">{"".join(parts)}</svg>'
    )


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    margin = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
    return low - margin, high + margin


def _axes(place: object, x: tuple[float, float], y: tuple[float, float], shown: Scatter) -> str:
    assert callable(place)
    bottom, right = _HEIGHT - _BOTTOM, _WIDTH - _RIGHT
    parts = [f'<path d="M{_LEFT} {_TOP}V{bottom}H{right}" fill="none" stroke="#333"/>']
    for value in _ticks(*x):
        at = place(value, y[0])[0]
        parts.append(f'<text x="{at:.1f}" y="{bottom + 16}" text-anchor="middle">{value:g}</text>')
    for value in _ticks(*y):
        at = place(x[0], value)[1]
        parts.append(f'<path d="M{_LEFT} {at:.1f}H{right}" stroke="#ddd"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>')
    middle = (_LEFT + right) / 2
    parts.append(
        f'<text x="{middle}" y="{_HEIGHT - 8}" text-anchor="middle">{escape(shown.x_title)}</text>'
    )
    parts.append(
        f'<text transform="translate(14 {(_TOP + bottom) / 2}) rotate(-90)" '
        f'text-anchor="middle">{escape(shown.y_title)}</text>'
    )
    return "".join(parts)


def _ticks(low: float, high: float) -> list[float]:
    """Round values in a range, about five."""
    raw = (high - low) / _TICKS
    power = 10 ** np.floor(np.log10(raw))
    step = float(power * next(m for m in (1, 2, 5, 10) if m * power >= raw))
    first = int(np.ceil(low / step))
    return [round(k * step, 10) for k in range(first, int(np.floor(high / step)) + 1)]
