"""Templates, jigs and gauges: volumes in closed form, fits, and random specs."""

from __future__ import annotations

import math

import cadquery as cq
import numpy as np
import pytest
from tooling_samples import clipped_grid, gelslim2, random_dimensions

from gelslim_cad.build.solid_checks import undercut_area_mm2
from gelslim_cad.export.mesh import mesh_for
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.markers.stencil import lay_out_stencil
from gelslim_cad.solids.finger import tooling_parts
from gelslim_cad.solids.gel import gel_pad
from gelslim_cad.solids.shapes import SolidError, outline_wire, prism, rectangle, rounded_polygon
from gelslim_cad.solids.tooling.calibration import (
    calibration_target,
    sphere_indenter,
    target_holes,
    target_pitch_mm,
)
from gelslim_cad.solids.tooling.fit_coupon import fit_coupon, plan_coupon
from gelslim_cad.solids.tooling.focus_jig import focus_jig, plan_jig
from gelslim_cad.solids.tooling.mould import cavity_in_mould
from gelslim_cad.solids.tooling.sheets import (
    cutting_template,
    fabric_skin,
    skin_flap_mm,
    skin_outline,
    stencil,
    stencil_problem,
)
from ifem_export.markers.grid import build_marker_grid


def shapely_area(points: np.ndarray) -> float:
    from shapely.geometry import Polygon

    polygon = Polygon(points)
    assert polygon.is_valid
    return float(polygon.area)


def free(solid: cq.Shape, x: float, y: float, z: float) -> bool:
    return not solid.isInside(cq.Vector(x, y, z), 1e-6)


def test_prism_volume_with_holes_and_windows() -> None:
    solid = prism(
        rectangle((0, 30), (0, 20), 4),
        (1, 3),
        [(6, 6, 2), (24, 6, 3)],
        [rectangle((10, 20), (5, 15))],
    )
    area = 600 - (4 - math.pi) * 16 - math.pi - math.pi * 2.25 - 100
    assert solid.isValid()
    assert solid.Volume() == pytest.approx(2 * area, rel=1e-12)


def test_rounded_polygon_rounds_hollow_corners_the_other_way() -> None:
    points = [(0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20)]
    outline = rounded_polygon(points, 2.0)
    # Five outer corners lose (1 - π/4) r², the hollow one gains it.
    area = 300 - 4 * (1 - math.pi / 4) * 4
    wire = outline_wire(outline, 0.0)
    assert wire.IsClosed()
    assert cq.Face.makeFromWires(wire).Area() == pytest.approx(area, rel=1e-9)


def test_stencil_volume_and_holes() -> None:
    d = gelslim2()
    grid = clipped_grid(d)
    sheet = lay_out_stencil(grid, GelShape.of(d).outline)
    part = stencil(sheet, grid)
    holes = float(np.sum(np.pi / 4 * grid.diameter_mm**2)) + 4 * math.pi / 4 * 9
    assert part.solid.Volume() == pytest.approx(
        0.1 * (52 * 52 - (4 - math.pi) * 4 - holes), rel=1e-9
    )
    assert len(part.solid.Faces()) == 2 + 8 + len(grid) + 4
    assert part.solid.isValid()


def test_stencil_refuses_what_cannot_be_cut() -> None:
    touching = build_marker_grid(6, 6, 1.0, 0.98, "none")
    assert "pitch" in stencil_problem(touching)
    many = build_marker_grid(50, 50, 1.0, 0.4, "none")
    assert "2500" in stencil_problem(many)
    sheet = lay_out_stencil(touching, GelShape(10, 10, 0, 2).outline)
    with pytest.raises(SolidError, match="marker_stencil"):
        stencil(sheet, touching)


def test_template_opening_is_the_gel_and_pins_are_the_stencils() -> None:
    d = gelslim2()
    grid = clipped_grid(d)
    shape = GelShape.of(d)
    sheet = lay_out_stencil(grid, shape.outline)
    solid = cutting_template(d, sheet).solid
    assert solid.isValid()
    thickness = solid.BoundingBox().zlen
    film = stencil(sheet, grid).solid
    for x, y in sheet.alignment_mm:
        assert free(solid, x, y, thickness / 2)
        assert free(film, x, y, 0.05)
        assert not free(solid, x + 1.6, y, thickness / 2)
    for sign in (-1, 1):
        inside, outside = shape.length_mm / 2 - 1e-3, shape.length_mm / 2 + 1e-3
        assert free(solid, sign * inside, 3.0, thickness / 2)
        assert not free(solid, sign * outside, 3.0, thickness / 2)
    gel = gel_pad(d).solid.translate(cq.Vector(0, 0, thickness))
    grown = gel.intersect(solid).Volume()
    assert grown == pytest.approx(0, abs=1e-9)


