"""Measures for printing against closed forms: plates, tables, cones, bores, chamfers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cadquery", reason="solids need the [cad] extra")

import cadquery as cq

from gelslim_cad.export.mesh import TriangleMesh, mesh_for, print_mesh
from gelslim_cad.printability.first_layer import first_layer
from gelslim_cad.printability.holes import round_holes
from gelslim_cad.printability.measures import measure
from gelslim_cad.printability.overhangs import Overhang, overhangs
from gelslim_cad.printability.surface import Surface
from gelslim_cad.printability.walls import least_wall


def meshed(shape: Any, turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> TriangleMesh:
    solid = shape.val() if isinstance(shape, cq.Workplane) else shape
    return print_mesh(mesh_for(solid, 2e-4)[0], turn_deg)


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> Any:
    """A box that stands on a height, its middle at x and y."""
    return cq.Workplane().box(x, y, z, centered=(True, True, False)).translate(at)


def hanging(shape: Any, limit_deg: float = 45.0) -> tuple[Overhang, ...]:
    return overhangs(Surface(meshed(shape)), limit_deg)


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [0.3, 0.66, 1.2, 3.0])
def test_a_plate_is_as_thick_as_it_is(thickness: float) -> None:
    for turn in ((0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (30.0, 20.0, 10.0)):
        wall = least_wall(Surface(meshed(box(20, 12, thickness), turn)))
        assert wall is not None
        assert wall.thickness_mm == pytest.approx(thickness, abs=1e-4)


def test_thick_bodies_wedges_and_gaps_are_no_walls() -> None:
    assert least_wall(Surface(meshed(box(10, 10, 10)))) is None
    wedge = cq.Workplane("XZ").polyline([(0, 0), (20, 0), (0, 12)]).close().extrude(20)
    assert least_wall(Surface(meshed(wedge))) is None
    slotted = box(20, 20, 20).cut(box(0.4, 30, 10, (0, 0, 10)))
    assert least_wall(Surface(meshed(slotted))) is None


def test_the_thinnest_of_several_walls_counts_and_its_place_is_told() -> None:
    walls = box(40, 20, 5)
    for x, thickness in ((-15.0, 1.6), (0.0, 0.7), (15.0, 1.1)):
        walls = walls.union(box(thickness, 18, 6, (x, 0, 5)))
    wall = least_wall(Surface(meshed(walls)))
    assert wall is not None
    assert wall.thickness_mm == pytest.approx(0.7, abs=1e-4)
    assert abs(wall.at_mm[0]) == pytest.approx(0.35, abs=1e-3)
    assert wall.at_mm[2] > 5
    # A tube: 1 mm between two curved faces, as tessellated.
    tube = least_wall(Surface(meshed(cq.Workplane().circle(10).circle(9).extrude(15))))
    assert tube is not None
    assert tube.thickness_mm == pytest.approx(1.0, abs=0.03)


def test_kernel_finds_what_a_slow_search_finds() -> None:
    """Every ray against every triangle by solving for the barycentric coordinates."""
    from gelslim_cad.printability.thickness_kernel import first_hits

    solid = box(20, 12, 5).cut(box(6, 6, 3, (2, 0, 2))).union(
        cq.Workplane().center(-6, 0).circle(2.5).extrude(9)
    )  # fmt: skip
    surface = Surface(meshed(solid, (20.0, 10.0, 0.0)))
    points, facets = surface.samples(120, 1)
    inwards = -surface.normals[facets]
    corners = surface.corners_mm
    starts = points + 1e-4 * inwards
    distances, hits = first_hits(starts, inwards, corners, 50.0)
    # With short rays space is divided into many cubes; what is within reach stays the same.
    for longest in (3.5, 6.0, 11.0):
        near, found = first_hits(starts, inwards, corners, longest)
        within = distances < longest
        assert within.any()
        np.testing.assert_array_equal(near, np.where(within, distances, np.inf))
        np.testing.assert_array_equal(found, np.where(within, hits, -1))
    for k, (start, way) in enumerate(zip(starts, inwards, strict=True)):
        slow = []
        for a, b, c in corners:
            matrix = np.column_stack([b - a, c - a, -way])
            if abs(np.linalg.det(matrix)) > 1e-9:
                u, v, t = np.linalg.solve(matrix, start - a)
                if u >= 0 and v >= 0 and u + v <= 1 and t > 0:
                    slow.append(t)
        assert distances[k] == pytest.approx(min(slow), abs=1e-6)
        assert hits[k] >= 0


def table(length: float, width: float, leg: float = 4.0) -> Any:
    """A plate on a leg at each end; free along both sides."""
    top = box(length, width, 2, (0, 0, 10))
    for side in (-1, 1):
        top = top.union(box(leg, width, 10, (side * (length - leg) / 2, 0, 0)))
    return top


def test_a_bridge_spans_from_leg_to_leg() -> None:
    (found,) = hanging(table(30, 8))
    assert found.span_mm == pytest.approx(22, abs=0.15)
    assert found.area_mm2 == pytest.approx(22 * 8, rel=1e-6)
    assert found.steepest_deg == pytest.approx(90, abs=0.01)
    assert not found.over_part
    assert found.at_mm == pytest.approx((0, found.at_mm[1], 10), abs=0.4)


def test_a_roof_on_four_walls_spans_its_narrow_side() -> None:
    room = box(24, 16, 12).cut(box(20, 12, 8, (0, 0, 2)))
    (found,) = hanging(room)
    assert found.span_mm == pytest.approx(12, abs=0.2)
    assert found.over_part
    opened = box(24, 16, 12).cut(box(20, 12, 10))
    assert not hanging(opened)[0].over_part


def test_a_cantilever_counts_twice_and_a_boss_in_the_air_is_told() -> None:
    arm = box(5, 8, 20).union(box(7, 8, 3, (6, 0, 17)))
    (found,) = hanging(arm)
    assert found.span_mm == pytest.approx(14, abs=0.1)
    boss = table(30, 8).union(box(3, 3, 3, (0, 0, 7)))
    spans = [o.span_mm for o in hanging(boss)]
    assert math.isinf(spans[0])
    measured = measure(meshed(boss), boss.val(), 45.0, 10.0)
    assert measured.floating == 1
    assert math.isfinite(measured.bridge_mm)


@pytest.mark.parametrize(
    ("slope_deg", "hangs"),
    [
        (30, False),
        pytest.param(44, False, marks=pytest.mark.slow),
        (50, True),
        pytest.param(70, True, marks=pytest.mark.slow),
    ],
)
def test_cones_hang_beyond_the_limit(slope_deg: float, hangs: bool) -> None:
    """A frustum on its narrow end; its lateral area is π (r₁ + r₂) s."""
    low, high = 4.0, 10.0
    height = (high - low) / math.tan(math.radians(slope_deg))
    cone = cq.Workplane().add(cq.Solid.makeCone(low, high, height))
    found = hanging(cone)
    assert bool(found) == hangs
    if hangs:
        slant = math.hypot(high - low, height)
        assert found[0].area_mm2 == pytest.approx(math.pi * (low + high) * slant, rel=0.01)
        assert found[0].steepest_deg == pytest.approx(slope_deg, abs=0.5)
        assert found[0].span_mm == pytest.approx(2 * (high - low), rel=0.03)
    assert hanging(cone, 75.0) == ()


@pytest.mark.parametrize("radius", [1.0, 4.0])
def test_a_level_bore_spans_less_than_its_diameter(radius: float) -> None:
    """Where it is steeper than 46°: 2 R sin 44°, less the angle of a facet."""
    block = box(20, 20, 20).cut(
        cq.Workplane("XZ").center(0, 10).circle(radius).extrude(30, both=True)
    )
    (found,) = hanging(block)
    exact = 2 * radius * math.sin(math.radians(44))
    assert 0.8 * exact < found.span_mm < 1.05 * exact


def test_what_is_turned_on_the_plate_measures_the_same() -> None:
    for degrees in (0.0, 33.0, 90.0):
        mesh = meshed(table(30, 8), (0.0, 0.0, degrees))
        assert overhangs(Surface(mesh), 45.0)[0].span_mm == pytest.approx(22, abs=0.15)
    assert hanging(box(10, 10, 3)) == ()


@pytest.mark.slow
def test_the_first_layer_has_area_sharp_edges_and_openings() -> None:
    plate = box(30, 20, 4).faces(">Z").workplane().pushPoints([(-8, 0), (0, 0)]).hole(4.0)
    layer = first_layer(Surface(meshed(plate)))
    assert layer.openings == 2
    assert layer.area_mm2 == pytest.approx(600 - 2 * math.pi * 4, rel=2e-3)
    assert layer.sharp_mm == pytest.approx(100 + 2 * math.pi * 4, rel=2e-3)
    eased = plate.faces("<Z").edges("%CIRCLE").chamfer(0.4)
    assert first_layer(Surface(meshed(eased))).openings == 0
    assert first_layer(Surface(meshed(eased))).sharp_mm == pytest.approx(100, rel=1e-6)
    ball = cq.Workplane().sphere(5).cut(box(20, 20, 1, (0, 0, -6)))
    assert first_layer(Surface(meshed(ball))).openings == 0


def test_holes_are_round_and_hollow() -> None:
    plate = box(30, 20, 6).faces(">Z").workplane().pushPoints([(-8, 0)]).hole(2.2)
    plate = plate.faces(">Z").workplane().pushPoints([(8, 0)]).cboreHole(3.2, 6.0, 2.0)
    plate = plate.union(cq.Workplane().circle(2).extrude(10))
    plate = plate.faces("<Z").workplane().slot2D(8, 3).cutThruAll()
    holes = round_holes(plate.val())
    assert [h.diameter_mm for h in holes] == pytest.approx([2.2, 3.2, 6.0])
    lengths = [float(np.linalg.norm(h.ends_mm[1] - h.ends_mm[0])) for h in holes]
    assert lengths == pytest.approx([6.0, 4.0, 2.0])
    halves = box(20, 20, 6).cut(cq.Workplane().circle(3).extrude(6))
    halved = halves.val().split(cq.Face.makePlane(50, 50, dir=(1, 0, 0)))
    assert all(round_holes(solid) == () for solid in halved.Solids())


def test_measures_do_not_change_from_run_to_run() -> None:
    shape = table(30, 8).union(box(0.6, 8, 5, (0, 0, 12)))
    first = measure(meshed(shape), shape.val(), 45.0, 10.0)
    assert first == measure(meshed(shape), shape.val(), 45.0, 10.0)
    assert first.wall_mm == pytest.approx(0.6, abs=1e-3)
    assert (first.overhang_mm2, first.on_part_mm2) == (pytest.approx(176, abs=0.1), 0)
    assert first.size_mm == pytest.approx((30, 8, 17))
    wide = measure(meshed(shape), shape.val(), 45.0, 25.0)
    assert wide == replace(first, overhang_mm2=0.0)
