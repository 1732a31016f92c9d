"""The deviation of a tessellation from its surface, against closed forms and the CAD kernel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

cq = pytest.importorskip("cadquery")

from bench.models.surface_deviation import deviation_um, lattice  # noqa: E402
from gelslim_cad.export.mesh import face_patches  # noqa: E402


def test_deviation_of_a_cylinder_is_its_sagitta() -> None:
    """n chords of a circle of radius r are r (1 - cos π/n) off it; planes are exact."""
    solid = cq.Solid.makeCylinder(5.0, 8.0)
    for angle in (30.0, 10.0, 4.0):
        patches = face_patches(solid, 1.0, angle)
        side = max(patches, key=lambda p: np.ptp(p.nodes_mm[:, 2]))
        around = np.unique(np.round(np.arctan2(side.nodes_mm[:, 1], side.nodes_mm[:, 0]), 6))
        n = len(np.unique(np.round(np.mod(around, 2 * math.pi), 5)))
        expected = 1000 * 5.0 * (1 - math.cos(math.pi / n))
        assert deviation_um(solid, patches) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("shape", ["sphere", "cone", "torus", "loft"])
def test_deviation_agrees_with_the_kernel_s_own_distance(shape: str) -> None:
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape

    solid: Any = {
        "sphere": lambda: cq.Solid.makeSphere(3.0).moved(cq.Location((1, 2, 3), (1, 1, 0), 40)),
        "cone": lambda: cq.Solid.makeCone(4.0, 1.5, 6.0, cq.Vector(1, 0, 0), cq.Vector(1, 1, 2)),
        "torus": lambda: cq.Solid.makeTorus(5.0, 1.0, cq.Vector(0, 1, 0), cq.Vector(0, 1, 1)),
        "loft": lambda: cq.Workplane("XY").rect(6, 4).workplane(offset=5).circle(1.5).loft().val(),
    }[shape]()
    patches = face_patches(solid, 0.3, 30.0)
    points = np.concatenate([lattice(p) for p in patches])
    some = points[:: max(1, len(points) // 400)]
    shell = solid.Shells()[0].wrapped
    distances = [
        BRepExtrema_DistShapeShape(cq.Vertex.makeVertex(*p).wrapped, shell).Value() for p in some
    ]
    found = deviation_um(solid, patches)
    assert found >= 1000 * max(distances) - 0.01
    assert found <= 1.3 * 1000 * max(distances) + 0.01
