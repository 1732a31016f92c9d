"""Calibration of drawn sensors with known truth, and what it must refuse."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest
from calibration_samples import BUILD, seen_by, small_bundle
from camera_rig import finger_view
from synthetic import Look, grid_of_dots, render

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.camera_deviation import PARAMETERS, deviated_camera
from gelslim_force.calibration.error import CalibrationError
from ifem_export.errors import IfemError
from ifem_export.markers.grid import build_marker_grid

GRID = grid_of_dots()
BUNDLE = small_bundle(GRID)
FLAT = np.column_stack([GRID.positions_mm, np.zeros(len(GRID))])


def _map_error_mm(calibration, camera):
    back = calibration.camera.backproject(camera.project(FLAT))[:, :2]
    return back - GRID.positions_mm


def test_clean_frame_gives_the_camera_to_a_hundredth_of_a_pixel():
    camera = deviated_camera(finger_view(), BUILD)
    found = calibrate(BUNDLE, render(GRID, camera).image)
    assert len(found) == len(GRID)
    assert not found.warnings
    off = found.camera.project(FLAT) - camera.project(FLAT)
    assert np.sqrt((off**2).mean()) < 0.01
    assert np.hypot(*_map_error_mm(found, camera).T).max() < 1e-3
    # The built camera is about 10 px off: without calibration nothing would fit.
    assert found.deviation.moved_px > 5
    assert found.deviation.rotation_deg == pytest.approx(np.linalg.norm(BUILD[:3]), abs=0.1)


@pytest.mark.parametrize("seed", [1, *(pytest.param(s, marks=pytest.mark.slow) for s in (2, 3))])
def test_print_errors_noise_and_missing_dots(seed):
    rng = np.random.default_rng(seed)
    camera = deviated_camera(finger_view(), rng.uniform(-1, 1, len(BUILD)) * np.abs(BUILD))
    jitter = rng.normal(size=(len(GRID), 2)) * 0.010
    look = Look(noise=6, missing=0.04, dirt=5, specular=2, seed=seed)
    frame = render(GRID, camera, look, moved_mm=jitter)
    found = calibrate(BUNDLE, frame.image)
    d = found.deviation
    error = _map_error_mm(found, camera)[found.markers]
    assert np.sqrt((error**2).mean()) < 2.5 * d.map_sigma_mm
    assert np.hypot(*error.T).max() < 0.010
    assert d.map_sigma_mm < 0.002
    assert d.own_mm == pytest.approx(0.010, rel=0.2)
    pulls = (d.values - _deviation_of(camera)) / d.sigma
    assert np.abs(pulls).max() < 3.5
    # The rest places hold the print's own errors: that is what motions are measured from.
    rest = found.rest_mm - (GRID.positions_mm + jitter)[found.markers]
    # Dirt that touches a few dots shifts them by up to 0.05 mm.
    assert np.sqrt((rest**2).mean()) < 0.0035
    assert np.quantile(np.hypot(*rest.T), 0.98) < 0.006
    drawn = np.flatnonzero(frame.drawn)
    assert np.isin(found.markers, drawn).all()
    places = frame.centres_px[drawn]
    whole = np.all((places > 8) & (places < [631, 471]), axis=1)
    assert np.isin(drawn[whole], found.markers).mean() >= 0.99
    assert set(np.flatnonzero(~frame.drawn)) <= set(found.missing)


def _deviation_of(camera):
    """The true values, from the camera itself."""
    from scipy.spatial.transform import Rotation

    design = finger_view()
    turn = Rotation.from_matrix((design.axes.T @ camera.axes).T).as_rotvec(degrees=True)
    lens = camera.lens
    focal = 100 * (camera.focal_px / design.focal_px - 1)
    shift = camera.position_mm - design.position_mm
    bent = (lens.k1, lens.k2, lens.p1, lens.p2)
    offset = np.subtract(camera.principal_offset_px, design.principal_offset_px)
    return np.array([*turn, *shift, focal, *bent, *offset])


def test_truth_of_these_tests():
    np.testing.assert_allclose(
        _deviation_of(deviated_camera(finger_view(), BUILD)), BUILD, atol=1e-9
    )


def test_frames_without_colour_and_prints_without_anchors():
    camera = deviated_camera(finger_view(), 0.5 * BUILD)
    grey = render(GRID, camera, Look(colour=False)).image
    assert grey.ndim == 2
    assert np.hypot(*_map_error_mm(calibrate(BUNDLE, grey), camera).T).max() < 2e-3
    plain = grid_of_dots("none")
    found = calibrate(small_bundle(plain), render(plain, camera).image)
    assert np.hypot(*_map_error_mm(found, camera).T).max() < 2e-3
    assert any("no anchors" in line for line in found.warnings)


def test_diagnosis_gives_the_deviations():
    found = calibrate(BUNDLE, seen_by(GRID, BUILD, missing=0.04))
    text = "\n".join(found.diagnosis)
    for k, name in ((0, "rotation about x"), (6, "focal length")):
        line = next(v for v in found.diagnosis if v.startswith(name))
        assert float(line.split()[len(name.split())]) == pytest.approx(
            found.deviation.values[k], abs=0.006
        )
    assert f"{len(found)} of {len(GRID)}" in text
    assert all(str(k) in text for k in found.missing[:5])


@pytest.mark.slow
def test_poor_builds_and_prints_are_warned_of():
    values = BUILD.copy()
    values[PARAMETERS.index("rotation_x_deg")] = 3.2
    tilted = calibrate(BUNDLE, seen_by(GRID, values))
    assert any("rotation about x" in line for line in tilted.warnings)
    sparse = calibrate(BUNDLE, seen_by(GRID, BUILD, missing=0.15))
    assert any("missing" in line for line in sparse.warnings)
    wave = 0.03 * np.sin(GRID.positions_mm / 1.8)
    warped = calibrate(BUNDLE, seen_by(GRID, BUILD, moved_mm=wave))
    assert any("warped" in line for line in warped.warnings)


@pytest.mark.parametrize("press_n", [0.25, pytest.param(1.0, marks=pytest.mark.slow)])
def test_contact_in_the_reference_is_noticed(press_n):
    frame = seen_by(GRID, BUILD, moved_mm=_pressed(press_n), noise=6)
    with pytest.raises(CalibrationError) as caught:
        calibrate(BUNDLE, frame)
    assert caught.value.reason == "contact"
    x, y = caught.value.position_mm
    assert np.hypot(x - 2.0, y + 1.5) < 1.6
    allowed = calibrate(BUNDLE, frame, allow_contact=True)
    far = np.hypot(*(GRID.positions_mm - [2.0, -1.5]).T) > 5
    error = _map_error_mm(allowed, deviated_camera(finger_view(), BUILD))
    assert np.hypot(*error[far].T).max() < 0.01


def _pressed(newtons):
    """A dent (m, 3) of Boussinesq's far field and a smooth middle: 1 mm per newton deep."""
    away = GRID.positions_mm - [2.0, -1.5]
    fall = np.exp(-(away**2).sum(axis=1) / (2 * 1.5**2))
    return newtons * np.column_stack([0.06 * away * fall[:, None], -1.0 * fall])


