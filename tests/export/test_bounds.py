"""Bounding boxes of solids: those of tori in closed form, against points and the CAD kernel."""

from __future__ import annotations

import cadquery as cq
import numpy as np
import pytest
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib

from gelslim_cad.export.brep import _torus_bounds_mm, bounds_mm

SEARCH_MM = 3e-7
"""What the kernel's search for the extremes of a torus is off by."""


def kernel_bounds_mm(shape: cq.Shape) -> np.ndarray:
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape.wrapped, box, False, False)
    box.SetGap(0.0)
    return np.array([box.CornerMin().Coord(), box.CornerMax().Coord()])


def bent_rod(rng: np.random.Generator) -> cq.Solid:
    """A round rod bent along part of a circle, somewhere in space."""
    small = float(rng.uniform(0.2, 1.5))
    large = small * float(rng.uniform(1.2, 6.0))
    pose = cq.Location(tuple(rng.uniform(-9, 9, 3)), tuple(rng.uniform(-180, 180, 3)))
    disc = cq.Face.makeFromWires(
        cq.Wire.makeCircle(small, cq.Vector(large, 0, 0), cq.Vector(0, 1, 0))
    )
    turn = float(rng.uniform(20, 340))
    rod = cq.Solid.revolve(disc, turn, cq.Vector(0, 0, 0), cq.Vector(0, 0, 1))
    return rod.moved(pose)


@pytest.mark.parametrize("seed", range(6))
def test_bent_rods_are_bounded_as_by_the_kernel(seed: int) -> None:
    rod = bent_rod(np.random.default_rng([41, seed]))
    assert sum(_torus_bounds_mm(face) is not None for face in rod.Faces()) == 1
    assert np.abs(np.array(bounds_mm(rod)) - kernel_bounds_mm(rod)).max() < SEARCH_MM


@pytest.mark.parametrize("seed", range(6))
def test_a_torus_face_is_bounded_by_its_points(seed: int) -> None:
    """Points at random stay within the bounds and come near each of them."""
    rng = np.random.default_rng([42, seed])
    (face,) = (f for f in bent_rod(rng).Faces() if f.geomType() == "TORUS")
    found = _torus_bounds_mm(face)
    assert found is not None
    surface = face._geomAdaptor()
    u0, u1, v0, v1 = face.uvBounds()
    points = np.array(
        [
            surface.Value(u, v).Coord()
            for u in np.linspace(u0, u1, 60)
            for v in np.linspace(v0, v1, 60)
        ]
    )
    step = max(u1 - u0, v1 - v0) / 59
    size = float(np.ptp(found, axis=0).max())
    outside = np.maximum(found[0] - points, points - found[1]).max()
    assert outside < 1e-9
    missed = np.abs(np.array([points.min(axis=0), points.max(axis=0)]) - found).max()
    assert missed < size * step**2


def test_a_trimmed_torus_face_is_left_to_the_kernel() -> None:
    """A ring that a plane cuts aslant is no rectangle of the torus's parameters."""
    ring = cq.Solid.makeTorus(5.0, 1.0)
    half = cq.Workplane().box(30, 30, 30).translate((15, 0, 0)).val()
    cut = ring.intersect(half.rotate(cq.Vector(), cq.Vector(0, 1, 0), 20.0)).Solids()[0]
    tori = [f for f in cut.Faces() if f.geomType() == "TORUS"]
    assert tori
    assert all(_torus_bounds_mm(face) is None for face in tori)
    assert np.array(bounds_mm(cut)) == pytest.approx(kernel_bounds_mm(cut), abs=SEARCH_MM)


def test_a_whole_torus_has_the_bounds_of_its_radii() -> None:
    low, high = bounds_mm(cq.Solid.makeTorus(5.0, 1.0))
    assert high == pytest.approx([6.0, 6.0, 1.0], abs=1e-9)
    assert low == pytest.approx([-6.0, -6.0, -1.0], abs=1e-9)
