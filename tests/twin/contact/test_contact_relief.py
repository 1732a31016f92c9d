"""Height maps of STL indenters against another library's rays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sampled import quick

from gelslim_twin.scene.indenter import Stl
from gelslim_twin.tools.profile import mesh_file_profile

trimesh = pytest.importorskip(
    "trimesh", reason="trimesh is not installed: height maps of STL files are NOT checked"
)
Array = NDArray[np.float64]
RESOLUTION_MM = 0.1


def bodies() -> dict[str, object]:
    """Meshes with slopes, holes, overhangs, and several pieces."""
    rng = np.random.default_rng(5)
    soup = trimesh.convex.convex_hull(rng.normal(size=(40, 3)) * [2.0, 1.5, 1.0])
    ball = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    ring = trimesh.creation.annulus(r_min=1.0, r_max=2.5, height=1.5)
    torus = trimesh.creation.torus(major_radius=2.0, minor_radius=0.7)
    tilted = trimesh.creation.box(extents=(3.0, 2.0, 1.0))
    tilted.apply_transform(trimesh.transformations.rotation_matrix(0.4, [1.0, 0.6, 0.2]))
    two = trimesh.util.concatenate(
        [ball, trimesh.creation.cone(radius=1.2, height=3.0).apply_translation([3.5, 1.0, -0.7])]
    )
    return {"hull": soup, "ball": ball, "ring": ring, "torus": torus, "tilted": tilted, "two": two}


class Boxes:
    """Stands in for the search tree of trimesh's rays: which triangles' boxes meet a box."""

    def __init__(self, triangles: Array) -> None:
        self.low, self.high = triangles.min(axis=1), triangles.max(axis=1)
        self.bounds = np.concatenate([self.low.min(axis=0), self.high.max(axis=0)])

    def intersection(self, bounds: Array) -> list[int]:
        meets = (self.low <= bounds[3:]).all(axis=1) & (self.high >= bounds[:3]).all(axis=1)
        return [int(k) for k in np.flatnonzero(meets)]


def lowest(mesh, x: Array, y: Array) -> Array:  # type: ignore[no-untyped-def]
    """First hit of upward rays from below the mesh; infinite where they miss."""
    from trimesh.ray.ray_triangle import ray_triangle_id

    start = np.column_stack([x, y, np.full(len(x), mesh.bounds[0, 2] - 1.0)])
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    corners = np.asarray(mesh.triangles)
    _, rays, places = ray_triangle_id(corners, start, up, mesh.face_normals, Boxes(corners))
    found = np.full(len(x), np.inf)
    np.minimum.at(found, rays, places.reshape(-1, 3)[:, 2])
    return found


@pytest.mark.parametrize(
    "down", quick(["-z", "z", "-x", "x", "-y", "y"], ("-z", "x", "-y").__contains__)
)
@pytest.mark.parametrize("name", sorted(bodies()))
def test_heights_are_where_rays_first_hit(name: str, down: str, tmp_path: Path) -> None:
    """On the grid's points to rounding; a direction is turned to -z before."""
    mesh = bodies()[name]
    mesh.export(tmp_path / "body.stl")  # type: ignore[attr-defined]
    shape = Stl(shape="stl", file="body.stl", resolution_mm=RESOLUTION_MM, down=down, scale=1.5)
    profile = mesh_file_profile(shape, tmp_path)
    # Corners as the file has them, in single precision.
    turned = seen_from_below(trimesh.load(tmp_path / "body.stl"), down)
    turned.apply_scale(1.5)
    low, high = turned.bounds
    turned.apply_translation([*(-(low + high) / 2)[:2], -low[2]])
    half = (high - low)[:2] / 2
    count = np.ceil(2 * half / RESOLUTION_MM).astype(int) + 1
    x, y = (np.linspace(-h, h, n)[1:-1] for h, n in zip(half, count, strict=True))
    rng = np.random.default_rng(1)
    px, py = rng.choice(x, 300), rng.choice(y, 300)
    true, found = lowest(turned, px, py), profile(px, py)
    # A ray through an edge or a rim may pass on either side.
    moved = [lowest(turned, px + dx, py + dy) for dx, dy in ((1e-5, 2e-5), (-2e-5, -1e-5))]
    sure = np.isfinite([true, *moved]).all(axis=0) | np.isinf([true, *moved]).all(axis=0)
    known = np.isfinite(moved[0])
    apart = np.subtract(moved[0], moved[1], out=np.zeros_like(moved[0]), where=known)
    sure &= np.abs(apart) < 1e-3
    assert sure.mean() > 0.9
    assert (np.isfinite(found) == np.isfinite(true))[sure].all()
    on = sure & np.isfinite(true)
    assert on.sum() > 60
    assert np.abs(found[on] - true[on]).max() < 2e-5
    if name in {"ring", "torus"} and down.endswith("z"):
        assert np.isinf(profile(np.zeros(1), np.zeros(1))).all()


def seen_from_below(mesh, down: str):  # type: ignore[no-untyped-def]
    """A rotated copy whose `down` points to -z, by a proper rotation that keeps cyclic order."""
    axis, sign = "xyz".index(down[-1]), -1.0 if down.startswith("-") else 1.0
    turn = np.zeros((4, 4))
    turn[3, 3] = 1.0
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn[0, first], turn[1, second], turn[2, axis] = 1.0, -sign, -sign
    assert np.linalg.det(turn) == pytest.approx(1.0)
    copy = mesh.copy()
    copy.apply_transform(turn)
    return copy


def test_between_grid_points_heights_are_bilinear(tmp_path: Path) -> None:
    """A plane comes out exactly between them; a ball to its curvature over a cell."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    ball.export(tmp_path / "ball.stl")
    profile = mesh_file_profile(Stl(shape="stl", file="ball.stl", resolution_mm=0.05), tmp_path)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1.0, 1.0, (2, 400))
    true = 2.0 - np.sqrt(4.0 - x * x - y * y)
    np.testing.assert_allclose(profile(x, y), true, atol=0.05**2 / 4 + 2e-3)