@pytest.mark.parametrize(
    ("change", "reason", "value"),
    [
        (lambda im: im[::-1], "orientation", "top to bottom"),
        (lambda im: im[:, ::-1], "orientation", "left to right"),
        (lambda im: im[::-1, ::-1], "orientation", "180°"),
        (lambda im: np.rot90(im), "size", "480 x 640 px"),
        (lambda im: im[::2, ::2], "size", "320 x 240 px"),
        (lambda im: im[:, :, :2], "size", "h, w, 3"),
        (lambda im: im.astype(float), "size", "uint8"),
        (lambda im: np.full_like(im, 120), "dots", "0 dots"),
        (
            lambda im: np.where(np.arange(640)[:, None] < 360, im, 5).astype(np.uint8),
            ("dots", "print", "lattice"),
            None,
        ),
    ],
)
def test_pictures_that_are_no_reference(change, reason, value):
    frame = seen_by(GRID, 0.5 * BUILD)
    with pytest.raises(CalibrationError, match=value) as caught:
        calibrate(BUNDLE, np.ascontiguousarray(change(frame)))
    assert caught.value.reason in (reason if isinstance(reason, tuple) else (reason,))


@pytest.mark.parametrize("turned", ["rot90", "transpose"])
def test_square_pictures_on_their_side(turned):
    square = dataclasses.replace(finger_view(), image_width_px=480)
    grid = build_marker_grid(15, 13, 1.1, 0.45)
    frame = render(grid, square).image
    frame = np.rot90(frame) if turned == "rot90" else frame.transpose(1, 0, 2)
    value = "90° anticlockwise" if turned == "rot90" else "transposed"
    with pytest.raises(CalibrationError, match=value) as caught:
        calibrate(small_bundle(grid, square), np.ascontiguousarray(frame))
    assert caught.value.reason == "orientation"


