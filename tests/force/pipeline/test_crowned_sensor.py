"""A sensor with a domed gel: markers rest at their own heights."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from camera_rig import off_centre_view
from synthetic import Look, grid_of_dots, render

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.design import marker_heights_mm
from gelslim_force.forces.estimator import ForceSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

CROWN_MM, RIM_MM = 0.6, 15.0


@cache
def bundle() -> Bundle:
    grid = grid_of_dots()
    mesh, _ = build_pad_mesh(
        RoundedRectangle(length_mm=22.0, width_mm=20.5, corner_radius_mm=1.0),
        2.0,
        cells=(22, 20, 3),
        crown=Paraboloid(CROWN_MM, RIM_MM),
        weighting="volume_fraction",
    )
    return build_bundle(
        mesh,
        Material(0.147, 0.3223, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=off_centre_view().to_record(),
        with_stiffness=False,
    )


def heights() -> np.ndarray:
    places = grid_of_dots().positions_mm
    return -CROWN_MM * (places**2).sum(axis=1) / RIM_MM**2


def seen(motion: np.ndarray | None = None, seed: int = 1) -> np.ndarray:
    at = np.column_stack([np.zeros((len(heights()), 2)), heights()])
    moved = at if motion is None else at + motion
    return render(grid_of_dots(), off_centre_view(), Look(noise=1.0, seed=seed), moved).image


def test_heights_are_those_of_the_crown() -> None:
    assert np.ptp(heights()) > 0.3
    assert marker_heights_mm(bundle()) == pytest.approx(heights(), abs=0.01)


def test_calibration_finds_no_fault_in_a_domed_gel() -> None:
    found = calibrate(bundle(), seen())
    off = found.rest_mm - grid_of_dots().positions_mm[found.markers]
    assert np.sqrt((off**2).mean()) < 0.003
    assert found.deviation.noise_px < 0.1


def test_forces_of_a_press_on_the_dome() -> None:
    sensor = bundle()
    points = np.asarray(sensor.mesh.surface_mm)
    away = np.hypot(points[:, 0] - 2.0, points[:, 1] + 1.0)
    shape = np.sqrt(np.maximum(1 - (away / 3.0) ** 2, 0.0))
    force = (shape / shape.sum())[:, None] * np.array([0.2, -0.1, -0.8])
    u = sensor.surface_operator("factor").displacement(force)
    at = np.column_stack([grid_of_dots().positions_mm, heights()])
    calibration = calibrate(sensor, seen())
    settings = PipelineSettings(rung="factor", force=ForceSettings(method="direct"))
    chain = ForcePipeline(sensor, calibration, settings)
    result = chain.process(seen(marker_to_node(points, at) @ u, seed=2), normal_mm=u[:, 2])
    assert result.wrench.force_n == pytest.approx([0.2, -0.1, -0.8], abs=0.02)
    assert np.isfinite(result.field.traction_mpa).all()
