"""Tools at poses: heights by brute force along the vertical, slopes, carried points."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sampled import quick
from tool_height import tool_height_mm

from gelslim_twin.scene.indenter import (
    Cone,
    Cylinder,
    FlatPunch,
    Indenter,
    Ring,
    Sphere,
    TexturedPlane,
    Wedge,
)
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.rotation import rotation
from gelslim_twin.tools.tool import Tool, ToolSurface

Array = NDArray[np.float64]
SHAPES: dict[str, Indenter] = {
    "sphere": Sphere(shape="sphere", radius_mm=3),
    "cylinder": Cylinder(shape="cylinder", radius_mm=2, length_mm=6, axis_deg=20),
    "wedge": Wedge(shape="wedge", included_angle_deg=60, length_mm=8, tip_radius_mm=0.2),
    "cone": Cone(shape="cone", included_angle_deg=70, tip_radius_mm=0.1),
    "punch": FlatPunch(shape="flat_punch", length_mm=4, width_mm=3),
    "ring": Ring(shape="ring", outer_radius_mm=4, inner_radius_mm=2),
    "ridges": TexturedPlane(
        shape="textured_plane", length_mm=6, width_mm=6, pitch_mm=1.5, relief_mm=0.2
    ),
    "rough": TexturedPlane(
        shape="textured_plane", length_mm=6, width_mm=6, texture="rough", pitch_mm=2, relief_mm=0.2
    ),
}


def grid(half: float = 3.0, count: int = 15) -> Array:
    axis = np.linspace(-half, half, count) + 0.013
    return np.stack([g.ravel() for g in np.meshgrid(axis, axis)], axis=1)


def first_inside(tool: Tool, pose: Pose, x: float, y: float) -> float:
    """Lowest point of the vertical over (x, y) that is inside, to 0.2 µm; inf above 1 mm."""
    low, high, origin = -3.0, 1.0, np.array([pose.x_mm, pose.y_mm, -pose.depth_mm])
    for _ in range(2):
        z = np.linspace(low, high, 4001)
        own = (np.column_stack([np.full_like(z, x), np.full_like(z, y), z]) - origin) @ rotation(
            pose
        )
        inside = own[:, 2] >= tool.local(own[:, 0], own[:, 1])
        if not inside.any():
            return math.inf
        k = int(inside.argmax())
        low, high = z[max(k - 1, 0)], z[k]
    return float(high)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("tilt", quick([0.0, 4.0, 25.0], lambda tilt: tilt != 4.0))
def test_height_by_brute_force(name: str, tilt: float) -> None:
    tool = Tool.of([SHAPES[name]], Path())
    pose = Pose(
        x_mm=0.2, y_mm=-0.3, depth_mm=0.4, twist_deg=15, tilt_x_deg=tilt, tilt_y_deg=-tilt / 2
    )
    points = grid(count=13)
    found = tool_height_mm(tool, pose, points[:, 0], points[:, 1])
    true = np.array([first_inside(tool, pose, *p) for p in points])
    both = np.isfinite(found) & np.isfinite(true)
    np.testing.assert_allclose(found[both], true[both], atol=2e-6)
    assert both.sum() > 10
    # What one of them does not see is a wall or lies high above the gel.
    once = np.isfinite(found) & (found < 0.99) & ~np.isfinite(true)
    assert not once.any()
    walls = ~np.isfinite(found) & np.isfinite(true) & (true < 0.99)
    assert tilt > 0 or not walls.any()
    assert tilt > 10 or walls.sum() < 0.1 * both.sum()


def test_a_tilted_sphere_is_a_sphere() -> None:
    tool = Tool.of([SHAPES["sphere"]], Path())
    pose = Pose(depth_mm=0.4, twist_deg=70, tilt_x_deg=30, tilt_y_deg=-20)
    points = grid(1.5)
    centre = np.array([0, 0, -0.4]) + rotation(pose) @ [0, 0, 3.0]
    away = ((points - centre[:2]) ** 2).sum(axis=1)
    true = centre[2] - np.sqrt(np.maximum(9 - away, 0.0))
    low = (true < 0.99) & (away < 8.9)
    assert low.sum() > 100
    np.testing.assert_allclose(tool_height_mm(tool, pose, *points[low].T), true[low], atol=1e-8)


def test_tilted_plane_and_its_slope() -> None:
    tool = Tool.of([FlatPunch(shape="flat_punch", radius_mm=20)], Path())
    pose = Pose(x_mm=1.0, y_mm=2.0, depth_mm=0.3, twist_deg=33, tilt_x_deg=3, tilt_y_deg=-5)
    normal = rotation(pose)[:, 2]
    points = grid(2.0)
    plane = -0.3 - ((points - [1.0, 2.0]) @ normal[:2]) / normal[2]
    surface = tool.surface(pose, np.column_stack([points, np.zeros(len(points))]))
    np.testing.assert_allclose(surface.normal, np.tile(normal, (len(points), 1)), atol=1e-9)
    np.testing.assert_allclose(surface.gap_mm(np.column_stack([points, plane])), 0.0, atol=1e-9)
    frames = surface.frames
    assert frames is not None
    np.testing.assert_allclose(frames[:, :, 2], np.tile(normal, (len(points), 1)), atol=1e-4)
    np.testing.assert_allclose(
        frames.transpose(0, 2, 1) @ frames, np.tile(np.eye(3), (len(points), 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    above = np.column_stack([points, plane]) - 0.1 * normal
    np.testing.assert_allclose(surface.gap_mm(above), 0.1, atol=1e-4)


def test_level_faces_have_no_frames_and_rims_no_wild_slopes() -> None:
    tool = Tool.of([FlatPunch(shape="flat_punch", radius_mm=2)], Path())
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [-1.99999, 0.0, 0.0], [3.0, 0.0, 0.0]])
    surface = tool.surface(Pose(depth_mm=0.1), points)
    assert surface.frames is None
    assert list(surface.is_met) == [True, True, True, False]
    later = tool.surface(Pose(depth_mm=0.1), points + np.array([0.5, 0, 0]), surface)
    np.testing.assert_allclose(later.gap_mm(points)[:3], -0.1)
    assert later.gap_mm(points)[3] == math.inf


def test_a_rim_is_not_decided_by_rounding() -> None:
    """Nodes that stick at a rim stay on the tool, whichever way rounding moves them."""
    for shape in (FlatPunch(shape="flat_punch", length_mm=8, width_mm=6),
                  FlatPunch(shape="flat_punch", radius_mm=4)):  # fmt: skip
        tool = Tool.of([shape], Path())
        x = np.array([4 - 1e-6, 4.0, 4 + 1e-6, 4.1])
        assert list(np.isfinite(tool.local(x, np.zeros(4)))) == [True, True, True, False]


@pytest.mark.parametrize("name", ["sphere", "cone", "wedge", "punch", "rough"])
@pytest.mark.parametrize("tilt", [0.0, 6.0])
def test_planes_are_those_of_the_tool_along_the_vertical(name: str, tilt: float) -> None:
    """A point on the tool, found along the vertical, lies on its plane; planes face the gel."""
    tool = Tool.of([SHAPES[name]], Path())
    pose = Pose(x_mm=0.2, y_mm=-0.3, depth_mm=0.4, twist_deg=15, tilt_x_deg=tilt)
    points = grid(1.2)
    height = tool_height_mm(tool, pose, points[:, 0], points[:, 1])
    on = np.isfinite(height) & (height < 0.9)
    assert on.sum() > 50
    met = np.column_stack([points, height])[on]
    surface = tool.surface(pose, met)
    np.testing.assert_allclose(surface.gap_mm(met), 0.0, atol=1e-8)
    np.testing.assert_allclose(tool.clearance_mm(pose, met), 0.0, atol=1e-8)
    assert (surface.normal[:, 2] > 0).all()
    # A short step along the plane leaves the tool by no more than its curvature.
    frames = surface.frames
    if frames is None:
        return
    near = met + 1e-3 * frames[:, :, 0]
    flat = np.abs(tool.clearance_mm(pose, near)) < 3e-5
    assert flat.mean() > 0.9


def test_normals_are_turned_by_a_share_of_the_way() -> None:
    points = np.zeros((3, 3))
    old = ToolSurface(points, np.tile([0.6, 0.0, 0.8], (3, 1)))
    new = ToolSurface(points + 1.0, np.tile([0.0, 0.28, 0.96], (3, 1)))
    turned = new.turned(old, np.array([0.0, 0.25, 1.0]))
    mixed = 0.75 * old.normal[1] + 0.25 * new.normal[1]
    expected = [old.normal[0], mixed / np.sqrt(mixed @ mixed), new.normal[2]]
    np.testing.assert_allclose(turned.normal, expected, atol=1e-15)
    np.testing.assert_array_equal(turned.met_mm, new.met_mm)
    kept = new.only(np.array([True, False, True]))
    assert list(kept.is_met) == [True, False, True]
    np.testing.assert_array_equal(kept.at(np.array([2, 0])).met_mm, np.ones((2, 3)))


def test_the_lowest_of_several_shapes_counts() -> None:
    """Each about its own place and raised by its own height."""
    tool = Tool.of(
        [Sphere(shape="sphere", radius_mm=3, x_mm=1.0, y_mm=-0.5, raised_mm=0.3),
         FlatPunch(shape="flat_punch", radius_mm=1, x_mm=2.0, raised_mm=0.4)], Path(),
    )  # fmt: skip
    x, y = np.array([1.0, 1.4, 2.0, 3.6]), np.array([-0.5, -0.2, 0.5, 0.0])
    ball = 0.3 + 3 - np.sqrt(9 - (x - 1.0) ** 2 - (y + 0.5) ** 2)
    punch = np.where(np.hypot(x - 2.0, y) <= 1, 0.4, np.inf)
    np.testing.assert_allclose(tool.local(x, y), np.minimum(ball, punch), atol=1e-12)
    assert list(punch < ball) == [False, False, True, False]


def test_carried_points_keep_their_place_on_the_tool() -> None:
    tool = Tool.of([SHAPES["cone"]], Path())
    before = Pose(x_mm=1, depth_mm=0.2, twist_deg=20, tilt_x_deg=5)
    after = Pose(x_mm=-1, y_mm=2, depth_mm=0.5, twist_deg=-50, tilt_y_deg=8)
    points = np.random.default_rng(0).standard_normal((6, 3))
    moved = tool.carried(before, after, points)
    own = [
        (p - [q.x_mm, q.y_mm, -q.depth_mm]) @ rotation(q)
        for p, q in ((points, before), (moved, after))
    ]
    np.testing.assert_allclose(own[0], own[1], atol=1e-12)
    np.testing.assert_allclose(tool.carried(after, before, moved), points, atol=1e-12)
