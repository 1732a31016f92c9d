"""The camera's view of the marker grid, drawn in pixels as an SVG."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gelslim_cad.report.markup import coordinate, text

Pairs = tuple[tuple[float, float], ...]

LEVELS = 16
RAMP = ((68, 56, 160), (45, 112, 190), (28, 160, 160), (110, 200, 100), (250, 220, 60))
"""Dark to light, so that the order also reads in grey; sRGB."""


@dataclass(frozen=True)
class CameraView:
    """Markers as the camera sees them; pixel (0, 0) is the image's upper left corner.

    `marker_axes_px` holds the full length of the two axes of each dot's ellipse,
    `marker_angle_deg` the direction of the first one from +u towards +v, `blur_px` the diameter
    of the blur circle, `outline_px` the closed outline of the gel, `anchors` the indices of the
    markers which differ from the lattice.
    """

    image_width_px: float
    image_height_px: float
    markers_px: Pairs
    marker_axes_px: Pairs
    marker_angle_deg: tuple[float, ...]
    blur_px: tuple[float, ...]
    outline_px: Pairs
    anchors: frozenset[int]


def camera_view(view: CameraView) -> str:
    """Draw each marker as its ellipse with its blur as a soft rim, and the gel's outline."""
    if not view.markers_px:
        return (
            f'<div class="card camera"><div class="frame">{_drawing(view, (), [])}</div>'
            f"<aside><dl>{_row('gel’s share of the image', _gel_share(view))}</dl>"
            "<p class='soft'>The gel has no markers.</p></aside></div>"
        )
    blur = view.blur_px
    areas = [math.sqrt(a * b) for a, b in view.marker_axes_px]
    return (
        f'<div class="card camera"><div class="frame">{_drawing(view, blur, areas)}</div>'
        f"<aside>{_choice()}{_legend('by-blur', blur)}{_legend('by-size', areas)}"
        f"{_numbers(view, areas)}</aside></div>"
    )


def colour(level: int) -> str:
    """Give the colour of a level 0..LEVELS-1 on the ramp as #rrggbb."""
    place = level / (LEVELS - 1) * (len(RAMP) - 1)
    low = min(int(place), len(RAMP) - 2)
    mix = place - low
    parts = (round(a + (b - a) * mix) for a, b in zip(RAMP[low], RAMP[low + 1], strict=True))
    return "#" + "".join(f"{part:02x}" for part in parts)