def test_target_hooks_on_the_finger_and_touches_the_gel() -> None:
    d = gelslim2()
    solid = calibration_target(d).solid
    fit, half = d["design.housing.fit_clearance_mm"], d["finger.width_mm"] / 2
    tip, proud = d["finger.tip_x_mm"], d["design.housing.gel_proud_mm"]
    finger = cq.Solid.makeBox(tip + 60, 2 * half, 10, cq.Vector(-60, -half, -proud - 10))
    assert solid.intersect(finger).Volume() == pytest.approx(0, abs=1e-9)
    assert solid.intersect(gel_pad(d).solid).Volume() == pytest.approx(0, abs=1e-9)
    pushed = finger.translate(cq.Vector(0, 0, 1e-2))
    assert solid.intersect(pushed).Volume() > 0, "rests on the bezel"
    for shift in ((0, 1.5 * fit, 0), (0, -1.5 * fit, 0), (1.5 * fit, 0, 0)):
        assert solid.intersect(finger.translate(cq.Vector(*shift))).Volume() > 0
    for x, y, diameter in target_holes(GelShape.of(d)):
        assert free(solid, x, y, 1.5)
        assert not free(solid, x + diameter / 2 + 0.05, y, 1.5)


@pytest.mark.parametrize(
    "size", [(5, 5, 2.5), (20, 20, 0), (28, 28, 2), (50, 25, 12.5), (120, 120, 60)]
)
def test_target_lattice(size: tuple[float, float, float]) -> None:
    shape = GelShape(*size, 2.0)
    holes = np.array(target_holes(shape))
    pitch = target_pitch_mm(size[0], size[1])
    assert 9 <= len(holes) <= 15 * 15
    steps = holes[:, :2] / pitch
    assert np.allclose(steps, np.round(steps))
    marked = holes[holes[:, 2] > holes[:, 2].min() + 1e-9]
    assert sorted(map(tuple, marked[:, :2])) == [(0.0, 0.0), (pitch, 0.0)]
    ring = np.linspace(0, 2 * np.pi, 90)
    for x, y, diameter in holes:
        rim = np.column_stack([x + diameter / 2 * np.cos(ring), y + diameter / 2 * np.sin(ring)])
        assert shape.outline.contains(rim).all()


def test_indenter_cap_is_a_sphere() -> None:
    part = sphere_indenter(gelslim2())
    box = part.solid.BoundingBox()
    assert box.zmax == pytest.approx(13, abs=1e-6)
    mesh, _ = mesh_for(part.solid)
    x, y, z = mesh.vertices_mm.T
    cap = z > 11.0 + 1e-6
    assert cap.sum() > 20
    assert np.sqrt(x**2 + y**2 + (z - 8) ** 2)[cap] == pytest.approx(5.0, abs=1e-4)
    # Flange less holes, stem to the cap's foot at 8 + 3, cap of height 2: π h² (3R - h) / 3.
    flange = (24 * 14 - (4 - math.pi) * 9 - 2 * math.pi / 4 * 3.4**2) * 5
    cap_volume = math.pi * 4 * (15 - 2) / 3
    assert part.solid.Volume() == pytest.approx(flange + math.pi * 16 * 6 + cap_volume, rel=1e-6)


@pytest.mark.parametrize("lens", [5.0, 8.5])
def test_jig_holds_module_and_card_at_the_focus(lens: float) -> None:
    d = gelslim2(camera__lens_diameter_mm=lens, camera__lens_height_mm=2.5)
    plan, solid = plan_jig(d), focus_jig(d).solid
    assert plan.lips == (lens == 5.0)
    # The entrance pupil is in the front of the lens, which is unscrewed from its 2.5 mm.
    axis, face, depth = plan.axis_z, 2.5 + d["view.lens_extension_mm"], 4.0
    module = cq.Solid.makeBox(depth, 8.5, 8.5, cq.Vector(-face - depth, -4.25, axis - 4.25))
    barrel = cq.Solid.makeCylinder(lens / 2, face, cq.Vector(-face, 0, axis), cq.Vector(1, 0, 0))
    width, height = plan.card_mm
    card = cq.Solid.makeBox(1.0, width, height, cq.Vector(d["view.focus_mm"], -width / 2, 4.0))
    for thing in (module, barrel, card):
        assert solid.intersect(thing).Volume() == pytest.approx(0, abs=1e-9)
    assert solid.intersect(module.translate(cq.Vector(-0.05, 0, 0))).Volume() > 0, "rests behind"
    assert solid.intersect(module.translate(cq.Vector(0, 0, -0.05))).Volume() > 0, "rests below"
    forward = solid.intersect(module.translate(cq.Vector(1.0, 0, 0))).Volume()
    assert (forward > 0) == plan.lips
    assert solid.intersect(card.translate(cq.Vector(-0.05, 0, 0))).Volume() > 0, "rests in front"
    # The lens sees the card through the window.
    for y in (-0.9, 0.9):
        for z in (-0.9, 0.9):
            half = plan.axis_z - plan.window_bottom_z
            ray = cq.Edge.makeLine(
                cq.Vector(0, 0, axis),
                cq.Vector(plan.focus - 1e-3, y * plan.window_half, axis + z * half),
            )
            assert all(free(solid, *ray.positionAt(t).toTuple()) for t in np.linspace(0, 1, 41))


