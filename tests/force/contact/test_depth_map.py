"""Depth maps looked up at the nodes where the camera sees them."""

from __future__ import annotations

import numpy as np
import pytest
from shaded_frames import CAMERA, contact, pressed_heights

from gelslim_force.contact.depth_map import motion_from_grid, motion_from_image
from gelslim_optics.camera.height_field import HeightGrid

X, Y = np.meshgrid(np.arange(-6, 6.1, 0.5), np.arange(-5, 5.1, 0.5))
NODES = np.column_stack([X.ravel(), Y.ravel(), 0 * X.ravel()])


def test_image_registered_heights_are_those_of_the_surface():
    """The picture shows a point where it has sunk to: looked up there, not where it rested."""
    centre, radius = np.array([1.0, -2.0]), 2.5
    truth = contact(radius, 10.0)
    height = pressed_heights(centre, radius, 10.0)[2].reshape(480, 640)
    motion = motion_from_image(height, CAMERA, NODES, sigma_mm=0.01, touched_below_mm=-0.05)
    r = np.hypot(*(NODES[:, :2] - centre).T)
    exact = np.where(
        r < radius, 10 - np.sqrt(np.maximum(100 - r * r, 0)) - truth.depth_mm, -truth.sinking(r)
    )
    assert np.abs(motion.w_mm - exact).max() < 1e-3 * truth.depth_mm + 5e-4
    at_rest = CAMERA.project(NODES)
    i, j = np.rint(at_rest[:, 1]).astype(int), np.rint(at_rest[:, 0]).astype(int)
    naive = height[i, j]
    assert np.abs(naive - exact).max() > 5 * np.abs(motion.w_mm - exact).max()
    assert motion.depth_mm == pytest.approx(truth.depth_mm, rel=0.03)
    assert (motion.patch == (exact < -0.05)).mean() > 0.99
    assert motion.known
    assert np.isnan(motion.push_n)


def test_what_the_map_does_not_know_stays_unknown():
    height = np.zeros((480, 640))
    height[:240] = np.nan
    motion = motion_from_image(height, CAMERA, NODES)
    seen = CAMERA.project(NODES)[:, 1]
    assert np.isnan(motion.w_mm[seen < 239]).all()
    assert (motion.w_mm[seen > 241] == 0).all()
    assert np.isnan(motion.sigma_mm[seen < 239]).all()
    assert motion.depth_mm == 0
    nothing = motion_from_image(np.full((480, 640), np.nan), CAMERA, NODES)
    assert not nothing.known
    with pytest.raises(ValueError, match="register"):
        motion_from_image(np.zeros((240, 320)), CAMERA, NODES)
    with pytest.raises(ValueError, match="sigma_mm"):
        motion_from_image(np.zeros((480, 640)), CAMERA, NODES, sigma_mm=-1.0)


def test_height_grid_on_the_gel():
    x, y = np.linspace(-4, 4, 81), np.linspace(-6, 6, 121)
    grid = HeightGrid(x, y, -0.01 * (x[None, :] + 2 * y[:, None] + 20))
    motion = motion_from_grid(grid, NODES, touched_below_mm=-0.2)
    inside = np.abs(NODES[:, 0]) <= 4
    exact = -0.01 * (NODES[:, 0] + 2 * NODES[:, 1] + 20)
    np.testing.assert_allclose(motion.w_mm[inside], exact[inside], atol=1e-12)
    assert np.isnan(motion.w_mm[~inside]).all()
    assert (motion.patch == (inside & (exact < -0.2))).all()
    with pytest.raises(ValueError, match="points of shape"):
        motion_from_grid(grid, np.zeros(3))
