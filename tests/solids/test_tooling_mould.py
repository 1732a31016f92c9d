"""The mould leaves exactly the gel, enlarged for shrinkage, and lets it out."""

from __future__ import annotations

import itertools
import math

import cadquery as cq
import pytest
from tooling_samples import gelslim2

from gelslim_cad.build.solid_checks import undercut_area_mm2
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.solids.gel import gel_solid
from gelslim_cad.solids.tooling.mould import (
    BORDER_MM,
    MouldPlan,
    cavity_in_mould,
    cavity_solid,
    mould_parts,
    plan_mould,
    plate_stock,
)

PROCESSES = ("acrylic", "sla", "fdm", "aluminium")
CASES = list(itertools.product(PROCESSES, (0.0, 1.2)))


def mould(process: str, crown: float, **more: object) -> Dimensions:
    return gelslim2(
        manufacturing__mould_process=process, design__gel__crown_height_mm=crown, **more
    )


def plain_prism(plan: MouldPlan, low: float, high: float) -> cq.Shape:
    """The mould's outside without holes, drawn by CadQuery's own sketch."""
    x0, y0, x1, y1 = plan.block.bounds_mm
    flat = cq.Workplane("XY").workplane(offset=low).rect(x1 - x0, y1 - y0)
    return flat.extrude(high - low).edges("|Z").fillet(3.0).val()


@pytest.mark.parametrize(("shrinkage", "crown"), [(0.0, 0.0), (0.1, 0.0), (0.1, 2.0), (10.0, 1.0)])
def test_cavity_is_the_gel_over_one_minus_shrinkage(shrinkage: float, crown: float) -> None:
    d = mould("sla", crown, manufacturing__gel_shrinkage_percent=shrinkage)
    ratio = cavity_solid(d).Volume() / gel_solid(d).Volume()
    assert ratio * (1 - shrinkage / 100) ** 3 == pytest.approx(1, abs=1e-9)
    assert cavity_solid(d).isValid()
    cured = cavity_solid(d).BoundingBox()
    assert cured.xlen * (1 - shrinkage / 100) == pytest.approx(28, abs=1e-5)


@pytest.mark.parametrize(
    ("process", "crown"),
    [
        (p, c) if c > 0 or p == PROCESSES[0] else pytest.param(p, c, marks=pytest.mark.slow)
        for p, c in CASES
    ],
)
def test_parts_enclose_the_cavity_and_nothing_else(process: str, crown: float) -> None:
    """Outside less parts = cavity, holes and notches: what is left is the cavity's volume."""
    d = mould(process, crown)
    plan, parts, cavity = plan_mould(d), mould_parts(d), cavity_in_mould(d)
    low = min(p.solid.BoundingBox().zmin for p in parts)
    high = max(p.solid.BoundingBox().zmax for p in parts)
    left: cq.Shape = plain_prism(plan, low, high)
    for part in parts:
        assert part.solid.isValid()
        assert part.solid.intersect(cavity).Volume() == pytest.approx(0, abs=1e-6)
        left = left.cut(part.solid)
    # Within the outline and under the lid nothing but the cavity is free.
    half_x, half_y = plan.cavity.length_mm / 2 + 1, plan.cavity.width_mm / 2 + 1
    inner = cq.Solid.makeBox(
        2 * half_x, 2 * half_y, plan.depth_mm - low, cq.Vector(-half_x, -half_y, low)
    )
    assert left.intersect(inner).Volume() == pytest.approx(plan.cavity.volume_mm3, rel=2e-6)


@pytest.mark.parametrize("process", PROCESSES)
def test_lid_has_gate_and_vents_over_the_cavity(process: str) -> None:
    d = mould(process, 0.0)
    plan = plan_mould(d)
    lid = next(p for p in mould_parts(d) if p.name == "mould_lid").solid
    box = lid.BoundingBox()
    assert len(plan.vents) >= 2
    for x, y, diameter in (plan.gate, *plan.vents):
        pin = cq.Solid.makeCylinder(
            diameter / 2 - 1e-3, 40, cq.Vector(x, y, box.zmin - 20), cq.Vector(0, 0, 1)
        )
        assert pin.intersect(lid).Volume() == pytest.approx(0, abs=1e-9)
        within = pin.intersect(cavity_in_mould(d)).Volume()
        assert within == pytest.approx(math.pi * (diameter / 2 - 1e-3) ** 2 * plan.depth_mm)
    assert all(v[2] == 1.0 for v in plan.vents)


