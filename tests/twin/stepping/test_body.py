"""Bodies: the side that faces the gel under every rotation, and meshes that are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from stepping_rig import Array, ball_facets, box_facets, turned, write_stl

from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.stepping.body import Body, turn_down
from gelslim_twin.stepping.rigid_motion import tool_pose
from gelslim_twin.stepping.step_error import StepError


def signed_depth(body: Body, motion: Array, points: Array) -> Array:
    """Distance of points above the body's surface along the axis of its tool."""
    side = body.side(motion[:3, :3])
    return -side.tool.clearance_mm(tool_pose(motion @ side.frame), points)


def motion_with(turn: Rotation) -> Array:
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn.as_matrix(), [0.3, -0.2, 1.0]
    return motion


def test_directions_of_the_grid_turn_straight_down() -> None:
    for axis in (0, 1, 2):
        for sign in (-1, 1):
            for first, second in ((0, 0), (5, 5), (-5, 3), (0, 2)):
                turn = turn_down((axis, sign, first, second))
                np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
                assert np.linalg.det(turn) == pytest.approx(1.0)
                assert (turn.T @ [0, 0, -1])[axis] * sign > 0.5


def test_the_rest_of_a_rotation_is_a_small_tilt() -> None:
    body = Body.box(4, 6, 8)
    for turn in Rotation.random(300, random_state=1):
        side = body.side(turn.as_matrix())
        pose = tool_pose(motion_with(turn) @ side.frame)
        assert np.hypot(pose.tilt_x_deg, pose.tilt_y_deg) < 7.0


def test_the_surface_of_a_turned_box_is_where_its_faces_are() -> None:
    """A point is on the surface where its largest overstep of the six faces is zero."""
    body, half = Body.box(4.0, 6.0, 8.0), np.array([2.0, 3.0, 4.0])
    rng = np.random.default_rng(2)
    for turn in Rotation.random(60, random_state=2):
        motion = motion_with(turn)
        points = motion[:3, 3] + np.column_stack([rng.uniform(-3, 3, (40, 2)), np.full(40, -9.0)])
        side = body.side(motion[:3, :3])
        pose = tool_pose(motion @ side.frame)
        above = side.tool.clearance_mm(pose, points)
        axis = (motion @ side.frame)[:3, 2]
        on = np.isfinite(above)
        met = points[on] + above[on, None] * axis
        own = (met - motion[:3, 3]) @ motion[:3, :3]
        assert on.any()
        # Beside an edge the margin of a rim, 0.01 mm, widens the outline.
        np.testing.assert_allclose((np.abs(own) - half).max(axis=1), 0.0, atol=0.02)


def test_a_ball_is_the_same_from_every_side() -> None:
    body, points = Body.sphere(3.0), np.array([[0.3, -0.2, -2.5], [1.0, 0.4, -2.0]])
    for turn in Rotation.random(40, random_state=3):
        motion = motion_with(turn)
        side = body.side(motion[:3, :3])
        above = side.tool.clearance_mm(tool_pose(motion @ side.frame), points)
        met = points + above[:, None] * (motion @ side.frame)[:3, 2]
        np.testing.assert_allclose(np.linalg.norm(met - motion[:3, 3], axis=1), 3.0, atol=1e-12)


def test_a_mesh_is_where_its_exact_form_is(tmp_path: Path) -> None:
    mesh = Body.from_mesh(write_stl(tmp_path / "box.stl", box_facets(4, 6, 8)))
    exact, rng = Body.box(4, 6, 8), np.random.default_rng(4)
    for turn in (turned("x", 0.0), turned("y", 90.0), turned("x", 33.0), turned("x", 180.0)):
        motion = motion_with(turn)
        points = motion[:3, 3] + np.column_stack([rng.uniform(-1, 1, (60, 2)), np.full(60, -9.0)])
        found, known = (signed_depth(body, motion, points) for body in (mesh, exact))
        np.testing.assert_allclose(found, known, atol=0.03)


def test_a_ball_of_facets_reaches_down_to_its_radius(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "ball.stl", ball_facets(3.0, rings=30))
    body = Body.from_mesh(path, scale=1.0, resolution_mm=0.1)
    for turn in Rotation.random(5, random_state=5):
        depth = signed_depth(body, motion_with(turn), np.array([[0.3, -0.2, -2.5]]))
        assert depth[0] == pytest.approx(-0.5, abs=0.02)


def test_a_mesh_with_a_hole_is_refused(tmp_path: Path) -> None:
    facets = box_facets(4, 6, 8)
    for number in range(len(facets)):
        path = write_stl(tmp_path / "open.stl", np.delete(facets, number, axis=0))
        with pytest.raises(StepError, match="3 edges"):
            Body.from_mesh(path)


def test_meshes_that_cannot_be_used(tmp_path: Path) -> None:
    inside_out = write_stl(tmp_path / "inside.stl", box_facets(4, 6, 8)[:, ::-1])
    with pytest.raises(StepError, match="inwards"):
        Body.from_mesh(inside_out)
    with pytest.raises(StepError, match="no such file"):
        Body.from_mesh(tmp_path / "none.stl")
    (tmp_path / "text.stl").write_text("not a mesh")
    with pytest.raises(StepError, match="no STL"):
        Body.from_mesh(tmp_path / "text.stl")
    good = write_stl(tmp_path / "good.stl", box_facets(4, 6, 8))
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(StepError):
            Body.from_mesh(good, scale=bad)
        with pytest.raises(StepError):
            Body.from_mesh(good, resolution_mm=bad)
    fine = Body.from_mesh(good, resolution_mm=0.001)
    with pytest.raises(StepError, match="body good"):
        fine.side(np.eye(3))


@pytest.mark.parametrize("bad", [0.0, -2.0, np.nan, np.inf])
def test_sizes_that_are_refused(bad: float) -> None:
    with pytest.raises(StepError):
        Body.sphere(bad)
    with pytest.raises(StepError):
        Body.box(1.0, bad, 1.0)


def test_indenters_are_known_from_below_only() -> None:
    body = Body.from_indenters(Sphere(shape="sphere", radius_mm=4.0))
    assert body.side(turned("x", 44.0).as_matrix()) is body.side(np.eye(3))
    with pytest.raises(StepError, match="46"):
        body.side(turned("x", 46.0).as_matrix())
    with pytest.raises(StepError):
        Body.from_indenters()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
def test_a_hundred_thousand_facets_are_where_the_torus_is(tmp_path: Path, kind: str) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = trimesh.creation.torus(10.0, 4.0, major_sections=250, minor_sections=200)
    assert len(mesh.faces) == 100_000
    mesh.export(tmp_path / f"torus.{kind}")
    body, rng = Body.from_mesh(tmp_path / f"torus.{kind}"), np.random.default_rng(6)
    angle, away = rng.uniform(0, 2 * np.pi, 200), rng.uniform(-2.5, 2.5, 200)
    places = np.column_stack(
        [(10 + away) * np.cos(angle), (10 + away) * np.sin(angle), np.full(200, -9.0)]
    )
    known = 9.0 - np.sqrt(16.0 - away**2)
    np.testing.assert_allclose(-signed_depth(body, np.eye(4), places), known, atol=5e-3)
