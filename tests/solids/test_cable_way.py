"""The cable and the wires: bent no sharper than allowed, and closed in from below."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import manifold3d
import numpy as np
import pytest
from finger_samples import FINGERS, each_finger, finger, part, parts_of, random_spec
from sampled import quick
from shipped_fingers import DESIGNS

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.export.mesh import tessellate
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import TOLERANCE_MM3
from gelslim_cad.solids.cable import camera_cable, outside_x_mm
from gelslim_cad.solids.shapes import box
from gelslim_cad.solids.tube import path_edges, tube
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.plan import with_values

STAYS = (
    "body",
    "tip_bezel",
    "light_guide",
    "gel_pad",
    "shim_",
    "bezel_",
    "cover_insert",
    "cover_nut",
)
"""What is in place when the cover closes; the adapter and its bolts come later."""
LATER = ("gripper_adapter", "mount_bolt", "cover_screw")
STEP_MM = 0.5


def whole(solids: Iterable[object]) -> manifold3d.Manifold:
    """Fine meshes of solids as one body."""
    bodies = []
    for solid in solids:
        mesh = tessellate(solid, 0.03, 12.0)
        points, faces = mesh.vertices_mm.astype(np.float32), mesh.faces.astype(np.uint32)
        bodies.append(manifold3d.Manifold(manifold3d.Mesh(points, faces)))
        assert bodies[-1].status() == manifold3d.Error.NoError
    return manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)


def groups(parts: Iterable[Part]) -> tuple[list[Part], list[Part]]:
    """The parts that stay, and the cover with all that it carries."""
    kept = [p for p in parts if not p.name.startswith(LATER)]
    stay = [p for p in kept if p.name.startswith(STAYS)]
    return stay, [p for p in kept if p not in stay]


def largest_common_mm3(
    stay: manifold3d.Manifold, moving: manifold3d.Manifold, way_mm: float
) -> float:
    """Largest common volume on the way down from the assembled place."""
    steps = np.arange(0.0, way_mm + STEP_MM, STEP_MM)
    return max(float((stay ^ moving.translate((0, 0, -float(s)))).volume()) for s in steps)


@pytest.mark.slow
@pytest.mark.parametrize("name", quick(FINGERS, lambda name: name == "mini20"))
def test_the_cover_closes_from_below_with_all_that_it_carries(name: str) -> None:
    stay, moving = groups(parts_of(name))
    assert {"camera", "camera_cable", "led_wire_4", "mirror", "led_board_red"} <= {
        p.name for p in moving
    }
    body, group = whole(p.solid for p in stay), whole(p.solid for p in moving)
    way = finger(name)["finger.thickness_mm"] + 1.0
    assert largest_common_mm3(body, group, way) < TOLERANCE_MM3
    # A closed hole as the one before, at the cable's height: the cable catches in its floor.
    d = finger(name)
    level, cable = d["cable.level_z_mm"], d["camera.cable_width_mm"] / 2 + 0.2
    x = (d["finger.proximal_x_mm"], d["chamber.rear_x_mm"])
    filled = box(x, (-cable, cable), (-d["finger.thickness_mm"], level - 1.25))
    only_cable = whole([part(name, "camera_cable").solid])
    closed = whole([part(name, "body").solid, filled])
    assert largest_common_mm3(closed, only_cable, 3.0) > 0.1


@each_finger
def test_the_camera_drops_into_its_clamp_with_its_cable(name: str) -> None:
    """Out along the camera's height, which is the way in; the cable stays below."""
    d = finger(name)
    if d["camera.cable_exit"] == "top":
        pytest.skip("the cable is laid back after the camera is in")
    clamp = whole([part(name, "camera_clamp").solid])
    camera = whole([part(name, "camera").solid])
    p = math.radians(d["camera_pose.pitch_deg"])
    up = np.array([math.sin(p), 0.0, math.cos(p)])
    for step in np.arange(0.0, d["camera.module_height_mm"] + 2, STEP_MM):
        moved = camera.translate(tuple(float(v) for v in step * up))
        assert (clamp ^ moved).volume() < 5 * TOLERANCE_MM3, step


