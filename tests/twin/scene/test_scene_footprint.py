"""Footprints against brute-force integration; estimates of force against contact theory."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pydantic import TypeAdapter
from scipy import sparse
from scipy.sparse.linalg import spsolve

from gelslim_twin.effects.contact_estimate import Footprint, contact_estimate, nonlinear_excess
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.indenter import Indenter
from gelslim_twin.scene.mesh_file import footprint_mm, mesh_corners
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.surface_operator import surface_operator

HERE = Path()
STEP = 0.01


def made(**fields: object) -> Indenter:
    return TypeAdapter(Indenter).validate_python(fields)


def overlap(height: np.ndarray, depth: float) -> tuple[float, float]:
    below = np.maximum(depth - height, 0)
    return float((below > 0).sum() * STEP**2), float(below.sum() * STEP**2)


X, Y = np.meshgrid(np.arange(-6, 6, STEP) + STEP / 2, np.arange(-6, 6, STEP) + STEP / 2)
R = np.hypot(X, Y)


def ball(r: np.ndarray, radius: float) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.where(r < radius, radius - np.sqrt(radius**2 - r**2), np.inf)


def rounded_flank(r: np.ndarray, tip: float, half_deg: float) -> np.ndarray:
    half = math.radians(half_deg)
    at, up = tip * math.cos(half), tip * (1 - math.sin(half))
    return np.where(r < at, ball(r, tip), up + (r - at) / math.tan(half))


CASES = [
    (made(shape="sphere", radius_mm=3.0), ball(R, 3.0)),
    (
        made(shape="cylinder", radius_mm=2.0, length_mm=6.0),
        np.where(np.abs(X) < 3, ball(np.abs(Y), 2.0), np.inf),
    ),
    (
        made(shape="ring", outer_radius_mm=4.0, inner_radius_mm=2.5),
        np.where((R < 4) & (R > 2.5), 0, np.inf),
    ),
    (
        made(shape="flat_punch", length_mm=5.0, width_mm=3.0),
        np.where((np.abs(X) < 2.5) & (np.abs(Y) < 1.5), 0, np.inf),
    ),
    (
        made(shape="wedge", included_angle_deg=100, length_mm=4.0, tip_radius_mm=0.5),
        np.where(np.abs(X) < 2, rounded_flank(np.abs(Y), 0.5, 50), np.inf),
    ),
    (made(shape="cone", included_angle_deg=120, tip_radius_mm=0.8), rounded_flank(R, 0.8, 60)),
    (
        made(shape="textured_plane", length_mm=8.0, width_mm=8.0, relief_mm=0.5, pitch_mm=2.0),
        np.where(
            (np.abs(X) < 4) & (np.abs(Y) < 4), 0.25 * (1 - np.cos(np.pi * X)), np.inf
        ),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("indenter", "height"), CASES, ids=lambda v: getattr(v, "shape", ""))
@pytest.mark.parametrize("depth", [0.05, 0.3, 1.0])
def test_area_and_volume_are_those_of_the_shape(indenter, height, depth):
    footprint = tool_footprint([indenter], HERE, 1e6)
    area, volume = overlap(height, depth)
    assert footprint.area_mm2(depth) == pytest.approx(area, rel=0.03)
    assert footprint.volume_mm3(depth) == pytest.approx(volume, rel=0.01)


@pytest.mark.parametrize(("indenter", "height"), CASES, ids=lambda v: getattr(v, "shape", ""))
@pytest.mark.parametrize("depth", [0.05, 0.3, 1.0])
def test_reach_is_the_farthest_place_below_the_surface(indenter, height, depth):
    farthest = R[height < depth].max()
    reach = tool_footprint([indenter], HERE, 1e6).reach_mm
    assert reach(depth) == pytest.approx(farthest, abs=3 * STEP)
    high = indenter.model_copy(update={"raised_mm": 0.2, "x_mm": 3.0, "y_mm": 4.0})
    reach = tool_footprint([high], HERE, 1e6).reach_mm
    assert reach(0.2) == 0.0
    assert reach(depth + 0.2) == pytest.approx(5.0 + farthest, abs=3 * STEP)


@pytest.mark.parametrize(("indenter", "height"), CASES, ids=lambda v: getattr(v, "shape", ""))
def test_volume_is_the_integral_of_area(indenter, height):
    footprint = tool_footprint([indenter], HERE, 1e6)
    depths = np.linspace(0, 2.5, 20001)[1:]
    areas = [footprint.area_mm2(d) for d in depths]
    total = np.trapezoid(areas, depths) + areas[0] * depths[0] / 2
    assert footprint.volume_mm3(2.5) == pytest.approx(total, rel=2e-3)


def test_a_raised_shape_touches_later_and_the_pad_limits_the_area():
    low = made(shape="sphere", radius_mm=3.0)
    high = made(shape="flat_punch", radius_mm=2.0, raised_mm=0.4, x_mm=8.0)
    both = tool_footprint([low, high], HERE, 1e6)
    alone = tool_footprint([low], HERE, 1e6)
    assert both.area_mm2(0.4) == alone.area_mm2(0.4)
    assert both.area_mm2(0.5) == pytest.approx(alone.area_mm2(0.5) + 4 * math.pi)
    assert tool_footprint([low, high], HERE, 5.0).area_mm2(2.0) == pytest.approx(5.0)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_an_stl_file_is_read_as_by_trimesh(tmp_path, kind):
    mesh = trimesh.creation.box(extents=(3.0, 4.0, 5.0))
    (tmp_path / "box.stl").write_bytes(
        data if isinstance(data := mesh.export(file_type=kind), bytes) else data.encode()
    )
    corners = mesh_corners(tmp_path / "box.stl")
    expected = np.sort(mesh.triangles.reshape(-1, 9), axis=0)
    np.testing.assert_allclose(np.sort(corners.reshape(-1, 9), axis=0), expected, atol=1e-6)
    assert footprint_mm(tmp_path / "box.stl", "-z", 1.0) == pytest.approx((3.0, 4.0))
    assert footprint_mm(tmp_path / "box.stl", "x", 2.0) == pytest.approx((8.0, 10.0))


def punch(radius: float) -> Footprint:
    area = math.pi * radius**2
    return Footprint(
        lambda _d: area,
        lambda d: area * d,
        lambda _d: radius,
        lambda _d: math.inf,
        lambda _d: 2 * radius,
    )


def test_on_a_thick_gel_the_force_is_boussinesqs():
    t = contact_estimate(punch(1.0), 0.1, 1e4, 0.2, 0.3)
    assert t.normal_n == pytest.approx(1.1 * 2 * 0.2 / (1 - 0.09) * 1.0 * 0.1, rel=0.02)


def test_on_a_thin_compressible_layer_it_is_winklers_at_least():
    nu, e, h, a, d = 0.3, 0.2, 0.1, 5.0, 0.01
    confined = e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    t = contact_estimate(punch(a), d, h, e, nu)
    assert 1 <= t.normal_n / (confined * math.pi * a**2 * d / h) < 1.1


def test_the_squeezed_layer_agrees_with_a_solved_lubrication_equation():
    """p'' + p'/r = -3 G d / h^3 with p = 0 at the rim, by finite differences."""
    n, a, d, h, g = 4000, 30.0, 0.005, 0.02, 0.05
    r = (np.arange(n) + 0.5) * a / n
    dr = a / n
    out, into = (r + dr / 2) / (r * dr**2), (r - dr / 2) / (r * dr**2)
    matrix = sparse.diags_array([into[1:], -(into + out), out[:-1]], offsets=[-1, 0, 1]).tocsc()
    pressure = spsolve(matrix, np.full(n, -3 * g * d / h**3))
    expected = float((2 * np.pi * r * pressure * dr).sum())
    # A very thin, nearly incompressible layer: the squeeze is all.
    t = contact_estimate(punch(a), d, h, 3 * g, 0.5 - 1e-12)
    assert t.normal_n == pytest.approx(expected, rel=5e-3)
    assert t.stick_n == pytest.approx(4 * expected, rel=5e-3)