def test_frame_volume_in_closed_form() -> None:
    d = mould("acrylic", 0.0)
    frame = next(p for p in mould_parts(d) if p.name == "mould_frame").solid
    factor = 1 / (1 - 0.001)
    outer = (28 * factor + 2 * BORDER_MM) ** 2 - (4 - math.pi) * 9
    opening = GelShape(28, 28, 2, 2).area_mm2 * factor**2
    holes = math.pi / 4 * (4 * 3.4**2 + 2 * 3.0**2)
    assert frame.Volume() == pytest.approx((outer - opening - holes) * 2 * factor, rel=1e-9)


@pytest.mark.parametrize("gel", [(5, 5, 2.5), (5, 5, 0), (120, 5, 2.5), (5, 120, 0), (60, 60, 30)])
def test_holes_keep_apart_on_any_gel(gel: tuple[float, float, float]) -> None:
    d = gelslim2(
        design__gel__length_mm=gel[0],
        design__gel__width_mm=gel[1],
        design__gel__corner_radius_mm=gel[2],
        design__markers__rows=None,
        design__markers__columns=None,
        manufacturing__mould_process="sla",
        design__housing__fit_clearance_mm=2.0,
    )
    plan = plan_mould(d)
    wide = [(x, y, 8.0) for x, y, _ in plan.dowels]
    holes = [plan.gate, *plan.vents, *plan.bolts, *wide]
    for (x, y, a), (u, v, b) in itertools.combinations(holes, 2):
        assert math.hypot(x - u, y - v) - (a + b) / 2 >= 1.0
    x0, y0, x1, y1 = plan.block.bounds_mm
    for x, y, a in (*plan.bolts, *wide):
        assert min(x - x0, x1 - x, y - y0, y1 - y) - a / 2 >= 2.9
    for part in mould_parts(d):
        assert part.solid.isValid()


def test_lid_fits_one_way_only() -> None:
    plan = plan_mould(mould("sla", 0.0))
    pins = [(x, y) for x, y, _ in plan.dowels]
    for turn in ((-1, -1), (1, -1), (-1, 1)):
        turned = [(turn[0] * x, turn[1] * y) for x, y in pins]
        miss = max(min(math.dist(p, q) for q in pins) for p in turned)
        assert miss > 1.0


def test_undercut_is_measured() -> None:
    """A dovetail's two sides, and the lower half of a ball, hold a casting back."""
    profile = [(-5, 0), (5, 0), (4, 3), (-4, 3)]
    dovetail = cq.Workplane("XZ").polyline(profile).close().extrude(10).val()
    assert undercut_area_mm2(dovetail, (0, 0, -1)) < 1e-3
    assert undercut_area_mm2(dovetail) == pytest.approx(2 * 10 * math.hypot(3, 1), rel=1e-6)
    ball = cq.Workplane("XY").sphere(3).val()
    assert undercut_area_mm2(ball) == pytest.approx(2 * math.pi * 9, rel=0.01)


@pytest.mark.parametrize(
    "shape",
    [
        (28, 28, 2, 2, 1),
        pytest.param((120, 26.4, 13.2, 15, 5), marks=pytest.mark.slow),
        (5, 5, 1.746, 0.3, 0.922),
        (43, 120, 21.5, 0.3, 5),
    ],
)
def test_crowned_cavities_release_the_gel(shape: tuple[float, ...]) -> None:
    """Facets of the round walls lean here, the walls do not."""
    names = ("length_mm", "width_mm", "corner_radius_mm", "thickness_mm", "crown_height_mm")
    changes = {f"design__gel__{n}": v for n, v in zip(names, shape, strict=True)}
    d = gelslim2(**changes, design__markers__rows=None, design__markers__columns=None)
    assert undercut_area_mm2(cavity_in_mould(d)) < 1e-3
    assert undercut_area_mm2(cavity_in_mould(d), (0, 0, -1)) >= 1e-3


def test_plates_from_stock() -> None:
    assert plate_stock((1.0, 3.0, 4.0, 6.0), 4.0) == (4.0, 1)
    assert plate_stock((1.0, 3.0), 4.0) == (3.0, 2)
    assert plate_stock((1.0,), 4.0) == (1.0, 4)
