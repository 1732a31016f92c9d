"""The marker print as SVG, 1:1 in millimetres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.layout import (
    CROSS_ARM_MM,
    SCALE_BAR_MM,
    SheetLayout,
    decimal,
    lay_out,
    notes,
)
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

_LINE_MM = 0.1
_TEXT_MM = 2.0
_TEXT_ADVANCE = 0.58
_STRIP_MM = 3.0
_MARGIN_MM = 3.0


def render_svg(grid: MarkerGrid, gel_outline: Outline, *, mirrored: bool = False) -> bytes:
    """Return an SVG whose page and user unit are millimetres.

    Groups `markers`, `outline`, `registration`, `scale-bar` and `notes` can be switched off or
    sent to other tools one by one (Inkscape shows them as layers). In the groups the origin is
    that of the sensor frame and y points down the page: cx = x and cy = -y in the outside view,
    cy = y when `mirrored`. Raises ValueError when a dot crosses the outline.
    """
    layout = lay_out(grid, gel_outline, mirrored=mirrored)
    lines = notes(grid, layout)
    left, low, right, high = layout.box_mm
    words_mm = max(len(line) for line in lines) * _TEXT_MM * _TEXT_ADVANCE
    wide = max(right - left, words_mm, SCALE_BAR_MM + 2.0) + 2 * _MARGIN_MM
    foot = low - _STRIP_MM
    bottom = foot - 5.0 - 1.5 * _TEXT_MM * len(lines)
    tall = high - bottom + 2 * _MARGIN_MM
    start = (left + right) / 2 - wide / 2 + _MARGIN_MM
    shift = (_MARGIN_MM - start, _MARGIN_MM + high)
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" version="1.1" '
        f'width="{decimal(wide)}mm" height="{decimal(tall)}mm" '
        f'viewBox="0 0 {decimal(wide)} {decimal(tall)}">',
        f"<title>Gel marker print, {layout.view}</title>",
        f"<desc>{lines[1]}; {lines[2]}. Scale 1:1, millimetres. The tip of the finger is on the "
        "right.</desc>",
        f'<g transform="translate({decimal(shift[0])} {decimal(shift[1])})">',
        _group("markers", 'fill="#000000" stroke="none"', _dots(grid, layout)),
        _group("outline", _pen("#0060c0"), [f'<path d="{_path(layout.outline)}"/>']),
        _group("registration", _pen("#000000"), [_cross(p) for p in layout.crosses_mm]),
        _group("scale-bar", _pen("#000000"), _scale_bar(start, foot)),
        _group(
            "notes",
            f'fill="#404040" stroke="none" font-family="Arial, Helvetica, sans-serif" '
            f'font-size="{decimal(_TEXT_MM)}"',
            [_polygon(layout.arrow_mm), _tip(layout.arrow_mm), *_words(lines, start, foot - 5.0)],
        ),
        "</g>",
        "</svg>",
    ]
    return ("\n".join(parts) + "\n").encode("utf-8")


def _group(name: str, style: str, items: list[str]) -> str:
    head = f'<g id="{name}" inkscape:groupmode="layer" inkscape:label="{name}" {style}>'
    return "\n".join([head, *items, "</g>"])


def _pen(colour: str) -> str:
    return f'fill="none" stroke="{colour}" stroke-width="{decimal(_LINE_MM)}"'


def _xy(point: NDArray[np.float64] | tuple[float, float]) -> str:
    return f"{decimal(point[0], 6)} {decimal(-point[1], 6)}"


def _dots(grid: MarkerGrid, layout: SheetLayout) -> list[str]:
    return [
        f'<circle id="m{i}" cx="{decimal(x, 6)}" cy="{decimal(-y, 6)}" r="{decimal(d / 2, 6)}"'
        + (' class="anchor"/>' if kind == ANCHOR_LARGE else "/>")
        for i, ((x, y), d, kind) in enumerate(
            zip(layout.dots_mm, grid.diameter_mm, grid.kind, strict=True)
        )
    ]


def _path(outline: Outline) -> str:
    ends = np.roll(outline.points_mm, -1, axis=0)
    steps = [f"M {_xy(outline.points_mm[0])}"]
    for start, end, bulge in zip(outline.points_mm, ends, outline.bulges, strict=True):
        if bulge == 0:
            steps.append(f"L {_xy(end)}")
            continue
        chord = float(np.hypot(*(end - start)))
        radius = decimal(chord * (1 + bulge**2) / (4 * abs(bulge)), 6)
        large, sweep = int(abs(bulge) > 1), int(bulge < 0)
        steps.append(f"A {radius} {radius} 0 {large} {sweep} {_xy(end)}")
    return " ".join([*steps, "Z"])


def _cross(point: NDArray[np.float64]) -> str:
    x, y = (decimal(v) for v in (point[0], -point[1]))
    arm, half = decimal(2 * CROSS_ARM_MM), decimal(-CROSS_ARM_MM)
    ring, across = decimal(CROSS_ARM_MM / 2), decimal(CROSS_ARM_MM)
    # The ring is a path, so that the only circles in the file are dots.
    return (
        f'<path d="M {x} {y} m {half} 0 h {arm} M {x} {y} m 0 {half} v {arm} '
        f"M {x} {y} m -{ring} 0 a {ring} {ring} 0 1 1 {across} 0 "
        f'a {ring} {ring} 0 1 1 -{across} 0"/>'
    )


def _scale_bar(left: float, y: float) -> list[str]:
    """Return a bar of 10 mm with end ticks and a tick every millimetre."""
    ticks = [
        f"M {_xy((left + i, y))} v {decimal(1.2 if i in (0, 5, 10) else 0.6)}"
        for i in range(int(SCALE_BAR_MM) + 1)
    ]
    bar = f'<path id="scale-bar-10mm" d="M {_xy((left, y))} h {decimal(SCALE_BAR_MM)}"/>'
    text = (
        f'<text x="{decimal(left + SCALE_BAR_MM + 1)}" y="{decimal(-y + 1)}" fill="#000000" '
        f'stroke="none" font-family="Arial, Helvetica, sans-serif" '
        f'font-size="{decimal(_TEXT_MM)}">10 mm</text>'
    )
    return [bar, f'<path d="{" ".join(ticks)}"/>', text]


def _polygon(points: NDArray[np.float64]) -> str:
    corners = " ".join(f"{decimal(x)},{decimal(-y)}" for x, y in points)
    return f'<polygon id="tip-arrow" points="{corners}"/>'


def _tip(arrow_mm: NDArray[np.float64]) -> str:
    x, y = float(arrow_mm[:, 0].min()), float(arrow_mm[:, 1].max())
    return f'<text x="{decimal(x)}" y="{decimal(-y - 0.6)}">tip</text>'


def _words(lines: list[str], left: float, top: float) -> list[str]:
    return [
        f'<text x="{decimal(left)}" y="{decimal(-(top - 1.5 * _TEXT_MM * i))}">{line}</text>'
        for i, line in enumerate(lines)
    ]