def test_frames_of_another_sensor():
    other = build_marker_grid(14, 13, 1.5, 0.6)
    with pytest.raises(CalibrationError):
        calibrate(BUNDLE, seen_by(other, BUILD))
    with pytest.raises(CalibrationError):
        calibrate(small_bundle(other), seen_by(GRID, BUILD))
    finer = build_marker_grid(19, 18, 0.95, 0.4)
    with pytest.raises(CalibrationError) as caught:
        calibrate(BUNDLE, seen_by(finer, np.zeros(len(BUILD))))
    assert caught.value.reason in ("camera", "fit")
    kind = np.roll(GRID.kind, 7 * 18 + 3)
    size = np.where(kind == 1, GRID.diameter_mm.max(), GRID.diameter_mm.min())
    moved = dataclasses.replace(GRID, kind=kind, diameter_mm=size)
    with pytest.raises(CalibrationError) as caught:
        calibrate(BUNDLE, seen_by(moved, np.zeros(len(BUILD))))
    assert caught.value.reason in ("anchors", "lattice")


def test_another_camera_is_refused():
    steep = finger_view(tilt_deg=16.0)
    with pytest.raises(CalibrationError) as caught:
        calibrate(small_bundle(GRID, steep), seen_by(GRID, np.zeros(len(BUILD))))
    assert caught.value.reason == "camera"


def test_bundle_without_markers_is_refused():
    with pytest.raises(IfemError, match="markers"):
        calibrate(dataclasses.replace(BUNDLE, markers=None), seen_by(GRID, BUILD))


def test_tracker_follows_the_calibrated_markers():
    rng = np.random.default_rng(8)
    still = seen_by(GRID, BUILD, missing=0.03)
    found = calibrate(BUNDLE, still)
    tracker = found.tracker()
    assert tracker.reference.markers.tolist() == found.markers.tolist()
    assert np.abs(tracker.update(still).tracks.displacement_px).max() < 0.02
    shift = np.array([0.25, -0.15]) + 0.02 * rng.normal(size=(len(GRID), 2))
    moved = tracker.update(seen_by(GRID, BUILD, missing=0.03, moved_mm=shift)).tracks
    assert moved.coverage > 0.97
    now = found.camera.backproject(moved.positions_px[moved.tracked])[:, :2]
    expected = shift[found.markers][moved.tracked]
    assert np.abs(now - found.rest_mm[moved.tracked] - expected).max() < 0.006


def test_a_calibration_belongs_to_one_bundle():
    found = calibrate(BUNDLE, seen_by(GRID, BUILD))
    found.require_bundle(BUNDLE)
    with pytest.raises(CalibrationError) as caught:
        found.require_bundle(small_bundle(build_marker_grid(14, 13, 1.5, 0.6)))
    assert caught.value.reason == "bundle"
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.reason, str(again)) == ("bundle", str(caught.value))
