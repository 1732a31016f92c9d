"""Parts the export and proof tests are tried on, with their volumes in closed form."""

from __future__ import annotations

import math
from typing import Any

import cadquery as cq

from gelslim_cad.geometry.part import Part

GREY = (0.5, 0.52, 0.55, 1.0)
GLASS = (0.6, 0.8, 0.95, 0.35)


def part(name: str, solid: Any, **changes: Any) -> Part:
    values: dict[str, Any] = {"material": "resin", "process": "print", "colour": GREY} | changes
    return Part(name=name, solid=solid, **values)


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> cq.Solid:
    corner = cq.Vector(at[0] - x / 2, at[1] - y / 2, at[2] - z / 2)
    return cq.Solid.makeBox(x, y, z, corner)


def drilled_plate() -> cq.Shape:
    """40 x 20 x 6 plate, vertical edges filleted R3, four through holes of diameter 4."""
    plate = cq.Workplane("XY").box(40, 20, 6).edges("|Z").fillet(3)
    return plate.faces(">Z").workplane().rect(28, 10, forConstruction=True).vertices().hole(4).val()


def drilled_plate_area_mm2() -> float:
    return 40 * 20 - (4 - math.pi) * 9 - 4 * math.pi * 4


def window() -> cq.Shape:
    """Thin window 1.5 thick with a 90 degree bend of inner radius 2.5 and legs on both sides."""
    t, r, half, leg, length = 1.5, 2.5, 10.0, 6.0, 30.0
    outer = r + t
    profile = (
        cq.Workplane("YZ")
        .moveTo(-half, 0)
        .lineTo(half, 0)
        .radiusArc((half + outer, -outer), outer)
        .lineTo(half + outer, -outer - leg)
        .lineTo(half + r, -outer - leg)
        .lineTo(half + r, -outer)
        .radiusArc((half, -t), -r)
        .lineTo(-half, -t)
        .radiusArc((-half - r, -outer), -r)
        .lineTo(-half - r, -outer - leg)
        .lineTo(-half - outer, -outer - leg)
        .lineTo(-half - outer, -outer)
        .radiusArc((-half, 0), outer)
        .close()
    )
    return profile.extrude(length / 2, both=True).val()


def window_volume_mm3() -> float:
    return 30.0 * (20.0 * 1.5 + 2 * 6.0 * 1.5 + 2 * math.pi / 4 * (4.0**2 - 2.5**2))


def frustum_loft() -> cq.Shape:
    """Square 12 at z=0 ruled to square 6 at z=9."""
    return cq.Workplane("XY").rect(12, 12).workplane(offset=9).rect(6, 6).loft(ruled=True).val()


def smooth_loft() -> cq.Shape:
    return cq.Workplane("XY").rect(12, 8).workplane(offset=9).circle(3).loft().val()


def pole_on_face() -> cq.Shape:
    """A dimple cut by a sphere whose pole lies inside the cut: valid as a solid."""
    plate = cq.Workplane("XY").box(10, 10, 4)
    ball = cq.Workplane("XY").sphere(3).translate((0, 0, 4))
    return plate.cut(ball).val()


def tangent_cuts() -> cq.Shape:
    """A hole that only touches a slot along a line: valid for OCCT, yet no closed manifold."""
    plate = cq.Workplane("XY").box(12, 12, 4).faces(">Z").workplane().hole(4)
    return plate.cut(cq.Workplane("XY").box(2, 6, 9).translate((3, 0, 0))).val()


def open_box() -> cq.Shape:
    """A solid whose shell lacks a face."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for face in box(4, 4, 4).Faces()[:-1]:
        builder.Add(shell, face.wrapped)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    return cq.Shape.cast(solid)


def busy_part() -> cq.Shape:
    """About 200 faces: a filleted housing with a grid of holes, pockets and bosses."""
    body = cq.Workplane("XY").box(60, 40, 14).edges("|Z").fillet(4)
    body = body.faces(">Z").edges().fillet(1)
    body = body.faces("<Z").workplane().rect(54, 34).cutBlind(-11)
    body = body.faces(">Z").workplane().rarray(4.5, 4.5, 11, 7).hole(2)
    body = (
        body.faces(">Y").workplane(centerOption="CenterOfBoundBox").rarray(6, 5, 8, 2).hole(1.5, 3)
    )
    bosses = cq.Workplane("XY").rarray(44, 20, 2, 2).circle(2.5).extrude(6.5)
    pins = cq.Workplane("XY").rarray(44, 20, 2, 2).circle(1).extrude(6)
    body = body.union(bosses.cut(pins))
    slots = (
        cq.Workplane("XZ").rarray(7.5, 30, 6, 1).slot2D(6, 2, 90).extrude(40).translate((0, 0, -1))
    )
    return body.cut(slots).val()


SHAPES = {
    "plate": drilled_plate,
    "window": window,
    "frustum": frustum_loft,
    "loft": smooth_loft,
    "cylinder": lambda: cq.Solid.makeCylinder(5, 12),
    "sphere": lambda: cq.Workplane("XY").sphere(6).val(),
    "cone": lambda: cq.Solid.makeCone(5, 0, 8),
    "torus": lambda: cq.Solid.makeTorus(8, 2),
    "dimple": pole_on_face,
    "busy": busy_part,
}
