"""A rod lying across the finger: who touches, what it weighs, how little light shows of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from render_rig import AXIS_X, AXIS_Y, CAMERA, light
from sim_rig import small_sensor

from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Sight
from gelslim_twin.scene.indenter import Cylinder
from gelslim_twin.scene.pose import Pose
from gelslim_twin.validation.experiment import TruthGel
from ifem_export.bundle.files import load_bundle


def test_rod_across_touches_a_line_across_and_is_pulled_along(tmp_path: Path) -> None:
    bundle = load_bundle(small_sensor(tmp_path))
    rod = Cylinder(shape="cylinder", radius_mm=3, length_mm=40, axis_deg=90)
    poses = (Pose(0, 0, 0, 0), Pose(1, 0, 0, 0.2), Pose(2, 0.1, 0, 0.2))
    pressed, sheared = TruthGel(bundle, 0.8).states(rod, poses, "linear")[1:]
    points = np.asarray(bundle.mesh.surface_mm)
    touched = points[pressed.touch > 0]
    # From rim to rim across, and no farther along than the rod cuts the plane z = 0.
    assert np.ptp(touched[:, 1]) == pytest.approx(np.ptp(points[:, 1]))
    assert np.abs(touched[:, 0]).max() < np.sqrt(2 * 3 * 0.2) + 0.01
    total = pressed.force_n.sum(axis=0)
    assert np.abs(total[:2]).max() < 1e-3 * abs(total[2])
    assert abs((points[:, 0] * pressed.force_n[:, 2]).sum()) < 1e-3 * abs(total[2])
    along = sheared.force_n.sum(axis=0)
    assert along[0] > 0.05 * abs(along[2])
    assert abs(along[1]) < 1e-2 * along[0]


def test_light_from_the_sides_shows_a_rod_along_and_hardly_one_across() -> None:
    x, y = np.meshgrid(AXIS_X, AXIS_Y)
    spread = {}
    for name, off in (("along", y), ("across", x)):
        u = np.zeros((*x.shape, 3))
        u[..., 2] = -0.3 * np.exp(-((off / 1.5) ** 2))
        shading = Shading(relief=False)
        gain = shading.gain(
            Sight.of(CAMERA, shading.pixel_step), SurfaceState(AXIS_X, AXIS_Y, u), light()
        )
        spread[name] = float(np.abs(gain - 1).max())
    steepest = 0.3 / 1.5 * np.sqrt(2) * np.exp(-0.5)
    # A flank towards the light gains slope x cot(25°); one across loses the cosine of its slope.
    assert spread["along"] == pytest.approx(steepest / np.tan(np.radians(25)), rel=0.08)
    assert spread["across"] == pytest.approx(1 - 1 / np.sqrt(1 + steepest**2), rel=0.08)
    assert spread["across"] < 0.06 * spread["along"]
