"""DXF outlines (R2010, mm) for laser-cut blanks and cutting templates."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import only_solid
from gelslim_cad.export.contour import Circle, contours_of, frame_of
from gelslim_cad.markers.dxf import fixed_metadata

_CUT_COLOUR, _ENGRAVE_COLOUR = 1, 5
_MILLIMETRES = 4


def outline_dxf_bytes(shape: Any) -> bytes:
    """Draw a flat part 1:1 as closed outlines on layer CUT; layer ENGRAVE is left empty.

    Lines and arcs become closed LWPOLYLINEs with bulges, circles become CIRCLEs, and other curves
    become chords within 0.002 mm. The drawing keeps the part's coordinates; `contour.frame_of`
    says which axes show.

    Args:
        shape: A solid of constant thickness or one planar `cadquery.Face`.

    Raises:
        ExportError: The solid is not flat, or the face is not planar.
    """
    face = shape if shape.ShapeType() == "Face" else flat_face(only_solid(shape, "outline"))
    if face.geomType() != "PLANE":
        raise ExportError(f"outline: the face is a {face.geomType()}; give a planar face")
    document = _new_document()
    document.layers.add("CUT", color=_CUT_COLOUR)
    space, where = document.modelspace(), {"layer": "CUT"}
    for contour in contours_of(face.Wires(), frame_of(_normal(face))):
        if isinstance(contour, Circle):
            space.add_circle((contour.x_mm, contour.y_mm), contour.radius_mm, dxfattribs=where)
        else:
            space.add_lwpolyline(contour.segments, format="xyb", close=True, dxfattribs=where)
    document.layers.add("ENGRAVE", color=_ENGRAVE_COLOUR)
    return _document_bytes(document)


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
    sheets = [
        (thickness, face)
        for thickness, face in ((_thickness(solid, f), f) for f in planar)
        if abs(face.Area() * thickness / volume - 1) < 1e-6 and thickness**2 <= face.Area()
    ]
    if not sheets:
        face = max(planar, key=lambda f: float(f.Area()))
        ratio = volume / (face.Area() * _thickness(solid, face))
        raise ExportError(
            f"outline: volume is {ratio:.6f} x largest face x thickness, must be 1; the solid is "
            "not a flat plate: give the face of its flat blank instead"
        )
    # After rounding, top and bottom are equal; then the face on the positive side is taken.
    return min(sheets, key=lambda s: (round(s[0], 6), -_side(s[1])))[1]


def _thickness(solid: Any, face: Any) -> float:
    normal = _normal(face)
    heights = [float(normal @ v.toTuple()) for v in solid.Vertices()]
    return max(heights) - min(heights)


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
