"""The camera fitted to dots with known truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from camera_rig import finger_view
from synthetic import centroids, grid_of_dots, outlines

from gelslim_force.calibration.camera_deviation import PARAMETERS, CameraTolerance, deviated_camera
from gelslim_force.calibration.fit import centroid_offset_px, fit_camera
from ifem_export.markers.grid import build_marker_grid

DESIGN = finger_view()
GRID = grid_of_dots()
FLAT = np.column_stack([GRID.positions_mm, np.zeros(len(GRID))])
SIGMA = CameraTolerance().sigma(DESIGN)


def _seen(camera, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    centre = camera.project(FLAT) + centroid_offset_px(camera, GRID.positions_mm, GRID.diameter_mm)
    return centre + rng.normal(size=centre.shape) * noise


def _fit(seen, design=DESIGN, tolerance=None):
    return fit_camera(design, GRID.positions_mm, GRID.diameter_mm, seen, tolerance)


def test_centroid_offset_is_that_of_a_finely_drawn_rim():
    centre, _ = centroids(outlines(GRID, DESIGN))
    offset = centre - DESIGN.project(FLAT)
    assert 0.005 < np.abs(offset).max() < 0.1
    mine = centroid_offset_px(DESIGN, GRID.positions_mm, GRID.diameter_mm)
    np.testing.assert_allclose(mine, offset, atol=0.01 * np.abs(offset).max())


def test_offset_left_out_would_bias_the_camera():
    seen = _seen(DESIGN)
    assert np.abs(_fit(seen).values / SIGMA).max() < 1e-4
    bare = fit_camera(DESIGN, GRID.positions_mm, np.full(len(GRID), 1e-6), seen)
    back = bare.camera.backproject(DESIGN.project(FLAT))[:, :2] - GRID.positions_mm
    assert np.hypot(*back.T).max() > 2e-4


def test_exact_dots_give_the_exact_camera():
    values = np.array([0.8, -1.0, 1.2, 0.2, -0.2, 0.15, 2.0, -0.05, 0.01, 0.002, -0.002, 1.0, -0.8])
    fit = _fit(_seen(deviated_camera(DESIGN, values)))
    assert np.abs(fit.residual_px).max() < 2e-3
    back = fit.camera.backproject(deviated_camera(DESIGN, values).project(FLAT))[:, :2]
    assert np.hypot(*(back - GRID.positions_mm).T).max() < 5e-5
    np.testing.assert_allclose(fit.values[:3], values[:3], atol=0.02)
    assert fit.used.all()


@pytest.mark.slow
def test_covariance_agrees_with_the_scatter():
    rng = np.random.default_rng(4)
    distance, pulls, noise = [], [], []
    for k in range(30):
        truth = rng.normal(size=len(SIGMA)) * SIGMA
        fit = _fit(_seen(deviated_camera(DESIGN, truth), noise=0.15, seed=k))
        error = fit.values - truth
        distance.append(error @ np.linalg.solve(fit.covariance, error))
        pulls.append(error / fit.sigma)
        noise.append(fit.noise_px)
    # Squared distances are chi-square with 13 degrees of freedom: mean 13, sd of 30's mean 0.93.
    assert 10.2 < np.mean(distance) < 15.8
    assert np.all(np.std(pulls, axis=0) > 0.7)
    assert np.all(np.std(pulls, axis=0) < 1.4)
    assert np.mean(noise) == pytest.approx(0.15, rel=0.02)


def test_stray_dots_are_set_aside():
    truth = deviated_camera(DESIGN, 0.7 * SIGMA)
    seen = _seen(truth, noise=0.1)
    stray = np.random.default_rng(2).choice(len(GRID), 20, replace=False)
    seen[stray] += [4.0, -3.0]
    fit = _fit(seen)
    assert not fit.used[stray].any()
    assert fit.used.sum() > len(GRID) - 26
    back = fit.camera.backproject(truth.project(FLAT))[:, :2] - GRID.positions_mm
    assert np.sqrt((back**2).sum(axis=1).mean()) < 2e-3


def test_principal_point_off_the_middle_is_found():
    off = np.array([9.0, -7.0])
    fit = _fit(_seen(DESIGN) + off)
    assert np.sqrt((fit.residual_px**2).mean()) < 1e-3
    back = fit.camera.backproject(DESIGN.project(FLAT) + off)[:, :2] - GRID.positions_mm
    assert np.hypot(*back.T).max() < 2e-4
    np.testing.assert_allclose(fit.values[-2:], off, atol=1.5)


def test_a_picture_of_little_names_what_it_cannot_tell():
    few = build_marker_grid(4, 4, 1.1, 0.45, anchors="none")
    flat = np.column_stack([few.positions_mm, np.zeros(16)])
    seen = DESIGN.project(flat) + np.random.default_rng(1).normal(size=(16, 2)) * 0.1
    fit = fit_camera(DESIGN, few.positions_mm, few.diameter_mm, seen)
    assert len(fit.weak_directions) >= 4
    for left, direction in fit.weak_directions:
        assert 0.5 < left <= 1.0
        assert np.linalg.norm(direction) == pytest.approx(1.0)
        along = direction * SIGMA
        informed = along @ fit.information @ along
        assert informed == pytest.approx(1 / left - 1, abs=1e-6)
    assert np.all(fit.sigma <= SIGMA * 1.000001)
    # A whole print leaves one thing open: tilt about y against the lens' offset along the finger.
    (_, direction), *more = _fit(_seen(DESIGN, noise=0.1)).weak_directions
    assert not more
    strongest = {PARAMETERS[k] for k in np.argsort(-np.abs(direction))[:4]}
    assert "principal_y_px" in strongest


@pytest.mark.parametrize("model", ["brown", "kannala_brandt"])
def test_lens_of_the_design_is_kept_and_changed(model):
    lens = DESIGN.to_record() | {
        "lens_distortion": {
            "k1": -0.1,
            "k2": 0.02,
            "p1": 0.0,
            "p2": 0.0,
            "k3": 0.001,
            "model": model,
        }
    }
    design = type(DESIGN).from_record(lens)
    change = np.zeros(len(PARAMETERS))
    assert deviated_camera(design, change).lens == design.lens
    change[PARAMETERS.index("k1")] = 0.03
    fit = _fit(_seen(deviated_camera(design, change)), design)
    assert fit.camera.lens.k1 == pytest.approx(-0.07, abs=0.003)
    assert fit.camera.lens.k3 == 0.001
    assert fit.camera.lens.model == model


def test_impossible_input_is_refused():
    seen = _seen(DESIGN)
    with pytest.raises(ValueError, match="points"):
        fit_camera(DESIGN, GRID.positions_mm, GRID.diameter_mm, seen[:-1])
    seen[3] = np.nan
    with pytest.raises(ValueError, match="finite"):
        _fit(seen)
    with pytest.raises(ValueError, match="12"):
        fit_camera(DESIGN, GRID.positions_mm[:9], GRID.diameter_mm[:9], seen[4:13])
    with pytest.raises(ValueError, match="k1"):
        CameraTolerance(k1=0.0)
    with pytest.raises(ValueError, match="shape"):
        deviated_camera(DESIGN, np.zeros(3))


def test_tolerance_is_in_the_order_of_the_parameters():
    one = dataclasses.replace(CameraTolerance(), height_mm=9.0, focal_percent=7.0)
    assert one.sigma(DESIGN)[PARAMETERS.index("shift_z_mm")] == 9.0
    assert one.sigma(DESIGN)[PARAMETERS.index("focal_percent")] == 7.0
    assert len(one.sigma(DESIGN)) == len(PARAMETERS)