def levels(values: tuple[float, ...] | list[float]) -> list[int]:
    """Sort values into LEVELS equal steps from the smallest to the largest."""
    if not values:
        return []
    low, span = min(values), max(values) - min(values)
    if span <= 1e-9 * max(1.0, abs(low)):
        return [LEVELS // 2] * len(values)
    return [min(LEVELS - 1, int((value - low) / span * LEVELS)) for value in values]


def ramp_style() -> str:
    """Write the colour classes: `b0`.. by blur, `s0`.. by size, chosen by the two buttons."""
    shades = []
    for level in range(LEVELS):
        shade = colour(level)
        shades.append(f".camera:has(#by-size:checked) .s{level}{{fill:{shade};stroke:{shade}}}")
        shades.append(f".b{level},.k{level}{{fill:{shade};stroke:{shade}}}")
    return "\n".join(sorted(shades, key=lambda rule: rule.startswith(".camera")))


def _drawing(view: CameraView, blur: tuple[float, ...], areas: list[float]) -> str:
    width, height = coordinate(view.image_width_px), coordinate(view.image_height_px)
    points = " ".join(f"{coordinate(u)},{coordinate(v)}" for u, v in view.outline_px)
    outline = f'<polygon class="outline" points="{points}"/>'
    by_blur, by_size = levels(blur), levels(areas)
    dots = "".join(_dot(view, index, by_blur[index], by_size[index]) for index in range(len(areas)))
    pad = view.image_width_px / 40
    box = (
        f"{coordinate(-pad)} {coordinate(-pad)} {coordinate(view.image_width_px + 2 * pad)} "
        f"{coordinate(view.image_height_px + 2 * pad)}"
    )
    return (
        f'<svg class="view" viewBox="{box}" role="img" aria-labelledby="marker-view-title">'
        f'<title id="marker-view-title">{_what(areas)} in an image of {width} × {height} px'
        f'</title><rect class="border" width="{width}" height="{height}"/>{outline}'
        f'<g stroke-opacity="0.4">{dots}</g>{_corners(view, pad)}</svg>'
    )


def _what(areas: list[float]) -> str:
    return f"{len(areas)} markers" if areas else "The gel's outline"


def _dot(view: CameraView, index: int, by_blur: int, by_size: int) -> str:
    (u, v), (a, b) = view.markers_px[index], view.marker_axes_px[index]
    angle, blur = view.marker_angle_deg[index], view.blur_px[index]
    turn = f' transform="rotate({coordinate(angle)} {coordinate(u)} {coordinate(v)})"'
    place = f'cx="{coordinate(u)}" cy="{coordinate(v)}"'
    label = f"marker {index}: ({u:.1f}, {v:.1f}) px, {a:.1f} × {b:.1f} px, blur {blur:.2f} px"
    ring = ""
    if index in view.anchors:
        label += ", anchor"
        ring = f'<circle class="anchor" {place} r="{coordinate(0.5 * max(a, b) + blur + 2)}"/>'
    return (
        f'<ellipse class="b{by_blur} s{by_size}" {place} rx="{coordinate(a / 2)}" '
        f'ry="{coordinate(b / 2)}" stroke-width="{coordinate(blur)}"{turn}>'
        f"<title>{label}</title></ellipse>{ring}"
    )


def _corners(view: CameraView, pad: float) -> str:
    width, height = view.image_width_px, view.image_height_px
    size = coordinate(pad * 0.75)
    return (
        f'<g class="tick" font-size="{size}"><text x="0" y="{coordinate(-0.3 * pad)}">0, 0</text>'
        f'<text x="{coordinate(width)}" y="{coordinate(height + 0.75 * pad)}" text-anchor="end">'
        f"{coordinate(width)}, {coordinate(height)} px</text></g>"
    )


def _choice() -> str:
    return (
        "<fieldset><legend>Colour by</legend>"
        '<label><input type="radio" name="colour-by" id="by-blur" checked> blur</label>'
        '<label><input type="radio" name="colour-by" id="by-size"> size in the image</label>'
        "</fieldset>"
    )


def _legend(kind: str, values: tuple[float, ...] | list[float]) -> str:
    cells = "".join(
        f'<rect class="k{level}" x="{level}" width="1" height="1" stroke-width="0.02"/>'
        for level in range(LEVELS)
    )
    return (
        f'<div class="legend {kind}"><svg viewBox="0 0 {LEVELS} 1" preserveAspectRatio="none" '
        f'aria-hidden="true">{cells}</svg><div><span>{min(values):.2f} px</span>'
        f"<span>{max(values):.2f} px</span></div></div>"
    )


def _numbers(view: CameraView, areas: list[float]) -> str:
    rows = [("markers", str(len(areas)))]
    if view.anchors:
        rows.append(("of these anchors (ringed)", str(len(view.anchors))))
    inside = sum(
        0 <= u <= view.image_width_px and 0 <= v <= view.image_height_px for u, v in view.markers_px
    )
    rows += [
        ("inside the image", str(inside)),
        ("largest printed dot, mean axis", f"{max(areas):.1f} px"),
        ("smallest printed dot, mean axis", f"{min(areas):.1f} px"),
        (
            "narrowest axis of a printed dot",
            f"{min(min(pair) for pair in view.marker_axes_px):.1f} px",
        ),
        ("largest blur of a printed dot", f"{max(view.blur_px):.2f} px"),
        ("gel's share of the image", _gel_share(view)),
    ]
    body = "".join(_row(*row) for row in rows)
    return f"<dl>{body}</dl><p class='soft'>The soft rim of a dot is its blur circle.</p>"


def _row(name: str, value: str) -> str:
    return f"<dt>{text(name)}</dt><dd>{text(value)}</dd>"


def _gel_share(view: CameraView) -> str:
    share = _area(view.outline_px) / (view.image_width_px * view.image_height_px)
    return f"{100 * share:.0f} %"


def _area(outline: Pairs) -> float:
    pairs = zip(outline, outline[1:] + outline[:1], strict=True)
    return abs(sum(u0 * v1 - u1 * v0 for (u0, v0), (u1, v1) in pairs)) / 2
