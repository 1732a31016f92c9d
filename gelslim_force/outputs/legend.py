"""The column beside the picture: the wrench and its noise, markers, scales and problems."""

from __future__ import annotations

import textwrap

import numpy as np

from gelslim_core.uncertainty import with_sigma
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.arrow_scale import ArrowScale, round_step
from gelslim_force.outputs.canvas import Canvas, Colour, Image, arrow
from gelslim_force.tracking.tracks import MarkerStatus

WIDTH_PX, LEAST_HEIGHT_PX = 300, 640
YELLOW: Colour = (255, 221, 40)
RED: Colour = (255, 40, 40)
SHADE: Colour = (255, 150, 118)
"""Colour of full pressure; paler than the arrows, so that they stand out."""
WHITE: Colour = (238, 240, 242)
GREY: Colour = (142, 148, 156)
ORANGE: Colour = (255, 160, 60)
STATUS_COLOURS: dict[MarkerStatus, Colour] = {
    MarkerStatus.TRACKED: (120, 235, 255),
    MarkerStatus.PREDICTED: (255, 160, 60),
    MarkerStatus.LOST: (190, 190, 190),
    MarkerStatus.REJECTED: (255, 90, 230),
}
_GROUND: Colour = (24, 27, 31)
_RULE: Colour = (58, 63, 70)
_LEFT, _RIGHT = 16, WIDTH_PX - 16
_ROWS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


def status_mark(canvas: Canvas, x: float, y: float, status: MarkerStatus, size: float) -> None:
    """Draw the symbol of a marker's status: dot, ring, grey cross or magenta cross."""
    colour = STATUS_COLOURS[status]
    if status == MarkerStatus.TRACKED:
        canvas.disc((x, y), 0.75 * size, colour)
    elif status == MarkerStatus.PREDICTED:
        canvas.ring((x, y), 1.5 * size, colour, 0.7 * size)
    else:
        for sign in (-1.0, 1.0):
            canvas.line(
                (x - 1.3 * size, y - sign * 1.3 * size),
                (x + 1.3 * size, y + sign * 1.3 * size),
                colour,
                0.8 * size,
            )


def legend(
    result: FrameResult,
    scale: ArrowScale,
    height_px: int,
    zoom: float,
    px_per_mm: float | None,
) -> Image:
    """Return a picture (max(height, 640), 300, 3).

    `px_per_mm` is the scale at the middle of the gel before the picture was enlarged by `zoom`;
    None if no forces are drawn.
    """
    height = max(height_px, LEAST_HEIGHT_PX)
    blank = np.empty((height, WIDTH_PX, 3), dtype=np.uint8)
    blank[:] = _GROUND
    canvas = Canvas(blank)
    time = f"{result.time_s:.3f} s" if np.isfinite(result.time_s) else ""
    canvas.text((_LEFT, 32), f"frame {result.index}", WHITE, 19)
    canvas.text((_RIGHT - 9 * len(time), 32), time, GREY, 16)
    y = _wrench(canvas, result, scale, 58)
    y = _contact(canvas, result, y)
    y = _markers(canvas, result, y)
    y = _scales(canvas, scale, zoom, px_per_mm, y)
    _problems(canvas, result, y, height)
    return canvas.picture()


def _rule(canvas: Canvas, y: float) -> None:
    canvas.line((_LEFT, y), (_RIGHT, y), _RULE, 1)


def _wrench(canvas: Canvas, result: FrameResult, scale: ArrowScale, y: float) -> float:
    _rule(canvas, y - 12)
    wrench = result.wrench
    values = np.full(6, np.nan) if wrench is None else wrench.vector
    variance = np.full(6, np.nan) if wrench is None else np.diag(wrench.covariance)
    sigma = np.sqrt(np.maximum(variance, 0.0))
    for k, name in enumerate(_ROWS):
        row = y + 10 + 34 * k
        unit, full = ("N", scale.force_bar_n) if k < 3 else ("N mm", scale.torque_bar_nmm)
        canvas.text((_LEFT, row), name, WHITE, 17)
        if not np.isfinite(values[k]):
            canvas.text((_LEFT + 34, row), "unknown", GREY, 16)
        else:
            text = with_sigma(float(values[k]), float(sigma[k]))
            canvas.text((_LEFT + 34, row), f"{text} {unit}", WHITE, 16)
        _bar(canvas, values[k], sigma[k], full, row + 9)
    canvas.text((_LEFT, y + 214), _range(scale), GREY, 13)
    return y + 238


def _range(scale: ArrowScale) -> str:
    return f"full bars ±{scale.force_bar_n:g} N, ±{scale.torque_bar_nmm:g} N mm"


