"""Curves of written solids lie on their surfaces, as FreeCAD's check of a shape demands."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import cadquery as cq
import pytest

from gelslim_cad.dimensions import derive
from gelslim_cad.export.step import step_bytes
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.sensor import marker_grid
from gelslim_cad.solids.finger import finger_parts, tooling_parts
from gelslim_cad.solids.tooling.calibration import indenter_radius_mm, sphere_indenter
from gelslim_cad.spec.reader import read_spec

sys.path.insert(0, str(Path(__file__).parents[1] / "solids"))

from tooling_samples import gelslim2

DESIGNS = Path(__file__).parents[2] / "designs"


def faults(shape: cq.Shape) -> list[str]:
    """What OCCT's analyser of arguments, behind FreeCAD's check, finds wrong."""
    from OCP.BOPAlgo import BOPAlgo_ArgumentAnalyzer

    analyser = BOPAlgo_ArgumentAnalyzer()
    analyser.SetShape1(shape.wrapped)
    for mode in ("SelfInterMode", "SmallEdgeMode", "RebuildFaceMode", "CurveOnSurfaceMode"):
        setattr(analyser, mode, True)
    analyser.Perform()
    return [str(result.GetCheckStatus()) for result in analyser.GetCheckResult()]


def reread(parts: Part | tuple[Part, ...], folder: Path) -> list[cq.Solid]:
    path = folder / "written.step"
    path.write_bytes(
        step_bytes(parts, name="all") if isinstance(parts, tuple) else step_bytes(parts)
    )
    return list(cq.importers.importStep(str(path)).solids().vals())


def test_the_analyser_finds_a_cut_sphere(tmp_path: Path) -> None:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    axes = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0), gp_Dir(0, 0, -1))
    ball = cq.Shape.cast(BRepPrimAPI_MakeSphere(axes, 5.0).Solid())
    stem = cq.Solid.makeCylinder(4.0, 12.0, cq.Vector(0, 0, -6))
    capped = stem.intersect(ball.fuse(cq.Solid.makeCylinder(4.5, 6.0, cq.Vector(0, 0, -6))))
    part = sphere_indenter(gelslim2())
    (solid,) = reread(replace(part, solid=capped.Solids()[0]), tmp_path)
    assert any("CurveOnSurface" in fault for fault in faults(solid))


@pytest.mark.parametrize("side", [8.0, 12.5, 28.0])
def test_indenter_has_its_curves_on_its_surfaces(side: float, tmp_path: Path) -> None:
    free = dict.fromkeys(
        (
            "design__markers__rows",
            "design__markers__columns",
            "mesh__cells_along",
            "mesh__cells_across",
        )
    )
    d = gelslim2(design__gel__length_mm=side, design__gel__width_mm=side, **free)
    part = sphere_indenter(d)
    (solid,) = reread(part, tmp_path)
    assert faults(solid) == []
    radius = indenter_radius_mm(GelShape.of(d))
    balls = [f for f in solid.Faces() if f.geomType() == "SPHERE"]
    assert len(balls) == 1
    apex = part.solid.BoundingBox().zmax
    for share in (0.0, 0.3, 0.79):
        x = share * radius
        z = apex - radius + (radius**2 - x**2) ** 0.5
        assert balls[0].distance(cq.Vertex.makeVertex(x, 0, z)) == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gelslim2", "thin"])
def test_every_part_and_the_assembly_pass(name: str, tmp_path: Path) -> None:
    d = derive(read_spec(DESIGNS / f"{name}.yaml").spec)
    finger = finger_parts(d)
    tooling = [p for p in tooling_parts(d, marker_grid(d)) if p.name != "marker_stencil"]
    for part in (*finger, *tooling):
        assert faults(reread(part, tmp_path)[0]) == [], part.name
    for k, solid in enumerate(reread(finger, tmp_path)):
        assert faults(solid) == [], k
