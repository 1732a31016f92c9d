"""DXF outlines (R2010, mm) for laser-cut blanks and cutting templates."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import only_solid
from gelslim_cad.export.contour import (
    DECIMALS,
    Circle,
    Contour,
    Polyline,
    contours_of,
    frame_of,
)
from gelslim_cad.markers.dxf import fixed_metadata
from gelslim_cad.markers.kerf import KerfError, offset_gain_mm2, offset_outline
from gelslim_cad.markers.outline import Outline

_CUT_COLOUR, _ENGRAVE_COLOUR = 1, 5
_NOTES, _NOTES_COLOUR, _TEXT_MM, _NOTES_GAP_MM = "NOTES", 8, 2.0, 3.0
_MILLIMETRES = 4


def outline_dxf_bytes(shape: Any, kerf_mm: float = 0.0, label: str = "") -> bytes:
    """Draw a flat part 1:1 as closed outlines on layer CUT; layer ENGRAVE is left empty.

    The path is moved by half the kerf, out of the part: outlines outwards, holes inwards. Layer
    NOTES, which is not plotted, says in words what stays.

    Lines and arcs become closed LWPOLYLINEs with bulges, circles become CIRCLEs, and other curves
    become chords within 0.002 mm. The drawing keeps the part's coordinates; `contour.frame_of`
    says which axes show.

    Args:
        shape: A solid of constant thickness or one planar `cadquery.Face`.
        kerf_mm: Width of the cut, 0 where the cutter compensates it.
        label: Name, size and material of the part, for the note.

    Raises:
        ExportError: The solid is not flat, or the face is not planar.
        KerfError: A detail is narrower than the cut.
    """
    face = shape if shape.ShapeType() == "Face" else flat_face(only_solid(shape, "outline"))
    if face.geomType() != "PLANE":
        raise ExportError(f"outline: the face is a {face.geomType()}; give a planar face")
    document = _new_document()
    document.layers.add("CUT", color=_CUT_COLOUR)
    space, where = document.modelspace(), {"layer": "CUT"}
    contours = moved_contours(face, kerf_mm)
    for contour in contours:
        if isinstance(contour, Circle):
            space.add_circle((contour.x_mm, contour.y_mm), contour.radius_mm, dxfattribs=where)
        else:
            space.add_lwpolyline(contour.segments, format="xyb", close=True, dxfattribs=where)
    document.layers.add("ENGRAVE", color=_ENGRAVE_COLOUR)
    named = f"{label}, {_size(moved_contours(face, 0.0))}" if label else ""
    _write_notes(document, contours, kerf_note(kerf_mm, named))
    return _document_bytes(document)


def moved_contours(face: Any, kerf_mm: float) -> list[Contour]:
    """Contours of a face, moved out of it by half the kerf, in a fixed order.

    Raises KerfError where a detail is narrower than the cut.
    """
    frame, outer = frame_of(_normal(face)), face.outerWire()
    drawn = contours_of(face.Wires(), frame)
    if kerf_mm == 0:
        return drawn
    (outside,) = contours_of([outer], frame)
    return [moved(c, kerf_mm / 2 if c == outside else -kerf_mm / 2) for c in drawn]


def kept_area_mm2(face: Any, kerf_mm: float) -> float:
    """Area within the paths of a face: its own, and what they enclose more of it.

    Computed from lengths and corners, not from the paths.
    """
    frame = frame_of(_normal(face))
    (outside,) = contours_of([face.outerWire()], frame)
    inside = contours_of(face.innerWires(), frame)
    half = kerf_mm / 2
    gains = [_gain(outside, half), *(-_gain(hole, -half) for hole in inside)]
    return float(face.Area()) + sum(gains)


def _gain(contour: Contour, distance_mm: float) -> float:
    if isinstance(contour, Circle):
        wider = contour.radius_mm + distance_mm
        return math.pi * (wider**2 - contour.radius_mm**2)
    segments = np.array(contour.segments)
    return offset_gain_mm2(Outline(segments[:, :2], segments[:, 2]), distance_mm)


def moved(contour: Contour, distance_mm: float) -> Contour:
    """A contour moved outwards by a distance; inwards where it is negative.

    Raises KerfError where a detail is narrower than twice the distance.
    """
    if isinstance(contour, Circle):
        radius = contour.radius_mm + distance_mm
        if radius <= 0:
            raise KerfError(
                f"a hole of {2 * contour.radius_mm:g} mm is narrower than the cut; make "
                "manufacturing.kerf smaller"
            )
        return replace(contour, radius_mm=radius)
    segments = np.array(contour.segments)
    path = offset_outline(Outline(segments[:, :2], segments[:, 2]), distance_mm)
    rows = np.round(np.column_stack([path.points_mm, path.bulges]), DECIMALS) + 0.0
    return Polyline(tuple((x, y, bulge) for x, y, bulge in rows.tolist()))


def kerf_note(kerf_mm: float, label: str = "") -> str:
    """Which side of the line stays, in words."""
    line = (
        "lines are the part's own edges; let the cutter compensate its kerf"
        if kerf_mm == 0
        else f"lines lie {kerf_mm / 2:g} mm outside the part (kerf {kerf_mm:g} mm); no compensation"
    )
    named = f"{label}: " if label else ""
    return f"{named}inside the outer line stays, openings fall out; {line}"


def _write_notes(document: Any, contours: Sequence[Contour], text: str) -> None:
    """A line of text under the drawing, on a layer that is not plotted."""
    document.layers.add(_NOTES, color=_NOTES_COLOUR).dxf.plot = 0
    left, low = np.array([_bounds(contour)[:2] for contour in contours]).min(axis=0).tolist()
    at = (round(left, 3), round(low - 2 * _TEXT_MM - _NOTES_GAP_MM, 3))
    document.modelspace().add_text(
        text, height=_TEXT_MM, dxfattribs={"layer": _NOTES, "insert": at}
    )


def _size(contours: Sequence[Contour]) -> str:
    along, across = drawn_size_mm(contours)
    return f"{along:.2f} x {across:.2f} mm"


def drawn_size_mm(contours: Sequence[Contour]) -> tuple[float, float]:
    """Length and width of a drawing."""
    boxes = np.array([_bounds(contour) for contour in contours])
    along, across = boxes[:, 2:].max(axis=0) - boxes[:, :2].min(axis=0)
    return float(along), float(across)


def cut_length_mm(contours: Sequence[Contour]) -> float:
    """Length of all paths; an arc of bulge b over a chord c has c (1 + b²) atan(b) / b."""
    return math.fsum(map(_length_mm, contours))


def _length_mm(contour: Contour) -> float:
    if isinstance(contour, Circle):
        return 2 * math.pi * contour.radius_mm
    rows = np.array(contour.segments)
    chords = np.linalg.norm(np.roll(rows[:, :2], -1, axis=0) - rows[:, :2], axis=1)
    bulge = rows[:, 2]
    safe = np.where(bulge == 0, 1.0, bulge)
    stretch = np.where(bulge == 0, 1.0, (1 + safe**2) * np.arctan(safe) / safe)
    return float(chords @ stretch)


def _bounds(contour: Contour) -> tuple[float, float, float, float]:
    """Least and greatest x and y: x0, y0, x1, y1."""
    if isinstance(contour, Circle):
        x, y, r = contour.x_mm, contour.y_mm, contour.radius_mm
        return x - r, y - r, x + r, y + r
    segments = np.array(contour.segments)
    return Outline(segments[:, :2], segments[:, 2]).bounds_mm


def flat_face(solid: Any) -> Any:
    """Find the face whose outline cuts a solid of constant thickness from sheet.

    A planar face qualifies where volume = area x thickness (to 1e-6) and the thickness does not
    exceed the root of the area: otherwise the solid is a bar or a bent sheet. Of several faces the
    one with the least thickness is taken.

    Raises:
        ExportError: No face qualifies.
    """
    planar = [f for f in solid.Faces() if f.geomType() == "PLANE"]
    if not planar:
        raise ExportError("outline: the solid has no planar face; give a flat part or a face")
    volume = solid.Volume()
    corners = np.array([v.toTuple() for v in solid.Vertices()])
    sheets = [
        (thickness, face)
        for thickness, face in ((_thickness(corners, f), f) for f in planar)
        if abs(face.Area() * thickness / volume - 1) < 1e-6 and thickness**2 <= face.Area()
    ]
    if not sheets:
        face = max(planar, key=lambda f: float(f.Area()))
        ratio = volume / (face.Area() * _thickness(corners, face))
        raise ExportError(
            f"outline: volume is {ratio:.6f} x largest face x thickness, must be 1; the solid is "
            "not a flat plate: give the face of its flat blank instead"
        )
    # After rounding, top and bottom are equal; then the face on the positive side is taken.
    return min(sheets, key=lambda s: (round(s[0], 6), -_side(s[1])))[1]


def _thickness(corners: NDArray[np.float64], face: Any) -> float:
    """Extent of the corners (n, 3) across a plane face."""
    return float(np.ptp(corners @ _normal(face)))


def _side(face: Any) -> float:
    normal = _normal(face)
    return round(float(np.dot(normal, frame_of(normal).normal)), 6)


def _normal(face: Any) -> NDArray[np.float64]:
    return np.array(face.normalAt().toTuple())


def _new_document() -> Any:
    import ezdxf

    with fixed_metadata():
        document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = _MILLIMETRES
    document.header["$MEASUREMENT"] = 1
    return document


def _document_bytes(document: Any) -> bytes:
    # ezdxf lists the classes in use in the order of a set of strings, which differs between
    # processes; classes that were added before keep their order.
    for name in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(name)
    stream = io.StringIO()
    with fixed_metadata():
        document.write(stream)
    return stream.getvalue().encode("utf-8")
