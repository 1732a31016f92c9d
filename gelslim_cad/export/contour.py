"""Closed planar contours of CAD faces and wires: straight segments, arcs and circles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError

GAP_MM = 1e-5
"""Ends closer than this count as one point; OCCT's own tolerance is 1e-7 mm."""

CHORD_MM = 0.002
"""Largest distance between a chord and its curve."""
DECIMALS = 8

Vector = NDArray[np.float64]
Segment = tuple[float, float, float]
"""Start x, start y in mm and bulge (tangent of a quarter of the swept angle, positive if the
arc turns counter-clockwise, 0 for a straight segment); it ends where the next one starts."""


@dataclass(frozen=True)
class Circle:
    """A full circle, mm."""

    x_mm: float
    y_mm: float
    radius_mm: float


@dataclass(frozen=True)
class Polyline:
    """A closed run of segments, counter-clockwise, from its lowest leftmost vertex."""

    segments: tuple[Segment, ...]


Contour = Circle | Polyline


@dataclass(frozen=True)
class Frame:
    """The plane's directions `u`, `v` and normal `(3,)`; its origin is that of the part."""

    u: Vector
    v: Vector
    normal: Vector

    def flat(self, point: Any) -> tuple[float, float, float]:
        """In-plane coordinates and height of an OCCT point, mm."""
        xyz = np.array([point.X(), point.Y(), point.Z()])
        return float(xyz @ self.u), float(xyz @ self.v), float(xyz @ self.normal)


def frame_of(normal: Sequence[float] | Vector) -> Frame:
    """Frame for drawing a plane, the same for both directions of its normal.

    The plane is seen from +z; an upright one from -y, or from +x if it faces along x. The
    drawing's x is the part's x, or its y where the plane faces along x.
    """
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.linalg.norm(n)
    n = np.where(np.abs(n) < 1e-9, 0.0, n)
    decisive = next(c for c in (n[2], -n[1], n[0]) if c)
    n = n * math.copysign(1.0, decisive)
    u = np.array([1.0, 0.0, 0.0]) - n[0] * n
    if np.linalg.norm(u) < 1e-6:
        u = np.array([0.0, 1.0, 0.0])
    u = u / np.linalg.norm(u)
    return Frame(u, np.cross(n, u), n)


def contours_of(wires: Sequence[Any], frame: Frame) -> list[Contour]:
    """Draw closed wires (`cadquery.Wire`) in a frame, always sorted in the same order.

    Lines and circular arcs stay exact; other curves become chords within `CHORD_MM`.

    Raises:
        ExportError: a wire is open or leaves the plane.
    """
    drawn = [_contour(wire, frame) for wire in wires]
    return sorted(drawn, key=_sort_key)


def _sort_key(contour: Contour) -> tuple[Any, ...]:
    if isinstance(contour, Circle):
        return (1, round(contour.x_mm, 5), round(contour.y_mm, 5), contour.radius_mm)
    return (0, *((round(x, 5), round(y, 5)) for x, y, _ in contour.segments))


def _contour(wire: Any, frame: Frame) -> Contour:
    from OCP.BRepTools import BRepTools_WireExplorer

    pieces: list[_Piece] = []
    explorer = BRepTools_WireExplorer(wire.wrapped)
    while explorer.More():
        pieces += _pieces(explorer.Current(), frame)
        explorer.Next()
    if not pieces:
        raise ExportError("outline: a wire has no edges; give closed wires")
    _check(pieces)
    return _as_circle(pieces) or _as_polyline(pieces)


@dataclass(frozen=True)
class _Piece:
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    bulge: float = 0.0
    circle: tuple[float, float, float] | None = None
    sweep: float = 0.0