def with_exit(leaves: str, **values: float | str) -> Dimensions:
    """A finger whose cable leaves the module where it is told."""
    changed = {f"camera.{k}": v for k, v in values.items()}
    spec = read_spec(next(path for path in DESIGNS if path.stem == "mini20")).spec
    return derive(with_values(spec, {"camera.cable_exit": leaves, **changed}))


def test_a_cable_that_leaves_level_is_straight() -> None:
    """This camera looks along the finger to within 1e-9 degrees."""
    d = derive(random_spec(1))
    assert abs(d["camera_pose.pitch_deg"]) < 1e-3
    faces = camera_cable(d).solid.Faces()
    assert {f.geomType() for f in faces} == {"PLANE"}


@pytest.mark.parametrize("leaves", ["rear", "bottom", "top"])
@pytest.mark.parametrize("kind", ["flat", "round"])
def test_the_cable_is_as_long_and_as_gently_bent_as_its_dimensions_say(
    leaves: str, kind: str
) -> None:
    """Pappus: the volume of a bent section is its area times the way of its centre."""
    d = with_exit(leaves, cable_kind=kind, cable_width_mm=2.0, cable_bend_radius_mm=2.5)
    width, thick = d["camera.cable_width_mm"], d["cable.thickness_mm"]
    area = math.pi / 4 * width**2 if kind == "round" else width * thick
    flange = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    length = d["cable.inside_mm"] + flange - outside_x_mm(d)
    end = d["camera.connector_width_mm"] * d["camera.connector_thickness_mm"]
    # The connector reaches half a millimetre over the cable's end.
    inside = 0.5 * (area if kind == "flat" else _covered(width, d))
    expected = area * length + end * (d["camera.connector_length_mm"] + 0.5) - inside
    cable = camera_cable(d).solid
    assert cable.Volume() == pytest.approx(expected, rel=1e-6)
    bent = [e.radius() for e in cable.Edges() if e.geomType() == "CIRCLE" and _in_plane(e)]
    assert min(bent) >= 2.5 - 1e-6
    if kind == "flat":
        assert sorted({round(r, 6) for r in bent}) == [2.5, 2.5 + thick]


def _covered(width: float, d: Dimensions) -> float:
    """Area that a round cable and the flat end behind it share."""
    half, r = d["camera.connector_thickness_mm"] / 2, width / 2
    return 2 * (half * math.sqrt(r * r - half * half) + r * r * math.asin(half / r))


def _in_plane(edge: object) -> bool:
    """Whether an arc lies in a plane along the finger."""
    box_ = edge.BoundingBox(1e-6)  # type: ignore[attr-defined]
    return bool(box_.ylen < 1e-5)


def test_a_tube_has_the_volume_of_its_path_and_keeps_its_radius() -> None:
    points = [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (10.0, 8.0, 0.0), (10.0, 8.0, -9.0)]
    edges = path_edges(points, 2.0)
    # Two right angles, each shortened from 2 R to half a turn's quarter.
    length = 10 + 8 + 9 - 2 * (2 * 2.0 - math.pi / 2 * 2.0)
    assert sum(e.Length() for e in edges) == pytest.approx(length, rel=1e-9)
    assert tube(points, 2.0, 0.8).Volume() == pytest.approx(math.pi * 0.16 * length, rel=1e-6)
    for first, second in pairwise(edges):
        assert (first.tangentAt(1) - second.tangentAt(0)).Length < 1e-9


def test_a_tube_through_points_on_a_line_is_straight() -> None:
    straight = tube([(0, 0, 0), (1, 0, 0), (1, 0, 0), (4, 0, 0)], 2.0, 1.0)
    assert straight.Volume() == pytest.approx(math.pi / 4 * 4, rel=1e-9)