def solved(nu: float, height: np.ndarray, points: np.ndarray, op: Any, depth: float, stick: bool):
    """Force of a frictionless or fully sticking rigid indenter, by an active set."""
    candidates = np.flatnonzero(height < depth)
    axes = [0, 1, 2] if stick else [2]
    columns = []
    for node in candidates:
        for axis in axes:
            force = np.zeros((len(points), 3))
            force[node, axis] = 1
            columns.append(op.displacement(force)[candidates][:, axes].ravel())
    compliance, touching = np.array(columns).T, np.ones(len(candidates), dtype=bool)
    down = np.zeros((len(candidates), len(axes)))
    down[:, -1] = height[candidates] - depth
    while True:
        rows = np.flatnonzero(np.repeat(touching, len(axes)))
        force = np.zeros(down.size)
        force[rows] = np.linalg.solve(compliance[np.ix_(rows, rows)], down.ravel()[rows])
        pulled = force.reshape(down.shape)[:, -1] > 0
        if not pulled.any():
            return -float(force.reshape(down.shape)[:, -1].sum())
        touching &= ~pulled


@pytest.mark.parametrize("nu", [0.3223, 0.495])
def test_the_estimate_of_the_force_is_no_less_than_solved_contacts(nu):
    mesh, _ = build_pad_mesh(RoundedRectangle(16, 16, 0.5), 2.0, cells=(16, 16, 4))
    op = surface_operator(mesh, Material(0.147, nu, 1000.0), "bbar", "factor")
    points = mesh.nodes_mm[mesh.surface]
    r = np.hypot(points[:, 0], points[:, 1])
    for indenter, height, depth in (
        (made(shape="sphere", radius_mm=8.0), r * r / 16, 0.5),
        (made(shape="flat_punch", radius_mm=3.0), np.where(r <= 3, 0, 9.0), 0.3),
    ):
        t = contact_estimate(tool_footprint([indenter], HERE, 256.0), depth, 2.0, 0.147, nu)
        assert 0.97 < t.normal_n / solved(nu, height, points, op, depth, False) < 2
        assert 0.97 < t.stick_n / solved(nu, height, points, op, depth, True) < 2


