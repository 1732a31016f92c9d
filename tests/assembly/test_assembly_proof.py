"""The proof that a finger goes together: it holds for the designs, and it can fail."""

from __future__ import annotations

import pickle
from dataclasses import replace
from itertools import pairwise

import assembly_samples as samples
import manifold3d
import numpy as np
import pytest
from sampled import quick

from gelslim_cad.assembly.bodies import (
    CHORD_MM,
    FACE_MM,
    SHRINK_MM,
    SLACK_MM,
    Bodies,
    outwards,
    part_meshes,
    shrunk,
)
from gelslim_cad.assembly.drivers import Driver
from gelslim_cad.assembly.order import DOWN, UP, Bench, Fastener, Leg, Step, Vector
from gelslim_cad.assembly.proof import AssemblyBlockedError, prove
from gelslim_cad.dimensions import derive
from gelslim_cad.export.mesh import TriangleMesh
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import interferences
from gelslim_cad.solids.shapes import SolidError

QUICK = "mini20"
each_design = pytest.mark.parametrize("name", quick(samples.NAMES, lambda name: name == QUICK))


def made_of(manifold: manifold3d.Manifold) -> TriangleMesh:
    mesh = manifold.to_mesh()
    points = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
    return TriangleMesh(points, np.asarray(mesh.tri_verts, dtype=np.int64))


def block(size: Vector, at: Vector = (0.0, 0.0, 0.0)) -> TriangleMesh:
    return made_of(manifold3d.Manifold.cube(size).translate(at))


def bodies_of(**meshes: TriangleMesh) -> Bodies:
    return Bodies(dict(meshes), {name: outwards(mesh) for name, mesh in meshes.items()})


def step(moves: str, stays: tuple[str, ...], *legs: Leg, **more: object) -> Step:
    return Step("try", "try", (moves,), stays, legs, (), "nothing", **more)  # type: ignore[arg-type]


# --- the meshes that move ---


