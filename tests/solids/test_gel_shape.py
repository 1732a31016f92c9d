"""The gel's closed forms against quadrature, and the gel's solid against the closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from tooling_samples import gelslim2

from gelslim_cad.export.mesh import mesh_for
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.solids.gel import gel_pad, shaped_gel

SHAPES = [
    GelShape(28, 28, 2, 2),
    GelShape(28, 28, 2, 2, 1),
    GelShape(30, 20, 10, 2, 1),
    GelShape(30, 30, 15, 2, 1),
    GelShape(20, 20, 0, 2, 3),
    GelShape(5, 5, 2.5, 0.3, 5),
    GelShape(5, 5, 0, 0.3, 5),
    GelShape(120, 5, 2.5, 0.3, 0.001),
    GelShape(107, 62, 0, 0.3, 3.4),
    GelShape(120, 120, 60, 15, 5),
]


def quadrature_volume(shape: GelShape) -> float:
    """Thickness integrated over x and, exactly for a parabola, over y."""
    a, b, r = shape.length_mm / 2, shape.width_mm / 2, shape.corner_radius_mm
    far = max(math.hypot(a - r, b - r) + r, 1e-9)

    def slice_area(x: float) -> float:
        over = max(abs(x) - (a - r), 0.0)
        half = b - r + math.sqrt(max(r * r - over * over, 0.0))
        parabola = shape.crown_mm / far**2
        height = shape.edge_thickness_mm + shape.crown_mm - parabola * x * x
        return 2 * (height * half - parabola * half**3 / 3)

    edges = sorted({-a, r - a, 0.0, a - r, a})
    pieces = itertools.pairwise(edges)
    return sum(quad(slice_area, low, high, epsabs=1e-11, epsrel=1e-11)[0] for low, high in pieces)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_volume_agrees_with_quadrature(shape: GelShape) -> None:
    assert shape.volume_mm3 == pytest.approx(quadrature_volume(shape), rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_solid_has_the_closed_form_volume_and_height(shape: GelShape) -> None:
    solid = shaped_gel(shape)
    assert solid.isValid()
    assert solid.Volume() == pytest.approx(shape.volume_mm3, rel=3e-6)
    box = solid.BoundingBox(1e-4)
    assert box.zmax == pytest.approx(0.0, abs=1e-6)
    assert box.zmin == pytest.approx(-shape.thickness_mm, abs=1e-6)
    assert (box.xlen, box.ylen) == pytest.approx((shape.length_mm, shape.width_mm), abs=1e-5)


@pytest.mark.parametrize("shape", [s for s in SHAPES if s.crown_mm], ids=str)
def test_rim_lies_at_the_edge_thickness_or_above(shape: GelShape) -> None:
    """Lowest point of the outer surface: minus the crown, at the farthest corner."""
    faces = shaped_gel(shape).Faces()
    dome = next(f for f in faces if f.geomType() in ("BEZIER", "BSPLINE"))
    rim = [edge.positionAt(t).z for edge in dome.Edges() for t in np.linspace(0, 1, 21)]
    assert min(rim) == pytest.approx(-shape.crown_mm, abs=2e-6)


@pytest.mark.parametrize("shape", [SHAPES[1], SHAPES[3], SHAPES[4], SHAPES[8]], ids=str)
def test_crowned_mesh_is_closed_and_on_the_paraboloid(shape: GelShape) -> None:
    mesh, _ = mesh_for(shaped_gel(shape))
    x, y, z = mesh.vertices_mm.T
    outer = z > -shape.crown_mm - 1e-5
    assert z[outer] == pytest.approx(shape.surface_z_mm(x[outer], y[outer]), abs=2e-5)
    inside = np.hypot(x, y) < 0.5 * min(shape.length_mm, shape.width_mm) / 2
    assert (outer & inside).sum() > 5


def test_paraboloid_stays_as_close_to_the_sphere_as_documented() -> None:
    shape = GelShape(28, 28, 2, 2, 1)
    rho = np.linspace(0, shape.rim_mm, 400)
    radius = (shape.rim_mm**2 + shape.crown_mm**2) / (2 * shape.crown_mm)
    sphere = np.sqrt(radius**2 - rho**2) - radius
    gap = np.abs(shape.surface_z_mm(rho, 0) - sphere).max()
    # Largest at rho² = rim² / 2, where the next term of the sphere's series is h³ / (4 rim²) / 4.
    assert 0.2 < gap / (shape.crown_mm**3 / (4 * shape.rim_mm**2)) <= 1.05


def test_tiny_radii_and_crowns_are_snapped() -> None:
    shape = GelShape.of(
        {
            "design.gel.length_mm": 20,
            "design.gel.width_mm": 30,
            "design.gel.corner_radius_mm": 9.99995,
            "design.gel.thickness_mm": 2,
            "design.gel.crown_height_mm": 1e-5,
        }
    )
    assert shape.corner_radius_mm == 10
    assert shape.crown_mm == 0
    assert shape.thickness_mm == pytest.approx(2.00001)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_inset_corner_touches_the_outline(shape: GelShape) -> None:
    inset = 0.8
    cx, cy = shape.inset_corner_mm(inset)
    ring = np.linspace(0, 2 * np.pi, 721)
    points = np.column_stack([cx + inset * np.cos(ring), cy + inset * np.sin(ring)])
    a, b, r = shape.length_mm / 2, shape.width_mm / 2, shape.corner_radius_mm
    over = np.maximum(np.abs(points) - [a - r, b - r], 0)
    depth = r - np.hypot(*over.T)
    if r == 0:
        depth = np.minimum(a - np.abs(points[:, 0]), b - np.abs(points[:, 1]))
    assert depth.min() == pytest.approx(0, abs=1e-3)


def test_pad_part_sits_between_window_and_origin() -> None:
    d = gelslim2(design__gel__crown_height_mm=0.8)
    part = gel_pad(d)
    box = part.solid.BoundingBox()
    assert box.zmin == pytest.approx(d["stack.gel_bottom_z_mm"], abs=1e-6)
    assert box.zmax == pytest.approx(0, abs=1e-6)
    assert part.in_assembly
    assert part.process == "cast"
    assert part.colour[3] < 1
