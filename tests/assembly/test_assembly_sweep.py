"""First contact of moving meshes: closed forms, and dense steps with another library's Booleans."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest

from gelslim_cad.assembly.sweep import Surface, first_contact

Manifold = manifold3d.Manifold
UP, ALONG = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def surface(*bodies: Manifold) -> Surface:
    found = []
    for body in bodies:
        mesh = body.to_mesh()
        points = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
        found.append(points[np.asarray(mesh.tri_verts, dtype=int)])
    return Surface.joined(found)


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Manifold:
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    return Manifold.cube(size).translate((x[0], y[0], z[0]))


def plate_with_hole(side: float, thick: float) -> Manifold:
    half = side / 2
    hole = box((-half, half), (-half, half), (-1, thick + 1))
    return box((-10, 10), (-10, 10), (0, thick)) - hole


@pytest.mark.parametrize(("side", "free"), [(3.9, True), (4.1, False)])
def test_a_peg_passes_a_hole_that_is_wider(side: float, free: bool) -> None:
    plate = plate_with_hole(4.0, 3.0)
    half = side / 2
    peg = box((-half, half), (-half, half), (-5, 2.5))
    found = first_contact(surface(peg), surface(plate), UP)
    if free:
        assert found is None
    else:
        assert found is not None
        assert found.short_mm == pytest.approx(2.5, abs=1e-6)  # its top stays below the plate
        assert found.point_mm[2] == pytest.approx(0.0, abs=1e-6)


def test_a_ball_comes_to_rest_in_a_funnel() -> None:
    """In a cone of half angle a the centre of a ball of radius r stays r / sin(a) from the apex."""
    angle, radius = math.radians(35), 2.0
    cone = Manifold.cylinder(20.0, 0.0, 20.0 * math.tan(angle), 180).translate((0, 0, -20))
    block = Manifold.cube((60, 60, 30), True).translate((0, 0, -6))
    funnel = (
        block
        - cone.translate((0, 0, 20)).translate((0, 0, -15))
        - Manifold.cube((60, 60, 30), True).translate((0, 0, 20))
    )
    ball = Manifold.sphere(radius, 96)
    # Apex at z = -15; a ball whose end would be at the apex stops r / sin(a) above it.
    found = first_contact(surface(ball.translate((0, 0, -15))), surface(funnel), (0.0, 0.0, -1.0))
    assert found is not None
    assert found.short_mm == pytest.approx(radius / math.sin(angle), rel=5e-3)


def test_the_nearest_of_several_bodies_is_named() -> None:
    first, second = box((0, 1), (0, 1), (0, 1)), box((3, 4), (0, 1), (0, 1))
    low, high = box((0, 1), (0, 1), (5, 6)), box((3, 4), (0, 1), (7, 8))
    found = first_contact(
        surface(first.translate((0, 0, 10)), second.translate((0, 0, 10))),
        surface(high, low),
        UP,
    )
    assert found is not None
    assert (found.moving, found.fixed) == (0, 1)
    assert found.short_mm == pytest.approx(6.0)


def test_a_finite_way_ends_where_it_is_told() -> None:
    """What lies behind the start is not met, what lies before it is."""
    slide = surface(box((0, 4), (0, 4), (0, 1)))
    obstacles = surface(box((-9, -8), (0, 4), (0, 1)), box((4.5, 5.5), (0, 4), (0, 1)))
    assert first_contact(slide, obstacles, ALONG, 7.5) is None
    for length in (14.0, math.inf):
        found = first_contact(slide, obstacles, ALONG, length)
        assert found is not None
        assert found.fixed == 0
        assert found.short_mm == pytest.approx(13.0)


def test_what_lies_beside_or_behind_is_not_met() -> None:
    part = surface(box((0, 1), (0, 1), (0, 1)))
    assert first_contact(part, surface(box((1.01, 2), (0, 1), (-9, 9))), UP) is None
    assert first_contact(part, surface(box((0, 1), (0, 1), (1.01, 2))), UP) is None
    assert first_contact(part, Surface.joined([]), UP) is None


def random_body(random: np.random.Generator) -> Manifold:
    """Union and difference of a few boxes, cylinders and balls."""
    whole = Manifold()
    for k in range(4):
        size = random.uniform(1.0, 4.0, 3)
        kind = random.integers(3)
        piece = (
            Manifold.cube(size.tolist(), True)
            if kind == 0
            else Manifold.cylinder(size[0], size[1] / 2, size[2] / 2, 12, True)
            if kind == 1
            else Manifold.sphere(size[0] / 2, 12)
        )
        piece = piece.rotate(random.uniform(0, 360, 3).tolist())
        piece = piece.translate(random.uniform(-2, 2, 3).tolist())
        whole = whole - piece if k == 2 else whole + piece
    return whole


STEP = 0.02


def stepped(moving: Manifold, fixed: Manifold, along: np.ndarray, way: float) -> float | None:
    """Rest of the way at the first step, from far away, at which the bodies overlap."""
    for rest in np.arange(way, -STEP, -STEP):
        if (moving.translate((-max(rest, 0.0) * along).tolist()) ^ fixed).volume() > 1e-7:
            return float(rest)
    return None


@pytest.mark.parametrize("seed", range(40))
def test_random_bodies_meet_where_dense_steps_find_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    moving, fixed = random_body(random), random_body(random)
    fixed = fixed.translate(random.uniform(-3, 3, 3).tolist())
    along = random.normal(size=3)
    along /= np.linalg.norm(along)
    found = first_contact(surface(moving), surface(fixed), tuple(along.tolist()))
    far = stepped(moving, fixed, along, 16.0)
    if far is None:
        assert found is None or found.short_mm < STEP
    else:
        assert found is not None
        assert far - 1e-6 <= found.short_mm <= far + 2 * STEP
    # A finite way from a free start.
    start = 0.5 * (16.0 if found is None else found.short_mm)
    if (moving.translate((-start * along).tolist()) ^ fixed).volume() < 1e-9:
        near = first_contact(surface(moving), surface(fixed), tuple(along.tolist()), start)
        reference = stepped(moving, fixed, along, start)
        assert (near is None or near.short_mm < STEP) == (reference is None)
        if near is not None and reference is not None:
            assert reference - 1e-6 <= near.short_mm <= reference + 2 * STEP