def _bar(canvas: Canvas, value: float, sigma: float, full: float, y: float) -> None:
    """Draw a bar from the middle, with a line of one standard deviation to either side."""
    left, right = _LEFT + 34, _RIGHT
    middle, half = (left + right) / 2, (right - left) / 2
    canvas.line((left, y), (right, y), _RULE, 3)
    if np.isfinite(value):
        end = middle + half * float(np.clip(value / full, -1, 1))
        canvas.line((middle, y), (end, y), RED, 5)
        if np.isfinite(sigma):
            reach = half * sigma / full
            canvas.line((max(end - reach, left), y), (min(end + reach, right), y), WHITE, 1)
    canvas.line((middle, y - 5), (middle, y + 5), GREY, 1)


def _contact(canvas: Canvas, result: FrameResult, y: float) -> float:
    _rule(canvas, y - 12)
    field = result.field
    lines = ["no field"]
    if field is not None:
        x_mm, y_mm = field.centre_of_pressure_mm
        centre = "unknown" if np.isnan(x_mm) else f"({x_mm:+.1f}, {y_mm:+.1f}) mm"
        slip = "unknown" if np.isnan(field.slip_margin) else f"{field.slip_margin:.2f}"
        lines = [f"centre of pressure {centre}", f"slip margin {slip}"]
        lines.append(f"nodes in contact {int(field.contact.sum())}")
    for k, line in enumerate(lines):
        canvas.text((_LEFT, y + 10 + 22 * k), line, WHITE if field else GREY, 15)
    return y + 26 + 22 * len(lines)


def _markers(canvas: Canvas, result: FrameResult, y: float) -> float:
    _rule(canvas, y - 12)
    tracks = result.tracks
    share = "no markers" if tracks is None else f"{100 * tracks.coverage:.1f} % of {len(tracks)}"
    canvas.text((_LEFT, y + 10), f"markers seen  {share}", WHITE, 15)
    for k, status in enumerate(MarkerStatus):
        x, row = _LEFT + 134 * (k % 2), y + 34 + 22 * (k // 2)
        status_mark(canvas, x + 6, row - 5, status, 3.0)
        count = "" if tracks is None else f" {tracks.count(status)}"
        canvas.text((x + 20, row), f"{status.name.lower()}{count}", WHITE, 15)
    return y + 82


def _scales(
    canvas: Canvas, scale: ArrowScale, zoom: float, px_per_mm: float | None, y: float
) -> float:
    """Draw sample arrows of round values, up to about 90 px long, and the shades of pressure."""
    _rule(canvas, y - 12)
    per_px = scale.motion_gain * zoom
    value = round_step(90 / per_px)
    _sample(canvas, y + 8, value * per_px, YELLOW, f"{value:g} px motion (x{scale.motion_gain:g})")
    if px_per_mm is None:
        return y + 32
    per_mpa = scale.traction_mm_per_mpa * px_per_mm * zoom
    value = round_step(90 / per_mpa)
    _sample(canvas, y + 32, value * per_mpa, RED, f"{1e3 * value:g} kPa shear")
    for x in range(90):
        mix = shade_share(x / 89.0)
        colour = [round(g * (1 - mix) + r * mix) for g, r in zip((90, 110, 90), SHADE, strict=True)]
        left = _LEFT + float(x)
        canvas.line((left, y + 48), (left, y + 60), (colour[0], colour[1], colour[2]), 1)
    text = f"0 to {1e3 * scale.pressure_mpa:g} kPa pressure"
    canvas.text((_LEFT + 102, y + 59), text, WHITE, 14)
    return y + 84


def shade_share(share_of_full: float) -> float:
    """Return the opacity of the red shade for a pressure as a share of full pressure."""
    return 0.7 * min(max(share_of_full, 0.0), 1.0) ** 0.7


def _sample(canvas: Canvas, y: float, length: float, colour: Colour, text: str) -> None:
    arrow(canvas, (_LEFT, y), (_LEFT + length, y), colour, 2.5)
    canvas.text((_LEFT + 102, y + 5), text, WHITE, 14)


def _shown(text: str) -> str:
    """Text whose undecodable bytes, which no font can show, are written as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


def _problems(canvas: Canvas, result: FrameResult, y: float, height: int) -> None:
    if not result.problems:
        return
    _rule(canvas, y - 12)
    lines = [line for problem in result.problems for line in textwrap.wrap(_shown(problem), 36)]
    room = max(1, int((height - y - 8) // 19))
    if len(lines) > room:
        lines = [*lines[: room - 1], "..."]
    for k, line in enumerate(lines):
        canvas.text((_LEFT, y + 10 + 19 * k), line, ORANGE, 14)
