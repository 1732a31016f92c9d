"""The adapter of each gripper: holes where the jaw has its bolts, flange as the rules take it."""

from __future__ import annotations

import math
from functools import cache

import pytest

pytest.importorskip("cadquery", reason="solids need the [cad] extra")

from shipped_fingers import DESIGNS

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.fasteners import SCREWS
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import interferences
from gelslim_cad.solids.adapter import adapter
from gelslim_cad.solids.body import body
from gelslim_cad.solids.cover import cover
from gelslim_cad.solids.reuse import PartStore
from gelslim_cad.spec import Spec
from gelslim_cad.spec.gripper_library import gripper_names, library_gripper
from gelslim_cad.spec.reader import read_spec

STORE = PartStore()
"""What no gripper changes is made once."""
MINI20 = next(path for path in DESIGNS if path.stem == "mini20")


def spec_with(**mount: object) -> Spec:
    data = read_spec(MINI20).spec.model_dump()
    data["design"]["mount"] |= mount
    return Spec(**data)


@cache
def made(gripper: str) -> tuple[Dimensions, Part]:
    d = derive(spec_with(gripper=gripper))
    return d, adapter(d)


def holes_mm(part: Part, axis: str, diameter_mm: float) -> list[tuple[float, float, float]]:
    """Middles of the cylinders of this diameter along an axis, from the faces of the solid."""
    found = []
    for face in part.solid.Faces():
        if face.geomType() != "CYLINDER":
            continue
        cylinder = face._geomAdaptor().Cylinder()
        direction = cylinder.Axis().Direction()
        along = {"x": direction.X(), "z": direction.Z()}[axis]
        if abs(along) > 1 - 1e-9 and abs(2 * cylinder.Radius() - diameter_mm) < 1e-9:
            found.append(face.Center().toTuple())
    return found


@pytest.mark.parametrize("name", gripper_names())
def test_holes_lie_where_the_jaw_has_its_bolts(name: str) -> None:
    d, part = made(name)
    jaw = library_gripper(name).jaw
    size = SCREWS[jaw.bolt]
    behind = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    if jaw.face == "axial":
        found = {(round(y, 6), round(z - d["flange.jaw_z_mm"], 6)) for _, y, z in holes_mm(
            part, "x", size.clearance_mm
        )}  # fmt: skip
    else:
        middle = behind - jaw.depth_mm / 2
        found = {
            (round(y, 6), round(x - middle, 6))
            for x, y, _ in holes_mm(part, "z", size.clearance_mm)
            if x < behind
        }
    assert found == set(jaw.holes_mm)


@pytest.mark.parametrize("name", gripper_names())
def test_the_adapter_meets_no_part_of_the_finger_and_its_jaw_face_is_flat(name: str) -> None:
    d, part = made(name)
    assert interferences((part, *STORE.parts(d, (body, cover)))) == []
    jaw, low = library_gripper(name).jaw, d["flange.jaw_z_mm"]
    size = SCREWS[jaw.bolt]
    # A head and the edge fit around every bolt, on the side away from the jaw.
    box = part.solid.BoundingBox()
    half = d["flange.width_mm"] / 2
    assert (box.ymin, box.ymax) == (pytest.approx(-half), pytest.approx(half))
    if jaw.face == "axial":
        assert box.zmin == pytest.approx(low - d["flange.foot_mm"] / 2)
        assert box.xmin == pytest.approx(d["finger.proximal_x_mm"] - d["flange.thickness_mm"])
        below = -d["finger.thickness_mm"] - (low + max(u for _, u in jaw.holes_mm))
        assert below >= size.cap_head_mm / 2
    else:
        behind = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
        assert box.xmin == pytest.approx(behind - jaw.depth_mm)
        assert box.zmin == pytest.approx(low)


def test_the_generic_flange_is_what_it_was() -> None:
    d, part = made("generic")
    prox, back = d["finger.proximal_x_mm"], -d["finger.thickness_mm"]
    box = part.solid.BoundingBox()
    # Two M4 (head 7 mm) 20 mm apart in a strip of 7 + 2 * 2 mm below the back, 5 mm thick.
    assert (box.zmin, box.xmin) == (pytest.approx(back - 11), pytest.approx(prox - 5))
    assert box.ymax == pytest.approx(max(d["finger.width_mm"] / 2, 10 + 3.5 + 2))
    centres = {(round(y, 6), round(z - back, 6)) for _, y, z in holes_mm(part, "x", 4.3)}
    assert centres == {(-10, -5.5), (10, -5.5)}
    assert part.note.startswith("for any gripper with 2 × M4")


def test_fields_of_the_flange_prevail() -> None:
    d = derive(
        spec_with(
            gripper="wsg50",
            flange_bolt="M5",
            flange_bolt_spacing_mm=16.0,
            flange_thickness_mm=8.0,
        )
    )
    part = adapter(d)
    found = {round(y, 6) for _, y, _ in holes_mm(part, "x", SCREWS["M5"].clearance_mm)}
    assert found == {-8, 8}
    assert part.solid.BoundingBox().xmin == pytest.approx(d["finger.proximal_x_mm"] - 8)
    assert "measure" not in part.note
    assert "measure" in made("wsg50")[1].note
    lateral = adapter(derive(spec_with(gripper="robotiq_2f85", flange_bolt_spacing_mm=24.0)))
    xs = sorted({round(x, 6) for x, _, _ in holes_mm(lateral, "z", 5.3)})
    assert xs[1] - xs[0] == pytest.approx(24)


@pytest.mark.parametrize("name", [n for n in gripper_names() if n != "generic"])
def test_gels_of_two_fingers_are_apart_as_the_rule_says(name: str) -> None:
    """Fingers face each other; the distance of the gels follows from that of the holes or faces."""
    from gelslim_cad.dimensions.mount import opening_mm

    d, part = made(name)
    gripper = library_gripper(name)
    jaw = gripper.jaw
    if jaw.face == "axial":
        places = holes_mm(part, "x", SCREWS[jaw.bolt].clearance_mm)
        at = sum(z for _, _, z in places) / len(places)
    else:
        at = part.solid.BoundingBox().zmin
    open_mm = jaw.closed_gap_mm + gripper.stroke_mm
    # From the jaw's plane the finger reaches to z = 0 on its side of the object.
    assert opening_mm(name, d["flange.jaw_z_mm"]) == pytest.approx(open_mm - 2 * abs(at))
    assert jaw.closed_gap_mm - 2 * abs(at) <= 1e-9, "the fingers meet when the jaws close"
    assert math.isfinite(open_mm)
