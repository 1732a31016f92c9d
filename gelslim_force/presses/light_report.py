"""The report of a light calibration: one HTML page that needs no network."""

from __future__ import annotations

from html import escape

import numpy as np

from gelslim_core.html_table import table_html
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.presses.calibrate_light import COLOURS
from gelslim_force.presses.gel_report import STYLE, sentence

_CELLS = 15
_SIZE_PX = 300
_MARGIN_PX = 6


def light_report_html(found: LightCalibration) -> str:
    """The page: what was found, a map of the gain of each colour, and each press."""
    warnings = "".join(f'<p class="warning">{escape(sentence(w))}</p>' for w in found.warnings)
    lines = "".join(f"<li>{escape(line)}</li>" for line in found.diagnosis)
    maps = "".join(
        f"<h3>Light in {COLOURS[channel]}</h3>{_map_svg(found, number)}"
        for number, channel in enumerate(found.channels)
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="generator" content="gelslim calibrate-light">'
        f"<title>Light calibration</title><style>{STYLE}</style></head><body>"
        f"<h1>Light calibration</h1>{warnings}<ul>{lines}</ul>"
        "<h2>Gain over the gel</h2><p>Number: gain over the traced light. x runs to the tip, to "
        f"the right; y upwards. Circles: presses.</p>{maps}"
        f"<h2>Presses</h2>{_press_table(found)}</body></html>\n"
    )


def _map_svg(found: LightCalibration, number: int) -> str:
    """The gain of one channel as shades of grey, with numbers in nine places."""
    half = found.half_mm
    scale = _SIZE_PX / (2 * float(half.max()))
    width, height = 2 * half * scale
    steps = (np.arange(_CELLS) + 0.5) / _CELLS * 2 - 1
    places = np.array([(x, y) for y in steps for x in steps]) * half + found.middle_mm
    gains = found.gain_at(places)[number]
    low, high = float(gains.min()), float(gains.max())

    def at(place: np.ndarray) -> tuple[float, float]:
        x, y = (place - found.middle_mm) / half
        return _MARGIN_PX + (x + 1) / 2 * width, _MARGIN_PX + (1 - y) / 2 * height

    parts = []
    for place, gain in zip(places, gains, strict=True):
        x, y = at(place)
        grey = round(235 - 130 * (gain - low) / max(high - low, 1e-9))
        parts.append(
            f'<rect x="{x - width / _CELLS / 2:.1f}" y="{y - height / _CELLS / 2:.1f}" '
            f'width="{width / _CELLS + 0.5:.1f}" height="{height / _CELLS + 0.5:.1f}" '
            f'fill="rgb({grey},{grey},{grey})"/>'
        )
    for press in found.presses:
        x, y = at(np.array(press["place_mm"]))
        radius = float(press["contact_mm"]) * scale
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="none" stroke="#06c"/>'
        )
    corners = np.array([(x, y) for y in (-0.8, 0, 0.8) for x in (-0.8, 0, 0.8)])
    for place in corners * half + found.middle_mm:
        x, y = at(place)
        value = float(found.gain_at(place[None])[number, 0])
        parts.append(f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle">{value:.2f}</text>')
    whole = width + 2 * _MARGIN_PX, height + 2 * _MARGIN_PX
    return (
        f'<svg viewBox="0 0 {whole[0]:.0f} {whole[1]:.0f}" width="{whole[0]:.0f}" '
        f'height="{whole[1]:.0f}" role="img" font-size="13">{"".join(parts)}</svg>'
    )


def _press_table(found: LightCalibration) -> str:
    names = [COLOURS[channel] for channel in found.channels]
    head = (
        "press", "x, mm", "y, mm", "contact radius, mm", "depth, mm",
        *(f"explained, {name}" for name in names),
        *(f"as traced, {name}" for name in names),
        *(f"gain over fit, {name}" for name in names),
    )  # fmt: skip
    rows = [
        (
            str(press["picture"]),
            f"{press['place_mm'][0]:+.2f}",
            f"{press['place_mm'][1]:+.2f}",
            f"{press['contact_mm']:.3f}",
            f"{press['depth_mm']:.3f}",
            *(f"{value:.0%}" for value in press["explained"]),
            *(f"{value:.0%}" for value in press["explained_as_traced"]),
            *(f"{value:.3f}" for value in press["gain_over_fit"]),
        )
        for press in found.presses
    ]
    return table_html(head, rows)
