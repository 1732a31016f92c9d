"""DXF outlines (R2010, mm) for laser-cut blanks and cutting templates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.contour import Circle, Contour, contours_of, frame_of
from gelslim_cad.export.dxf import document_bytes, new_document
from gelslim_cad.export.error import ExportError

CUT, ENGRAVE = "CUT", "ENGRAVE"
_LAYER_COLOURS = {CUT: 1, ENGRAVE: 5}


def outline_dxf_bytes(
    cut: Any | Sequence[Any], *, engrave: Sequence[Any] = (), chord_mm: float = 0.002
) -> bytes:
    """Draw shapes 1:1 as closed outlines: `cut` on layer CUT, `engrave` on layer ENGRAVE.

    A shape is a planar `cadquery.Face` (its outer and inner wires), a closed planar `Wire`, or
    a solid of constant thickness (its largest face). All lie in the plane of the first and
    keep the part's coordinates (`contour.frame_of` says which axes show).

    Lines and arcs become closed LWPOLYLINEs with bulges, circles CIRCLE; other curves are
    chords within `chord_mm`.

    Raises:
        ExportError: nothing to cut, an open or non-planar outline, planes that are not
            parallel, or a solid that is not flat.
    """
    cuts = [_flat(s) for s in _listed(cut)]
    engraved = [_flat(s) for s in engrave]
    if not cuts:
        raise ExportError("outline: 0 shapes to cut given, at least 1 needed")
    normal = _normal(cuts[0])
    _check_parallel([*cuts, *engraved], normal)
    frame = frame_of(normal)
    layers = {
        CUT: contours_of(_wires(cuts), frame, chord_mm),
        ENGRAVE: contours_of(_wires(engraved), frame, chord_mm),
    }
    return _dxf(layers)


def flat_face(solid: Any) -> Any:
    """The face whose outline cuts a solid of constant thickness from sheet.

    Of the planar faces with volume = area x thickness (to 1e-6) the one of least thickness.

    Raises:
        ExportError: there is none, or the thickness exceeds the root of the area: such a solid
            is a bar or a bent sheet, not a flat part.
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
    # Rounding lets top and bottom tie; the tie goes to the face on the positive side.
    return min(sheets, key=lambda s: (round(s[0], 6), -_side(s[1])))[1]


def _thickness(solid: Any, face: Any) -> float:
    normal = _normal(face)
    heights = [float(normal @ v.toTuple()) for v in solid.Vertices()]
    return max(heights) - min(heights)


def _side(face: Any) -> float:
    normal = _normal(face)
    return round(float(np.dot(normal, frame_of(normal).normal)), 6)


def _listed(shapes: Any) -> list[Any]:
    return list(shapes) if isinstance(shapes, Iterable) and not _is_shape(shapes) else [shapes]


def _is_shape(value: Any) -> bool:
    import cadquery as cq

    return isinstance(value, cq.Shape)


def _flat(shape: Any) -> Any:
    kind = shape.ShapeType() if _is_shape(shape) else type(shape).__name__
    if kind in ("Solid", "Compound"):
        from gelslim_cad.export.brep import only_solid

        return flat_face(only_solid(shape, "outline"))
    if kind == "Face" and shape.geomType() != "PLANE":
        raise ExportError(f"outline: the face is a {shape.geomType()}; give a planar face")
    if kind not in ("Face", "Wire"):
        raise ExportError(f"outline: cannot draw a {kind}; give a face, a closed wire or a solid")
    return shape


def _normal(shape: Any) -> NDArray[np.float64]:
    if shape.ShapeType() == "Face":
        return np.array(shape.normalAt().toTuple())
    import cadquery as cq

    try:
        return np.array(cq.Face.makeFromWires(shape).normalAt().toTuple())
    except ValueError as error:
        raise ExportError("outline: a wire is open or not planar; close and flatten it") from error


def _check_parallel(shapes: Sequence[Any], normal: NDArray[np.float64]) -> None:
    for shape in shapes:
        aligned = abs(float(_normal(shape) @ normal))
        if aligned < 1 - 1e-9:
            raise ExportError(
                f"outline: planes differ by {np.degrees(np.arccos(aligned)):.3g} deg, must be "
                "parallel; write each plane to its own file"
            )


def _wires(shapes: Sequence[Any]) -> list[Any]:
    return [w for s in shapes for w in ([s] if s.ShapeType() == "Wire" else s.Wires())]


def _dxf(layers: dict[str, list[Contour]]) -> bytes:
    document = new_document()
    space = document.modelspace()
    for layer, contours in layers.items():
        document.layers.add(layer, color=_LAYER_COLOURS[layer])
        for contour in contours:
            where = {"layer": layer}
            if isinstance(contour, Circle):
                middle = (contour.x_mm, contour.y_mm)
                space.add_circle(middle, contour.radius_mm, dxfattribs=where)
            else:
                space.add_lwpolyline(contour.segments, format="xyb", close=True, dxfattribs=where)
    return document_bytes(document)
