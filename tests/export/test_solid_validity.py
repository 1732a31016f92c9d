"""Validity of plates with many holes, against the analyser of the CAD kernel."""

from __future__ import annotations

import math

import cadquery as cq
import pytest

from gelslim_cad.proof.validity import MANY, _lie_apart, is_valid

SIDE = 8
PITCH_MM, RADIUS_MM = 2.0, 0.5


def centres() -> list[tuple[float, float]]:
    middle = PITCH_MM * (SIDE - 1) / 2
    return [
        (PITCH_MM * i - middle, PITCH_MM * j - middle) for i in range(SIDE) for j in range(SIDE)
    ]


def plate() -> cq.Shape:
    blank = cq.Workplane().box(20, 20, 0.2)
    return blank.faces(">Z").workplane().pushPoints(centres()).hole(2 * RADIUS_MM).val()


def perforated(circles: list[tuple[float, float, float]], half_mm: float = 10.0) -> cq.Face:
    """A plane face with round holes (x, y, radius), however they lie."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    corners = [(-half_mm, -half_mm), (half_mm, -half_mm), (half_mm, half_mm), (-half_mm, half_mm)]
    outer = cq.Wire.makePolygon([cq.Vector(x, y, 0) for x, y in corners], close=True)
    made = BRepBuilderAPI_MakeFace(outer.wrapped, True)
    for x, y, radius in circles:
        hole = cq.Wire.makeCircle(radius, cq.Vector(x, y, 0), cq.Vector(0, 0, -1))
        made.Add(hole.wrapped)
    return cq.Face(made.Face())


def holes(**moved: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    """The regular holes; `first` replaces one of them."""
    regular = [(x, y, RADIUS_MM) for x, y in centres()]
    return [moved.get("first", regular[0]), *regular[1:]]


def test_a_plate_with_many_holes_is_valid() -> None:
    made = plate()
    assert SIDE**2 > MANY
    assert made.isValid()
    assert is_valid(made)


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param((-5.9, -7.0, 0.5), id="two holes overlap"),
        pytest.param((-9.7, -7.0, 0.5), id="a hole crosses the boundary"),
        pytest.param((-14.0, -7.0, 0.5), id="a hole lies outside"),
    ],
)
def test_holes_that_meet_or_leave_the_plate_are_told(wrong: tuple[float, float, float]) -> None:
    import numpy as np

    circles = holes(first=wrong)
    spoilt = perforated(circles)
    assert not spoilt.isValid()
    assert not is_valid(spoilt)
    table = np.array([(x, y, 0.0, r) for x, y, r in circles])
    assert not _lie_apart(spoilt, table)


def test_the_area_tells_a_boundary_that_is_no_hole() -> None:
    import numpy as np

    good = perforated(holes())
    table = np.array([(x, y, 0.0, r) for x, y, r in holes()])
    assert math.isclose(good.Area(), 400 - SIDE**2 * math.pi * RADIUS_MM**2, rel_tol=1e-9)
    assert _lie_apart(good, table)
    table[:, 3] *= 0.9
    assert not _lie_apart(good, table)


def test_a_shell_with_a_missing_face_is_not_closed() -> None:
    made = plate()
    open_shell = cq.Shell.makeShell(
        [f for f in made.Faces() if f.geomType() == "PLANE" and len(f.innerWires()) == 0][:-1]
        + [f for f in made.Faces() if f.geomType() != "PLANE" or len(f.innerWires()) > 0]
    )
    solid = cq.Solid.makeSolid(open_shell)
    assert not is_valid(solid)