def test_the_faces_of_a_box_move_by_the_same_way() -> None:
    box = block((4.0, 3.0, 2.0))
    small = shrunk(box, outwards(box)).vertices_mm
    low, high = small.min(axis=0), small.max(axis=0)
    np.testing.assert_allclose(low, FACE_MM, atol=1e-6)
    np.testing.assert_allclose(high, np.array([4.0, 3.0, 2.0]) - FACE_MM, atol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_no_point_moves_by_more_than_the_limit(seed: int) -> None:
    random = np.random.default_rng(seed)
    body = manifold3d.Manifold.cube((4, 3, 2), True)
    for _ in range(3):
        tool = manifold3d.Manifold.cylinder(9, random.uniform(0.3, 1.0), -1, 16, True)
        body = body - tool.rotate(random.uniform(0, 360, 3).tolist())
    mesh = made_of(body)
    moved = shrunk(mesh, outwards(mesh)).vertices_mm - mesh.vertices_mm
    assert np.linalg.norm(moved, axis=1).max() <= SHRINK_MM + 1e-12


def test_meshes_of_parts_lie_within_the_chord_of_their_solids() -> None:
    """Vertices lie on the solid; here the middles of edges of a cylinder."""
    import cadquery as cq

    for radius in (0.3, 1.0, 4.0):
        rod = Part("rod", cq.Solid.makeCylinder(radius, 5.0), "", "buy", (0, 0, 0, 1))
        mesh = part_meshes([rod])["rod"]
        corners = mesh.vertices_mm[mesh.faces]
        middles = ((corners + np.roll(corners, 1, axis=1)) / 2).reshape(-1, 3)
        inside = (middles[:, 2] > 1e-6) & (middles[:, 2] < 5 - 1e-6)
        assert radius - np.hypot(*middles[inside, :2].T).min() <= CHORD_MM


@pytest.mark.parametrize(("deep", "free"), [(-0.1, True), (0.0, True), (SLACK_MM, False)])
def test_contact_is_free_and_an_overlap_deeper_than_the_slack_is_not(
    deep: float, free: bool
) -> None:
    """A drawer in a slot that is wider by twice `-deep`."""
    slot = manifold3d.Manifold.cube((10, 10, 10), True) - manifold3d.Manifold.cube((4, 4, 20), True)
    side = 4 + 2 * deep
    drawer = block((side, side, 6.0), (-side / 2, -side / 2, -3.0))
    meshes = bodies_of(slot=made_of(slot), drawer=drawer)
    if free:
        assert prove([step("drawer", ("slot",), Leg(UP))], meshes)[0].way == (Leg(UP),)
    else:
        with pytest.raises(AssemblyBlockedError, match="drawer meets slot"):
            prove([step("drawer", ("slot",), Leg(UP))], meshes)


# --- ways ---


def hook() -> Bodies:
    """A tongue under a roof: it must be raised beside it, then slid in."""
    wall = manifold3d.Manifold.cube((2, 4, 10)).translate((5, 0, 0))
    roof = manifold3d.Manifold.cube((7, 4, 2)).translate((0, 0, 8))
    floor = manifold3d.Manifold.cube((7, 4, 2))
    tongue = block((4.5, 3.0, 3.0), (0.0, 0.5, 4.0))
    return bodies_of(room=made_of(wall + roof + floor), tongue=tongue)


def test_a_way_of_two_legs_goes_where_neither_does_alone() -> None:
    along = (1.0, 0.0, 0.0)
    prove([step("tongue", ("room",), Leg(UP), Leg(along, 5.0))], hook())
    with pytest.raises(AssemblyBlockedError) as found:
        prove([step("tongue", ("room",), Leg(UP))], hook())
    assert found.value.block.short_mm == pytest.approx(7.0, abs=0.05)  # tongue's top at the floor
    with pytest.raises(AssemblyBlockedError) as found:  # raised too near
        prove([step("tongue", ("room",), Leg(UP), Leg(along, 3.0))], hook())
    assert found.value.block.short_mm == pytest.approx(7.0 + 3.0, abs=0.05)


def test_another_way_is_taken_where_the_first_is_blocked() -> None:
    blocked = replace(step("tongue", ("room",), Leg(UP)), others=((Leg((1.0, 0.0, 0.0)),),))
    proven = prove([blocked], hook())
    assert proven[0].way == (Leg((1.0, 0.0, 0.0)),)


def test_the_gap_is_that_of_the_slot() -> None:
    for side, gap in ((3.96, 0.0), (3.88, 0.05), (3.75, 0.1), (3.5, 0.2)):
        slot = manifold3d.Manifold.cube((10, 10, 10), True) - manifold3d.Manifold.cube(
            (4, 4, 20), True
        )
        drawer = block((side, side, 6.0), (-side / 2, -side / 2, -3.0))
        meshes = bodies_of(slot=made_of(slot), drawer=drawer)
        (proven,) = prove([step("drawer", ("slot",), Leg(UP))], meshes)
        assert proven.gap_mm == gap
        assert proven.closest == (("drawer", "slot") if gap < 0.2 else ())


# --- drivers ---


@pytest.mark.parametrize(
    ("gap", "height", "blocked"),
    [(2.2, 5.0, ""), (1.4, 5.0, "shaft"), (2.2, 60.0, "handle")],
)
def test_a_driver_needs_room_for_its_shaft_and_its_handle(
    gap: float, height: float, blocked: str
) -> None:
    """A screw beside a wall that is as high as told."""
    screw = made_of(manifold3d.Manifold.cylinder(4, 1.0, -1, 24).translate((0, 0, -4)))
    wall = block((3.0, 20.0, height), (gap, -10.0, 0.0))
    plate = made_of(
        manifold3d.Manifold.cube((20, 20, 2), True).translate((0, 0, -1))
        - manifold3d.Manifold.cylinder(9, 1.2, -1, 24, True)
    )
    driver = Driver(1.5, 3.0, 50.0, 16.0, 0.2)
    meshes = bodies_of(screw=screw, wall=wall, plate=plate)
    fixed = Step(
        "try", "try", (), ("plate", "wall"), (), (), "screw",
        (Fastener("screw", (Leg(DOWN),), driver),),
    )  # fmt: skip
    if not blocked:
        prove([fixed], meshes)
        return
    with pytest.raises(AssemblyBlockedError, match=f"{blocked} of the hexagon driver") as found:
        prove([fixed], meshes)
    assert found.value.block.fixed == "wall"


# --- fingers ---


@each_design
def test_every_design_goes_together(name: str) -> None:
    made = samples.parts(name)
    steps = samples.order(samples.dimensions(name), made)
    proven = prove(steps, samples.meshes_of(name))
    assert [p.step for p in proven] == list(steps)
    assert all(p.way == p.step.way for p in proven)


@each_design
def test_every_part_comes_to_its_place_once(name: str) -> None:
    made = samples.parts(name)
    steps = samples.order(samples.dimensions(name), made)
    placed = [n for s in steps for n in (*s.moves, *(f.part for f in s.fasteners))]
    last = steps[-1]
    everything = {*last.stays, *last.moves, *(f.part for f in last.fasteners)}
    assert everything == {p.name for p in made}
    firsts = everything - set(placed)
    assert firsts == {"body"}
    for s in steps:
        assert not set(s.moves) & set(s.stays)
    for n in placed:  # a part moves again only with its group
        movers = [s for s in steps if n in s.moves]
        assert all(set(a.moves) < set(b.moves) for a, b in pairwise(movers))


@pytest.mark.slow
@each_design
def test_no_step_overlaps_in_small_steps_of_another_library(name: str) -> None:
    """manifold3d moves the parts of every step and measures the common volume."""
    d, meshes = samples.dimensions(name), samples.meshes_of(name)
    for proven in prove(samples.order(d, samples.parts(name)), meshes):
        ignored = {n for n, _ in proven.step.ignored}
        moves = [n for n in proven.step.moves if n not in TAILED]
        stays = [n for n in proven.step.stays if n not in ignored and n not in TAILED]
        if not moves or not stays:
            continue
        fixed = whole([meshes.corners_mm(n) for n in stays])
        left = np.zeros(3)
        for leg in reversed(proven.way):
            moving = whole([meshes.shrunk_mm(n) - left for n in moves])
            for rest in np.arange(0.25, min(leg.length_mm, 40.0), 0.5):
                at = moving.translate((-rest * np.array(leg.direction)).tolist())
                assert (at ^ fixed).volume() < 0.01, (proven.step.key, rest)
            if np.isfinite(leg.length_mm):
                left += leg.length_mm * np.array(leg.direction)


TAILED = ("camera_cable", "led_wire_1", "led_wire_2", "led_wire_3", "led_wire_4")


def whole(corners: list[np.ndarray]) -> manifold3d.Manifold:
    found = []
    for triangles in corners:
        points, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        mesh = manifold3d.Mesh(points.astype(np.float32), faces.reshape(-1, 3).astype(np.uint32))
        body = manifold3d.Manifold(mesh)
        assert body.status() == manifold3d.Error.NoError
        found.append(body)
    return manifold3d.Manifold.batch_boolean(found, manifold3d.OpType.Add)


def with_moved(meshes: Bodies, name: str, mesh: TriangleMesh) -> Bodies:
    return Bodies(meshes.meshes | {name: mesh}, meshes.outwards | {name: outwards(mesh)})


def test_a_wrong_order_names_the_pair() -> None:
    """The window cannot follow the bezel."""
    steps = list(samples.order(samples.dimensions(QUICK), samples.parts(QUICK)))
    keys = [s.key for s in steps]
    window, bezel = steps[keys.index("window")], steps[keys.index("bezel")]
    late = replace(window, stays=(*bezel.stays, "tip_bezel"))
    with pytest.raises(AssemblyBlockedError) as found:
        prove([late], samples.meshes_of(QUICK))
    error = found.value
    assert (error.block.moving, error.block.fixed) == ("light_guide", "tip_bezel")
    assert error.tried == 6
    # The guide's upper face meets the bezel's lower one: both are at the gel's bottom.
    d = samples.dimensions(QUICK)
    low = d["stack.gel_bottom_z_mm"] - d["design.light_guide.thickness_mm"]
    lower_edge = d["guide.leg_end_z_mm"]
    plate = -d["design.housing.gel_proud_mm"]
    assert error.block.short_mm <= plate - lower_edge + SLACK_MM
    assert error.block.short_mm >= plate - low - SLACK_MM
    told = error.to_dict()
    assert told["moving"] == "light_guide"
    assert told["error"] == "assembly blocked"
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert again.to_dict() == told


def test_a_camera_that_is_too_wide_meets_its_clamp() -> None:
    meshes = samples.meshes_of(QUICK)
    camera = meshes.meshes["camera"]
    middle = camera.vertices_mm.mean(axis=0)
    d = samples.dimensions(QUICK)
    wider = 1 + 2 * (d["clamp.play_mm"] + 0.1) / d["camera.module_width_mm"]
    grown = TriangleMesh((camera.vertices_mm - middle) * (1, wider, 1) + middle, camera.faces)
    steps = samples.order(d, samples.parts(QUICK))
    with pytest.raises(AssemblyBlockedError) as found:
        prove(steps, with_moved(meshes, "camera", grown))
    assert found.value.step == "camera"
    assert (found.value.block.moving, found.value.block.fixed) == ("camera", "camera_clamp")


def test_a_cable_whose_slot_is_closed_below_is_refused() -> None:
    """As it was before: a closed hole in the mount."""
    d, meshes = samples.dimensions(QUICK), samples.meshes_of(QUICK)
    half = d["camera.cable_width_mm"] / 2
    x = d["finger.proximal_x_mm"]
    bar = block((3.0, 2 * half, 0.5), (x + 1.0, -half, -d["finger.thickness_mm"] - 0.5))
    meshes = with_moved(meshes, "closed", bar)
    steps = [s for s in samples.order(d, samples.parts(QUICK)) if s.key == "cover"]
    closed = replace(steps[0], stays=(*steps[0].stays, "closed"))
    with pytest.raises(AssemblyBlockedError) as found:
        prove([closed], meshes)
    assert found.value.block.fixed == "closed"


def test_a_connector_outside_of_the_finger_needs_no_hole() -> None:
    """Cable and wires go on beyond their drawing, without an end."""
    d, meshes = samples.dimensions(QUICK), samples.meshes_of(QUICK)
    for name in TAILED:
        points = meshes.meshes[name].vertices_mm
        assert points[:, 0].min() < d["finger.proximal_x_mm"] - 300
    cable = meshes.corners_mm("camera_cable")
    behind = cable[(cable[..., 0] < d["finger.proximal_x_mm"] - 300).any(axis=1)]
    assert np.ptp(behind[..., 1]) <= d["camera.cable_width_mm"] + 1e-6
    assert d["camera.connector_width_mm"] > d["camera.cable_width_mm"]


@pytest.mark.slow
@pytest.mark.parametrize("name", quick(["mini20", "thin", "gelslim2"], lambda name: name == QUICK))
def test_nuts_slide_into_their_slots(name: str) -> None:
    """Those of the roof rise into the slot beside its boss, also where it lies in the roof."""
    d = samples.changed(name, design__housing__thread="nut")
    made = samples.parts_of(d)
    assert any("_nut_" in p.name for p in made)
    assert interferences(made) == []
    prove(samples.order(d, made), samples.meshes(d, made))


@pytest.mark.slow
def test_nuts_rise_through_the_ceiling_over_thick_acrylic() -> None:
    """The slot lies 0.7 mm above the ceiling there; its end is open below."""
    d = derive(samples.random_spec(2))
    assert d["design.housing.thread"] == "nut"
    made = samples.parts_of(d)
    prove(samples.order(d, made), samples.meshes(d, made))


def test_a_part_without_a_step_is_noticed() -> None:
    bench = Bench(("body", "stray"))
    bench.begin("body")
    with pytest.raises(ValueError, match="stray"):
        bench.finished("body")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_random_fingers_go_together_or_name_the_pair(seed: int) -> None:
    """Also those that a design rule refuses, as far as their parts can be made.

    Where a step is blocked, manifold3d finds that the two parts overlap a little farther on.
    """
    d = derive(samples.random_spec(seed))
    if not d.feasible():
        pytest.skip("no fold")
    try:
        made = samples.parts_of(d)
    except SolidError as error:
        pytest.skip(f"refused by the kernel: {error}")
    meshes = samples.meshes(d, made)
    error = refused(samples.order(d, made), meshes)
    if error is None:
        return
    names, block = {p.name for p in made}, error.block
    assert block.fixed in names
    assert block.short_mm > 0
    if block.moving in names - set(TAILED) and len(block.way) == 1:
        rest = max(block.short_mm - 0.1, 0.0)
        moved = whole([meshes.corners_mm(block.moving) - rest * np.array(block.way[0].direction)])
        assert (moved ^ whole([meshes.corners_mm(block.fixed)])).volume() > 0


def refused(steps: tuple[Step, ...], meshes: Bodies) -> AssemblyBlockedError | None:
    try:
        prove(steps, meshes)
    except AssemblyBlockedError as error:
        return error
    return None
