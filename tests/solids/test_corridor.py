"""The camera's view is free of parts, and the check notices when it is not."""

from __future__ import annotations

import cadquery as cq
import numpy as np
import pytest
from finger_samples import each_finger, finger, parts_of

from gelslim_cad.build.solid_checks import blocked_volumes, view_corridor
from gelslim_cad.geometry.optics import corner_rays
from gelslim_cad.geometry.part import Part


def obstacle(solid: cq.Shape) -> Part:
    return Part(name="obstacle", solid=solid, material="", process="print", colour=(0, 0, 0, 1))


@each_finger
def test_nothing_stands_in_the_view(name: str) -> None:
    assert blocked_volumes(finger(name), parts_of(name)) == {}


@each_finger
def test_corner_rays_meet_the_mirror_within_its_border(name: str) -> None:
    d = finger(name)
    _, mirror, window = corner_rays(d)
    low = np.array([d["mirror.lower_x_mm"], d["mirror.lower_z_mm"]])
    high = np.array([d["mirror.upper_x_mm"], d["mirror.upper_z_mm"]])
    along = (mirror[:, [0, 2]] - low) @ (high - low) / d["mirror.length_mm"]
    border = d["design.mirror.border_mm"]
    assert along.min() >= border - 1e-6
    assert along.max() <= d["mirror.length_mm"] - border + 1e-6
    assert np.abs(mirror[:, 1]).max() <= d["mirror.width_mm"] / 2 - border + 1e-6
    np.testing.assert_allclose(window[:, 2], d["stack.window_bottom_z_mm"])


@each_finger
def test_the_pyramid_has_the_volume_of_its_corners(name: str) -> None:
    d = finger(name)
    pyramid, _ = view_corridor(d)
    _, m, _ = corner_rays(d)
    tip = np.array([d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]])
    volume = sum(abs(np.linalg.det(np.array([m[0], m[k], m[k + 1]]) - tip)) / 6 for k in (1, 2))
    assert pyramid.isValid()
    # Drawn in by 0.02 mm at the mirror.
    assert pyramid.Volume() == pytest.approx(volume, rel=0.02)
    assert pyramid.Volume() < volume


def test_an_obstacle_in_either_half_of_the_view_is_noticed() -> None:
    d = finger("mini20")
    _, mirror, window = corner_rays(d)
    pinhole = np.array([d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]])
    edge = 0.2
    for place in ((pinhole + mirror.mean(axis=0)) / 2, (mirror + window).mean(axis=0) / 2):
        cube = cq.Solid.makeBox(edge, edge, edge, cq.Vector(*(place - edge / 2)))
        taken = blocked_volumes(d, [obstacle(cube)])
        assert taken["obstacle"] >= edge**3 * (1 - 1e-6), place


def test_an_obstacle_beside_the_view_is_no_obstacle() -> None:
    d = finger("mini20")
    y = d["baffle.inner_y_mm"]
    z = d["stack.window_bottom_z_mm"] - 2
    cube = cq.Solid.makeBox(1, 1, 1, cq.Vector(0, y, z - 0.5))
    assert blocked_volumes(d, [obstacle(cube)]) == {}


def test_a_ledge_grown_into_the_view_is_noticed() -> None:
    d = finger("mini20")
    _, _, window = corner_rays(d)
    low = d["stack.window_bottom_z_mm"] - 1
    ledge = cq.Solid.makeBox(5, 10, 1, cq.Vector(window[:, 0].min() - 4, -5, low))
    assert set(blocked_volumes(d, [obstacle(ledge)])) == {"obstacle"}
