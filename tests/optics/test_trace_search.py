"""The arrays of a scene, and the search for the next face where rounding moved a ray."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_cases import COATS, finger, loop, media, transformed

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import EdgeLaunch
from gelslim_optics.light.trace_crossing import (
    AIR,
    FAR,
    NOTHING,
    corner_exit,
    crossings,
    edge_normal,
    gel_plane,
    next_edge,
    side_medium,
)
from gelslim_optics.light.trace_geometry import (
    ALWAYS,
    BONDED,
    CIRCLE,
    EXIT,
    GEL_ONLY,
    NONE,
    OWNER,
    PRESENCE,
    TraceGeometry,
    columns,
    face_names,
    pack,
)


def scene_of(profile: GuideProfile, **changes: object) -> LightScene:
    whole = LightScene(
        profile, (-6.0, 9.0), (-4.5, 8.0), (EdgeLaunch("foot_right"),), media(), COATS
    )
    return replace(whole, **changes)  # type: ignore[arg-type]


def test_a_scene_is_packed_about_the_middle_of_its_profile() -> None:
    plain = finger(3.0, crown_mm=0.8)
    moved = transformed(plain.profile, 3.0, -1.0)
    scene = scene_of(moved, ends="mirror")
    packed, number, middle = pack(scene)
    assert number["air"] == AIR == 0
    assert set(number) == {"air", "acrylic", "leg", "gel", "paint", "mirror"}
    # 20 wide with bends of 8 outside; from the feet at -13 to the ends of the crowned face at 2.
    assert middle == pytest.approx((3.0, (-13.0 + 2.0) / 2 - 1.0))
    assert packed.box == pytest.approx([-6.0, 9.0, -4.5, 8.0, 36e-9])
    assert packed.marks.tolist() == [
        number["mirror"], number["gel"], face_names(scene).index("gel_face")
    ]  # fmt: skip
    assert pack(replace(scene, face="nothing"))[0].marks[2] == NONE
    # No arc is above 180 degrees, so that every edge is one row.
    assert len(packed.shape) == len(packed.facts) == len(moved.edges)
    for row, fact, edge in zip(packed.shape, packed.facts, moved.edges, strict=True):
        start, end = np.array(edge.curve.start), np.array(edge.curve.end)
        np.testing.assert_allclose(row[:4], [*(start - middle), *(end - middle)], atol=1e-9)
        assert fact[:2].tolist() == [number[edge.left], number[edge.right]]
        assert face_names(scene)[fact[OWNER]] == edge.name
        assert fact[EXIT] == (edge.name in ("foot_left", "foot_right"))
        presence = {"gel_window": BONDED, "gel_face": GEL_ONLY, "gel_side_left": GEL_ONLY}
        if edge.name != "gel_side_right":
            assert fact[PRESENCE] == presence.get(edge.name, ALWAYS)
        if isinstance(edge.curve, Segment):
            right = np.array([end[1] - start[1], start[0] - end[0]]) / edge.curve.length_mm
            np.testing.assert_allclose(row[4:], [*right, 0, 0], atol=1e-12)
            assert fact[CIRCLE] == NONE
        else:
            centre = np.array(edge.curve.centre) - middle
            sense = math.copysign(1, edge.curve.sweep_rad)
            np.testing.assert_allclose(row[4:], [*centre, edge.curve.radius_mm, sense])
    for name, medium in number.items():
        count = packed.near[medium, 0]
        bounds = [
            k for k, e in enumerate(moved.edges) if name == "air" or name in (e.left, e.right)
        ]
        assert packed.near[medium, 1 : 1 + count].tolist() == bounds
    assert packed.coats[number["paint"]].tolist() == [1.0, 0.0, 0.0]
    assert packed.coats[number["mirror"]].tolist() == [1.0, 0.9, 0.0]
    assert not packed.coats[[number["air"], number["acrylic"], number["gel"]]].any()
    assert columns(4) == columns(0) + 12


def test_corners_that_meet_are_the_same_to_the_last_bit() -> None:
    packed, _, _ = pack(scene_of(transformed(finger(3.0).profile, 0.1, 0.3)))
    corners = packed.shape[:, :4].reshape(-1, 2)
    apart = np.abs(corners[:, None] - corners[None]).max(axis=2)
    assert not ((apart > 0) & (apart < 1e-6)).any()
    # The two bends of a side share no circle, the split halves of one arc do.
    circles = packed.facts[packed.facts[:, CIRCLE] != NONE, CIRCLE]
    assert sorted(circles) == [0, 1, 2, 3]


@pytest.mark.parametrize("sweep_deg", [179.0, 180.0, 181.0, 300.0, -300.0])
def test_arcs_above_half_a_turn_are_halved(sweep_deg: float) -> None:
    rim = Arc((1.0, 2.0), 3.0, 0.4, math.radians(sweep_deg))
    media_of = ("acrylic", "air") if sweep_deg > 0 else ("air", "acrylic")
    foot = Edge("foot_right", Segment(rim.end, rim.start), *media_of)
    packed, _, middle = pack(scene_of(GuideProfile((Edge("rim", rim, *media_of), foot))))
    halves = 2 if abs(sweep_deg) > 180 else 1
    assert len(packed.shape) == halves + 1
    assert packed.facts[:halves, CIRCLE].tolist() == [0] * halves
    assert packed.facts[:halves, OWNER].tolist() == [0] * halves
    for k in range(halves):
        ends = [np.subtract(rim.at(part), middle) for part in (k / halves, (k + 1) / halves)]
        np.testing.assert_allclose(packed.shape[k, :4], np.ravel(ends), atol=1e-12)


def square() -> tuple[TraceGeometry, dict[str, int]]:
    """A bar of acrylic, 2 wide and 4 high about the origin: floor, right, top, left."""
    profile = loop(
        [(-1, -2), (1, -2), (1, 2), (-1, 2)],
        ("foot_right", "air"), ("right", "air"), ("top", "air"), ("left", "air"),
    )  # fmt: skip
    packed, number, _ = pack(scene_of(profile))
    return packed, number


def asked(
    packed: TraceGeometry, number: dict[str, int], medium: str, last: int, place: tuple, way: tuple
) -> tuple:
    g = packed
    return next_edge(
        g.shape, g.facts, g.near, g.coats, g.box, number["gel"], number[medium], last,
        0.0, *place, 0.0, *way,
    )  # fmt: skip


def test_inside_the_nearest_face_ahead_is_met() -> None:
    packed, number = square()
    assert asked(packed, number, "acrylic", 0, (0.5, -2.0), (0.6, 0.8)) == (
        1, pytest.approx(0.5 / 0.6), True, 0
    )  # fmt: skip
    assert asked(packed, number, "acrylic", NOTHING, (0.0, 1.0), (0.0, 1.0)) == (2, 1.0, True, 0)
    # From the air a face is met from its other side, and nothing is there behind it.
    edge, t, way, trouble = asked(packed, number, "air", NOTHING, (3.0, 0.0), (-1.0, 0.0))
    assert (edge, t, way, trouble) == (1, 2.0, False, 0)
    assert asked(packed, number, "air", NOTHING, (3.0, 0.0), (1.0, 0.0)) == (NOTHING, FAR, False, 0)


@pytest.mark.parametrize("off", [1e-12, 3e-9])
def test_a_ray_that_rounding_moved_out_leaves_by_the_face_just_behind(off: float) -> None:
    """The profile is 4 high, so that a corner has a size of 4e-9."""
    packed, number = square()
    found = asked(packed, number, "acrylic", 2, (1.0 + off, 0.3), (0.8, -0.6))
    assert found == (1, 0.0, True, 1)


def test_a_ray_far_outside_of_its_medium_is_lost() -> None:
    packed, number = square()
    found = asked(packed, number, "acrylic", 2, (1.0 + 5e-9, 0.3), (0.8, -0.6))
    assert found == (NOTHING, FAR, False, 2)


def test_a_ray_at_a_corner_leaves_by_the_face_that_it_crosses_most_steeply() -> None:
    packed, number = square()
    g, acrylic = packed, number["acrylic"]
    for way, expected in (
        ((0.8, 0.6), 1),
        ((0.6, 0.8), 2),
        ((-0.6, 0.8), 2),
        ((0.8, -0.6), 1),
        ((-0.6, -0.8), NOTHING),
    ):
        for place in ((1.0, 2.0), (1.0 + 2e-9, 2.0 - 3e-9)):
            found = corner_exit(g.shape, g.facts, g.near, 4e-9, acrylic, NOTHING, *place, *way)
            assert found == (expected, expected != NOTHING)
    # The face that the ray comes from is not its way out, and far from a corner there is none.
    args = (g.shape, g.facts, g.near, 4e-9, acrylic)
    assert corner_exit(*args, 1, 1.0, 2.0, 0.8, 0.6) == (2, True)
    assert corner_exit(*args, NOTHING, 1.0, 1.0, 0.8, 0.6) == (NOTHING, False)
    assert corner_exit(*args, NOTHING, 1.0 + 5e-9, 2.0, 0.8, 0.6) == (NOTHING, False)
    # From the air the acrylic is entered by either face of the corner.
    air = (g.shape, g.facts, g.near, 4e-9, AIR)
    assert corner_exit(*air, NOTHING, 1.0, 2.0, -0.8, -0.6) == (1, False)


def test_lines_cross_an_arc_where_the_circle_does() -> None:
    """All of 2000 random lines, from inside and outside, against the quadratic equation."""
    rng = np.random.default_rng(7)
    for sweep_deg in (100.0, -100.0, 170.0):
        arc = Arc((0.3, -0.2), 2.0, 0.5, math.radians(sweep_deg))
        sides = ("acrylic", "air") if sweep_deg > 0 else ("air", "acrylic")
        chord = Edge("foot_right", Segment(arc.end, arc.start), *sides)
        packed, _, middle = pack(scene_of(GuideProfile((Edge("rim", arc, *sides), chord))))
        counts = set()
        for _ in range(700):
            place, angle = rng.uniform(-3, 3, 2), rng.uniform(0, 2 * np.pi)
            way = np.array([math.cos(angle), math.sin(angle)]) * rng.uniform(0.3, 1.0)
            offset = place + middle - np.array(arc.centre)
            roots = np.roots([way @ way, 2 * offset @ way, offset @ offset - 4.0])
            expected = []
            for t in sorted(roots.real) if np.isreal(roots).all() else ():
                y, z = offset + t * way
                turned = math.copysign(1, sweep_deg) * (math.atan2(z, y) - 0.5)
                if turned % (2 * math.pi) <= math.radians(abs(sweep_deg)):
                    leaves = bool(way @ (y, z) > 0)
                    expected.append((t, leaves == (sweep_deg > 0)))
            found = crossings(packed.shape, packed.facts, 0, NOTHING, *place, *way)
            assert found[0] == len(expected)
            counts.add(found[0])
            for k, (t, left_to_right) in enumerate(expected):
                assert found[1 + 2 * k] == pytest.approx(t, abs=1e-9)
                assert found[2 + 2 * k] == left_to_right
        assert counts == {0, 1, 2}


def test_from_a_point_of_the_circle_only_the_other_crossing_is_new() -> None:
    arc = Arc((0.0, 0.0), 2.0, math.radians(-80), math.radians(160))
    chord = Edge("foot_right", Segment(arc.end, arc.start), "acrylic", "air")
    packed, _, middle = pack(scene_of(GuideProfile((Edge("rim", arc, "acrylic", "air"), chord))))
    for start_deg, end_deg in ((-70, 60), (10, -75), (40, 41)):
        start, end = (
            2 * np.array([math.cos(math.radians(a)), math.sin(math.radians(a))]) - middle
            for a in (start_deg, end_deg)
        )
        way = (end - start) / 4
        found = crossings(packed.shape, packed.facts, 0, 0, *start, *way)
        assert found[0] == 1
        assert found[1] == pytest.approx(4.0)
        assert found[2]
    # Outwards there is no other one, and one beyond the end of the arc does not count.
    out = 2 * np.array([math.cos(0.2), math.sin(0.2)]) - middle
    assert crossings(packed.shape, packed.facts, 0, 0, *out, 0.6, 0.8)[0] == 0
    assert crossings(packed.shape, packed.facts, 0, 0, *out, -1.0, 0.0)[0] == 0
    # A segment is not met again by a ray that starts on it.
    assert crossings(packed.shape, packed.facts, 1, 1, 0.0, 0.0, 1.0, 0.0)[0] == 0


def test_normals_point_to_the_right_and_beside_the_gel_is_air() -> None:
    scene = replace(finger(3.0, crown_mm=0.8), x_mm=(-6.0, 9.0), gel_x_mm=(-4.5, 8.0))
    packed, number, middle = pack(scene)
    gel, acrylic, paint = number["gel"], number["acrylic"], number["paint"]
    for k, edge in enumerate(scene.profile.edges):
        place = np.subtract(edge.curve.at(0.4), middle)
        step = np.subtract(edge.curve.at(0.4001), edge.curve.at(0.3999))
        step /= np.linalg.norm(step)
        normal = edge_normal(packed.shape, k, *place)
        np.testing.assert_allclose(normal, [step[1], -step[0]], atol=1e-8)
        for x in (-5.0, 0.0, 8.5):
            sides = [side_medium(packed.facts, packed.box, gel, k, r, x) for r in (False, True)]
            expected = [number[edge.left], number[edge.right]]
            if edge.name == "gel_window" and x != 0.0:
                expected[expected.index(gel)] = AIR
            assert sides == expected
    assert {gel, acrylic, paint} <= set(packed.facts[:, :2].ravel())


def test_rays_enter_the_end_of_the_gel_from_the_air_beyond_it_only() -> None:
    scene = replace(finger(3.0), x_mm=(-10.0, 10.0), gel_x_mm=(-4.5, 8.0))
    packed, number, middle = pack(scene)
    g = packed

    def plane(x: float, z: float, dx: float, dz: float = 0.0, y: float = 0.0) -> float:
        return gel_plane(
            g.shape, g.facts, g.near, g.box, number["gel"], NOTHING,
            x, y - middle[0], z - middle[1], dx, math.sqrt(1 - dx**2 - dz**2), dz,
        )  # fmt: skip

    # The pad is 20 wide and 2 high on the window at z = 0.
    assert plane(-6.0, 1.0, 0.6) == pytest.approx(2.5)
    assert plane(9.0, 1.0, -0.5) == pytest.approx(2.0)
    assert plane(-6.0, 2.5, 0.6) == FAR
    assert plane(-6.0, 2.5, 0.6, -0.3) == pytest.approx(2.5)
    assert plane(-6.0, 1.5, 0.6, 0.3) == FAR
    assert plane(-6.0, 1.0, -0.6) == FAR
    assert plane(9.0, 1.0, 0.6) == FAR
    assert plane(0.0, 1.0, 0.6) == FAR
    assert plane(-6.0, 1.0, 0.6, y=9.0) == FAR
    assert plane(-6.0, 1.0, 0.6, y=-11.0) == pytest.approx(2.5)
