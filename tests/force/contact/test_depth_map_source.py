"""Depth maps looked up at the nodes where the camera sees them."""

from __future__ import annotations

import numpy as np
import pytest
from shaded_frames import CAMERA, contact, pressed_heights

from gelslim_force.contact.depth_map_source import (
    DepthMapError,
    DepthMapSource,
    read_depth_maps,
)

X, Y = np.meshgrid(np.arange(-6, 6.1, 0.5), np.arange(-5, 5.1, 0.4))
NODES = np.column_stack([X.ravel(), Y.ravel(), 0 * X.ravel()])
SHAPE = (480, 640)


def reading(height, **settings):
    source = DepthMapSource(CAMERA, NODES, [height], **settings)
    return source.motion(source.look(np.zeros(SHAPE, np.uint8), NODES[:, :2]))


def test_image_registered_heights_are_those_of_the_surface():
    """The picture shows a point where it has sunk to: looked up there, not where it rested."""
    centre, radius = np.array([1.0, -2.0]), 2.5
    truth = contact(radius, 10.0)
    height = pressed_heights(centre, radius, 10.0)[2].reshape(SHAPE)
    found = reading(height, sigma_mm=0.01, touched_below_mm=-0.05)
    r = np.hypot(*(NODES[:, :2] - centre).T)
    exact = np.where(
        r < radius, 10 - np.sqrt(np.maximum(100 - r * r, 0)) - truth.depth_mm, -truth.sinking(r)
    )
    assert np.abs(found.w_mm - exact).max() < 1e-3 * truth.depth_mm + 5e-4
    at_rest = CAMERA.project(NODES)
    i, j = np.rint(at_rest[:, 1]).astype(int), np.rint(at_rest[:, 0]).astype(int)
    assert np.abs(height[i, j] - exact).max() > 5 * np.abs(found.w_mm - exact).max()
    assert (found.touched == (exact < -0.05)).mean() > 0.99
    np.testing.assert_allclose(found.sigma_mm, np.minimum(0.01, np.abs(found.w_mm)))
    assert found.known


def test_nodes_without_a_height_take_the_nearest_one():
    columns = np.arange(640) * np.ones((480, 1))
    height = -1e-4 * columns
    height[:240] = np.nan
    found = reading(height, sigma_mm=0.02)
    known = found.sigma_mm > 0
    row = CAMERA.project(NODES)[:, 1]
    assert known[row > 250].all()
    assert not known[row < 239].any()
    apart = np.linalg.norm(NODES[~known, None] - NODES[None, known], axis=2)
    nearest = np.isclose(apart, apart.min(axis=1)[:, None])
    taken = np.isclose(found.w_mm[~known, None], found.w_mm[None, known])
    assert (nearest & taken).any(axis=1).all()
    assert found.touched is None


def test_maps_that_say_nothing():
    nothing = reading(np.full(SHAPE, np.nan))
    assert not nothing.known
    assert np.isnan(nothing.w_mm).all()
    source = DepthMapSource(CAMERA, NODES, [])
    assert source.look(np.zeros(SHAPE, np.uint8), NODES[:, :2]) is None
    assert not source.motion(None).known


def test_bad_maps_and_settings_are_refused(tmp_path):
    with pytest.raises(DepthMapError, match=r"\(240, 320\)"):
        reading(np.zeros((240, 320)))
    for bad in ({"sigma_mm": -1.0}, {"sigma_mm": np.inf}):
        with pytest.raises(DepthMapError, match="sigma_mm"):
            DepthMapSource(CAMERA, NODES, [], **bad)
    with pytest.raises(DepthMapError, match="points_mm"):
        DepthMapSource(CAMERA, np.zeros(3), [])
    file = tmp_path / "maps.npy"
    np.save(file, np.zeros((4, 6)))
    assert read_depth_maps(file).shape == (1, 4, 6)
    np.save(file, np.zeros((4, 6), dtype=int))
    with pytest.raises(DepthMapError, match="int"):
        read_depth_maps(file)
    with pytest.raises(DepthMapError, match="missing"):
        read_depth_maps(tmp_path / "missing.npy")
