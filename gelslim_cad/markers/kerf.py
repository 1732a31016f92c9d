"""Outlines moved by half of what a cutter takes away, so that the part keeps its size.

The path runs beside the part: outside its outline and inside its holes. Convex corners become arcs
around the corner, concave ones stay sharp, arcs stay arcs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.markers.outline import Outline, arc_centre
from gelslim_core.errors import GelslimError

Vector = NDArray[np.float64]
SMOOTH = 1e-6
"""Turn of a corner, rad, below which two pieces are taken to meet smoothly."""


class KerfError(GelslimError, ValueError):
    """An outline has a detail that is narrower than the cut."""


@dataclass(frozen=True)
class _Curve:
    """A straight or circular piece, with the centre of an arc."""

    start: Vector
    end: Vector
    bulge: float

    @property
    def centre(self) -> Vector:
        return arc_centre(self.start, self.end, self.bulge)

    def direction(self, at_end: bool) -> Vector:
        """Unit tangent at its start or its end, along the outline."""
        chord = self.end - self.start
        turn = 2 * math.atan(self.bulge) * (1 if at_end else -1)
        c, s = math.cos(turn), math.sin(turn)
        along = np.array([c * chord[0] - s * chord[1], s * chord[0] + c * chord[1]])
        return np.asarray(along / np.hypot(*along))


def offset_outline(outline: Outline, distance_mm: float) -> Outline:
    """The path at a distance from an outline: outside it, or inside for a negative distance.

    Args:
        outline: A closed outline, anticlockwise.
        distance_mm: Distance to the outside.

    Returns:
        The path; true arcs.

    Raises:
        KerfError: A detail of the outline is narrower than twice the distance.
    """
    if distance_mm == 0:
        return outline
    points = outline.points_mm
    curves = [
        _Curve(points[k], points[(k + 1) % len(points)], float(bulge))
        for k, bulge in enumerate(outline.bulges)
    ]
    moved = [_moved(curve, distance_mm) for curve in curves]
    pieces: list[_Curve] = []
    count = len(curves)
    corners = [_corner(curves, moved, k, distance_mm) for k in range(count)]
    for k in range(count):
        start, end = corners[k][1], corners[(k + 1) % count][0]
        if np.hypot(*(end - start)) > 1e-9:
            pieces.append(_trimmed(moved[k], start, end))
        join_start, join_end = corners[(k + 1) % count]
        if np.hypot(*(join_end - join_start)) > 1e-9:
            turn = _turn(curves[k], curves[(k + 1) % count])
            pieces.append(_Curve(join_start, join_end, math.tan(turn / 4)))
    return Outline(np.array([p.start for p in pieces]), np.array([p.bulge for p in pieces]))


def offset_gain_mm2(outline: Outline, distance_mm: float) -> float:
    """What the path at a distance encloses more than the outline (Steiner's formula).

    P d + d² (Σ θ/2 + Σ tan θ/2) over arcs and corners that become arcs, and over corners that stay
    sharp, each turning left by θ. Sharp corners between arcs add a term in d³, left out here.
    """
    points, curves = outline.points_mm, []
    for k, bulge in enumerate(outline.bulges):
        curves.append(_Curve(points[k], points[(k + 1) % len(points)], float(bulge)))
    length, turned = 0.0, 0.0
    for k, curve in enumerate(curves):
        chord, sweep = float(np.hypot(*(curve.end - curve.start))), 4 * math.atan(curve.bulge)
        length += chord if sweep == 0 else chord / (2 * math.sin(abs(sweep) / 2)) * abs(sweep)
        turn = _turn(curves[k - 1], curve)
        turned += sweep / 2
        turned += turn / 2 if turn * distance_mm > 0 else math.tan(turn / 2)
    return length * distance_mm + distance_mm**2 * turned


def _moved(curve: _Curve, distance: float) -> _Curve:
    """The parallel piece; the outside of an anticlockwise outline is on its right."""

    def aside(at_end: bool) -> Vector:
        x, y = curve.direction(at_end)
        return np.array([y, -x]) * distance

    if curve.bulge:
        radius = float(np.hypot(*(curve.start - curve.centre)))
        if radius + math.copysign(distance, curve.bulge * distance) <= 0:
            raise KerfError(
                f"an arc of radius {radius:.3f} mm is too small for a path {abs(distance):g} mm "
                "from it; make the radius larger or manufacturing.kerf smaller"
            )
    return _Curve(curve.start + aside(False), curve.end + aside(True), curve.bulge)


def _turn(first: _Curve, second: _Curve) -> float:
    """Angle by which the outline turns left between two pieces, rad."""
    a, b = first.direction(True), second.direction(False)
    return math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b))


def _corner(
    curves: list[_Curve], moved: list[_Curve], k: int, distance: float
) -> tuple[Vector, Vector]:
    """End of the path of the piece before corner k, and start of that of the piece after it."""
    before, after = moved[k - 1], moved[k]
    turn = _turn(curves[k - 1], curves[k])
    if abs(turn) < SMOOTH:
        middle = (before.end + after.start) / 2
        return middle, middle
    if turn * distance > 0:
        return before.end, after.start
    corner = curves[k].start
    meets = min(
        _crossings(before, after),
        key=lambda p: float(np.hypot(*(p - corner))),
        default=None,
    )
    if meets is None:
        raise KerfError(
            f"the paths beside the corner at ({corner[0]:.3f}, {corner[1]:.3f}) mm do not meet; "
            "make the pieces there longer or manufacturing.kerf smaller"
        )
    return meets, meets


def _crossings(first: _Curve, second: _Curve) -> list[Vector]:
    """Points that the lines or circles of two pieces share."""
    if not first.bulge and not second.bulge:
        return _line_line(first, second)
    if first.bulge and second.bulge:
        return _circle_circle(first, second)
    return _line_circle(second, first) if first.bulge else _line_circle(first, second)


def _line_line(first: _Curve, second: _Curve) -> list[Vector]:
    u, v = first.end - first.start, second.end - second.start
    cross = float(u[0] * v[1] - u[1] * v[0])
    if abs(cross) < 1e-12:
        return []
    w = second.start - first.start
    return [first.start + u * float(w[0] * v[1] - w[1] * v[0]) / cross]


def _line_circle(line: _Curve, arc: _Curve) -> list[Vector]:
    radius = float(np.hypot(*(arc.start - arc.centre)))
    along = line.end - line.start
    along = along / np.hypot(*along)
    foot = line.start + along * float((arc.centre - line.start) @ along)
    inside = radius**2 - float(np.sum((foot - arc.centre) ** 2))
    if inside < 0:
        return []
    return [foot + along * side * math.sqrt(inside) for side in (-1, 1)]


def _circle_circle(first: _Curve, second: _Curve) -> list[Vector]:
    a, b = first.centre, second.centre
    r, s = (float(np.hypot(*(c.start - c.centre))) for c in (first, second))
    apart = float(np.hypot(*(b - a)))
    if apart < 1e-12:
        return []
    along = (apart**2 + r**2 - s**2) / (2 * apart)
    inside = r**2 - along**2
    if inside < 0:
        return []
    u = (b - a) / apart
    aside = np.array([-u[1], u[0]]) * math.sqrt(inside)
    return [a + along * u + aside, a + along * u - aside]


def _trimmed(curve: _Curve, start: Vector, end: Vector) -> _Curve:
    """The piece between two points on it."""
    if not curve.bulge:
        if float((end - start) @ (curve.end - curve.start)) <= 0:
            raise KerfError(_narrow(start))
        return _Curve(start, end, 0.0)
    centre, sign = curve.centre, math.copysign(1.0, curve.bulge)
    a, b = start - centre, end - centre
    angle = sign * math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b))
    whole = 4 * math.atan(abs(curve.bulge))
    if angle < 0 and whole > math.pi / 2:
        angle += 2 * math.pi
    if angle <= 0:
        raise KerfError(_narrow(start))
    return _Curve(start, end, sign * math.tan(angle / 4))


def _narrow(at: Vector) -> str:
    return (
        f"the outline is narrower than the cut near ({at[0]:.3f}, {at[1]:.3f}) mm; "
        "make it wider or manufacturing.kerf smaller"
    )