def test_coupon_steps_are_cut() -> None:
    d = gelslim2()
    plan = plan_coupon(d)
    coupon, gauge = fit_coupon(d)
    assert plan.clearances[2] == pytest.approx(0.2)
    assert plan.pilots[2] == pytest.approx(1.6)
    assert plan.sheets == pytest.approx((2.25, 2.375, 2.5, 2.625, 2.75))
    tongue, pilot, sheet, wall, dots = plan.rows_mm
    for k in range(5):
        x = (k - 2) * plan.cell_mm
        c = plan.clearances[k]
        assert free(coupon.solid, x + 4 + c - 0.01, tongue, 1.5)
        assert not free(coupon.solid, x + 4 + c + 0.01, tongue, 1.5)
        assert free(coupon.solid, x, pilot + plan.pilots[k] / 2 - 0.01, 1.5)
        assert not free(coupon.solid, x, pilot + plan.pilots[k] / 2 + 0.01, 1.5)
        assert free(coupon.solid, x, sheet + plan.sheets[k] / 2 - 0.01, 1.5)
        assert not free(coupon.solid, x, sheet + plan.sheets[k] / 2 + 0.01, 1.5)
        assert not free(coupon.solid, x, wall, 6.0)
        line = np.linspace(x - 6, x + 6, 81)
        hits = np.array([free(coupon.solid, u, dots, 1.5) for u in line])
        assert np.count_nonzero(np.diff(hits.astype(int)) == 1) == k + 1
    assert coupon.solid.isValid()
    assert gauge.solid.isValid()
    assert gauge.solid.BoundingBox().zlen == pytest.approx(3.0, abs=1e-6)


def test_skin_unfolds_to_the_finger() -> None:
    d = gelslim2()
    outline, flap = skin_outline(d), skin_flap_mm(d)
    x0, y0, x1, y1 = outline.bounds_mm
    assert y1 - y0 == pytest.approx(d["finger.width_mm"] + 2 * flap, abs=1e-3)
    assert x1 == pytest.approx(d["finger.tip_x_mm"] + flap, abs=1e-3)
    assert x0 == pytest.approx(d["bezel.proximal_x_mm"], abs=1e-3)
    part = fabric_skin(d)
    area = shapely_area(outline.flattened(1e-4))
    assert part.solid.Volume() == pytest.approx(0.3 * area, rel=1e-4)
    half = np.array([d["design.gel.length_mm"], d["design.gel.width_mm"]]) / 2
    assert outline.contains(np.array([half, -half])).all()


def test_all_tooling_of_the_papers_sensor() -> None:
    d = gelslim2()
    parts = tooling_parts(d, clipped_grid(d))
    names = [p.name for p in parts]
    assert len(set(names)) == len(names) == 14
    assert "light_guide_blank" in names
    assert not any(p.in_assembly for p in parts)
    for part in parts:
        assert len(part.solid.Solids()) == 1
        assert part.note
    without = gelslim2(manufacturing__fabric_skin=False)
    assert "fabric_skin" not in [p.name for p in tooling_parts(without, clipped_grid(without))]


def test_target_prints_with_its_plate_on_the_bed() -> None:
    part = calibration_target(gelslim2())
    turned = part.solid.rotate(cq.Vector(0, 0, 0), cq.Vector(1, 0, 0), part.print_rotation_deg[0])
    low = turned.BoundingBox().zmin
    bed = [f for f in turned.Faces() if f.geomType() == "PLANE" and abs(f.Center().z - low) < 1e-6]
    box = turned.BoundingBox()
    assert sum(f.Area() for f in bed) > 0.8 * box.xlen * box.ylen


def check_tooling(seed: int) -> None:
    d = random_dimensions(seed)
    grid = clipped_grid(d)
    cavity = cavity_in_mould(d)
    assert undercut_area_mm2(cavity) < 1e-3
    for part in (*tooling_parts(d, grid), gel_pad(d)):
        if part.name != "marker_stencil":
            assert part.solid.isValid(), part.name
            mesh_for(part.solid)
        if "mould" in part.tags:
            assert part.solid.intersect(cavity).Volume() < 1e-6, part.name


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 5))]
)
def test_random_specs_build_and_mesh(seed: int) -> None:
    check_tooling(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5, 60))
def test_many_random_specs_build_and_mesh(seed: int) -> None:
    check_tooling(seed)
