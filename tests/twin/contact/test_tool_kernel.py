"""Compiled geometry of the tool against the same formulas written with arrays."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_twin.tools.profile_kernel import arc_heights, convex_heights
from gelslim_twin.tools.tool_kernel import (
    MOST_SLOPE,
    carried_points,
    central_slope,
    gaps_to_planes,
    node_frames,
)


def test_a_slope_at_a_rim_and_at_a_wall() -> None:
    """Heights behind, here and ahead, 1e-4 mm apart."""
    cases = (
        ((0.0, 1e-5, 4e-5), 0.2),
        ((np.inf, 1e-5, 4e-5), 0.3),
        ((0.0, 1e-5, np.inf), 0.1),
        ((np.inf, 1e-5, np.inf), 0.0),
        ((0.0, 1e-5, 1.0), 0.1),
        ((-1.0, 1e-5, 4e-5), 0.3),
        ((0.0, 0.005, 0.01), MOST_SLOPE),
        ((1.0, 1.0 + 1e-16, 1.0 + 2e-14), 0.0),
    )
    for heights, slope in cases:
        assert central_slope(*heights) == pytest.approx(slope, abs=1e-9)


def test_points_carried_by_a_motion_and_their_gaps_to_planes() -> None:
    rng = np.random.default_rng(6)
    points, met, normal = rng.normal(size=(3, 30, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    start, end = rng.normal(size=(2, 3))
    moved, gap = np.empty((30, 3)), np.empty(30)
    carried_points(points, start, turn, end, moved)
    np.testing.assert_allclose(moved, (points - start) @ turn.T + end, atol=1e-14)
    met[3, 2], normal[3, 2] = np.inf, 1.0
    gaps_to_planes(met, normal, points, gap)
    np.testing.assert_allclose(gap, ((met - points) * normal).sum(axis=1), atol=1e-14)


def test_frames_are_rotations_with_the_normal_last() -> None:
    normal = np.random.default_rng(5).normal(size=(40, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    frames = np.empty((40, 3, 3))
    node_frames(normal, frames)
    np.testing.assert_array_equal(frames[:, :, 2], normal)
    np.testing.assert_allclose(
        frames.transpose(0, 2, 1) @ frames, np.tile(np.eye(3), (40, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=1e-14)
    assert not frames[:, 1, 0].any()


def test_the_lower_side_of_a_turned_cube_by_brute_force() -> None:
    """Along each vertical the first of many heights that is inside all half-spaces."""
    rng = np.random.default_rng(8)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    normals, reach = np.concatenate([turn.T, -turn.T]), np.ones(6)
    x, y = rng.uniform(-2, 2, (2, 300))
    found = np.empty(300)
    convex_heights(normals, reach, 0.0, x, y, found)
    heights = np.linspace(-2, 2, 4001)
    missed = 0
    for place, height in zip(zip(x, y, strict=True), found, strict=True):
        column = np.column_stack([np.full((len(heights), 2), place), heights])
        inside = (column @ normals.T <= reach).all(axis=1)
        if inside.any():
            assert abs(heights[inside.argmax()] - height) < 1.1e-3
        else:
            # A chord shorter than the steps may be missed.
            missed += np.isfinite(height)
    assert missed <= 2
    assert 50 < np.isfinite(found).sum() < 250


def test_a_circle_keeps_its_digits_near_the_pole() -> None:
    reach, height = np.array([1e-9, 0.3, 5.0, 5.0 + 1e-9]), np.empty(4)
    arc_heights(5.0, reach, height)
    np.testing.assert_allclose(height[:3], [1e-19, 5 - np.sqrt(25 - 0.09), 5.0], rtol=1e-12)
    assert height[3] == np.inf