def _pieces(edge: Any, frame: Frame) -> list[_Piece]:
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_TangentialDeflection
    from OCP.GeomAbs import GeomAbs_CurveType
    from OCP.TopAbs import TopAbs_Orientation

    curve = BRepAdaptor_Curve(edge)
    first, last = curve.FirstParameter(), curve.LastParameter()
    backwards = edge.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    kind = curve.GetType()
    if kind == GeomAbs_CurveType.GeomAbs_Circle:
        axis = curve.Circle().Axis().Direction()
        upright = float(np.array([axis.X(), axis.Y(), axis.Z()]) @ frame.normal)
        if abs(upright) > 1 - 1e-9:
            sweep = math.copysign(last - first, upright) * (-1 if backwards else 1)
            return [_arc(curve, (first, last)[backwards], (last, first)[backwards], sweep, frame)]
    if kind == GeomAbs_CurveType.GeomAbs_Line:
        points = [curve.Value(first), curve.Value(last)]
    else:
        run = GCPnts_TangentialDeflection(curve, 0.1, CHORD_MM)
        points = [run.Value(i) for i in range(1, run.NbPoints() + 1)]
    flat = [frame.flat(p) for p in (reversed(points) if backwards else points)]
    return [_Piece(a, b) for a, b in pairwise(flat)]


def _arc(curve: Any, start: float, end: float, sweep: float, frame: Frame) -> _Piece:
    x, y, _ = frame.flat(curve.Circle().Location())
    full = abs(sweep) > 2 * math.pi - 1e-9
    return _Piece(
        frame.flat(curve.Value(start)),
        frame.flat(curve.Value(end)),
        0.0 if full else math.tan(sweep / 4),
        (x, y, curve.Circle().Radius()),
        sweep,
    )


def _check(pieces: Sequence[_Piece]) -> None:
    heights = [p.start[2] for p in pieces]
    if max(heights) - min(heights) > GAP_MM:
        raise ExportError(
            f"outline: a wire is {max(heights) - min(heights):.3g} mm out of plane, limit "
            f"{GAP_MM:g} mm; give wires of one planar face"
        )
    for piece, following in zip(pieces, [*pieces[1:], pieces[0]], strict=True):
        gap = math.dist(piece.end, following.start)
        if gap > GAP_MM:
            raise ExportError(
                f"outline: a wire is open by {gap:.3g} mm at "
                f"({piece.end[0]:.3f}, {piece.end[1]:.3f}), limit {GAP_MM:g} mm; close it"
            )


def _as_circle(pieces: Sequence[_Piece]) -> Circle | None:
    rounds = {p.circle and tuple(np.round(p.circle, 6)) for p in pieces}
    if len(rounds) != 1 or pieces[0].circle is None:
        return None
    if abs(abs(sum(p.sweep for p in pieces)) - 2 * math.pi) > 1e-6:
        return None
    return Circle(*(_rounded(c) for c in pieces[0].circle))


def _as_polyline(pieces: Sequence[_Piece]) -> Polyline:
    segments = [(p.start[0], p.start[1], p.bulge) for p in pieces]
    if _signed_area(segments) < 0:
        # A segment's bulge belongs to its start, so turning round shifts it by one.
        bulges = [-s[2] for s in segments[::-1]]
        points = [s[:2] for s in segments[::-1]]
        segments = [(x, y, b) for (x, y), b in zip(points, bulges[1:] + bulges[:1], strict=True)]
    lowest = min(range(len(segments)), key=lambda i: (round(segments[i][0], 5), segments[i][1]))
    segments = segments[lowest:] + segments[:lowest]
    return Polyline(tuple((_rounded(x), _rounded(y), _rounded(b)) for x, y, b in segments))


def _rounded(value: float) -> float:
    return round(float(value), DECIMALS) + 0.0


def _signed_area(segments: Sequence[Segment]) -> float:
    """Area within a closed run: shoelace for the chords and a circular segment per bulge."""
    total = 0.0
    for (x0, y0, bulge), (x1, y1, _) in zip(segments, [*segments[1:], segments[0]], strict=True):
        total += (x0 * y1 - x1 * y0) / 2
        if bulge:
            angle = 4 * math.atan(bulge)
            radius = math.hypot(x1 - x0, y1 - y0) / (2 * math.sin(angle / 2))
            total += radius**2 * (angle - math.sin(angle)) / 2
    return total