def test_the_nonlinear_excess_is_the_measured_table_and_grows():
    for e, excess in ((0.05, 0.02), (0.15, 0.08), (0.30, 0.21), (0.50, 0.47)):
        assert nonlinear_excess(e) == pytest.approx(excess)
    values = [nonlinear_excess(e) for e in np.linspace(0, 1, 101)]
    assert (np.diff(values) > 0).all()


def test_no_contact_has_no_force():
    t = contact_estimate(punch(1.0), -0.1, 2.0, 0.147, 0.3223)
    assert (t.normal_n, t.stick_n, t.area_mm2, t.shear_n_per_mm) == (0, 0, 0, 0)


@pytest.mark.parametrize("kind", ["obj", "ply", "ply_ascii"])
def test_obj_and_ply_files_hold_the_same_facets(tmp_path, kind):
    mesh = trimesh.creation.icosphere(subdivisions=1, radius=3.0)
    path = tmp_path / f"ball.{kind[:3]}"
    data = mesh.export(file_type="ply", encoding="ascii") if kind == "ply_ascii" else mesh.export(
        file_type=kind
    )  # fmt: skip
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    np.testing.assert_allclose(mesh_corners(path), mesh.triangles, atol=1e-6)


def test_quads_of_an_obj_are_divided_and_its_objects_joined(tmp_path):
    path = tmp_path / "two.obj"
    path.write_text(
        "mtllib none.mtl\no first\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n"
        "o second\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 5 6 7\n"
    )
    corners = mesh_corners(path)
    assert corners.shape == (3, 3, 3)
    area = np.linalg.norm(np.cross(*np.diff(corners, axis=1).transpose(1, 0, 2)), axis=1) / 2
    assert area.sum() == pytest.approx(2.5)


@pytest.mark.parametrize("name", ["bad.obj", "bad.ply", "points.ply", "bad.stl"])
def test_damaged_meshes_are_refused(tmp_path, name):
    text = {
        "bad.obj": "v 0 0 0\nf 1 2 3\n",
        "bad.ply": "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n1 2\n",
        "points.ply": "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n1 2 3\n",
        "bad.stl": "solid a\nvertex 1 2\n",
    }
    (tmp_path / name).write_text(text[name])
    with pytest.raises(ValueError, match="no"):
        mesh_corners(tmp_path / name)
