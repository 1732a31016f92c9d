"""Refusals of a calibration, one by one, on registered frames."""

from __future__ import annotations

import dataclasses
from contextlib import contextmanager

import numpy as np
import pytest
from calibration_samples import small_bundle
from camera_rig import finger_view
from synthetic import grid_of_dots, render

from gelslim_force.calibration import checks
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.camera_deviation import PARAMETERS, CameraTolerance
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.fit import fit_camera
from gelslim_force.calibration.residual_bump import ResidualBump, ResidualField
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.registration import register

GRID = grid_of_dots()
CAMERA = finger_view()
FRAME = render(GRID).image
DOTS = Detector().detect(FRAME)
FOUND = register(DOTS, GRID, FRAME.shape)
CHOSEN = DOTS.take(FOUND.dots)
IDS = np.arange(len(GRID))
IN_VIEW = checks.markers_in_view(CAMERA, GRID)


@contextmanager
def refused(reason, value=None):
    with pytest.raises(CalibrationError, match=value) as caught:
        yield caught
    assert caught.value.reason == reason


def test_the_frame_itself_passes_every_check():
    checks.require_dots(DOTS, IN_VIEW)
    checks.require_print(FOUND, DOTS, IN_VIEW)
    checks.require_anchors(CHOSEN, CAMERA, GRID, IDS)
    fit = fit_camera(CAMERA, GRID.positions_mm, GRID.diameter_mm, CHOSEN.centres_px)
    checks.require_fit(fit, GRID.pitch_mm, FOUND.pitch_px)


def test_markers_cut_by_the_picture_are_not_in_view():
    narrow = dataclasses.replace(CAMERA, image_width_px=500)
    seen = checks.markers_in_view(narrow, GRID)
    places = narrow.project(np.column_stack([GRID.positions_mm, np.zeros(len(GRID))]))
    assert 0.5 < seen.mean() < 1.0
    assert (places[seen] > 3).all()
    assert (places[seen][:, 0] < 496).all()
    assert not seen[(places[:, 0] < 0) | (places[:, 0] > 499)].any()


def test_anchors_that_look_ordinary_are_another_print():
    large = GRID.kind == 1
    area = np.where(large, CHOSEN.area_px / 2.25, CHOSEN.area_px)
    plain = dataclasses.replace(CHOSEN, area_px=area)
    with refused("anchors", f"{large.sum()} of {large.sum()}"):
        checks.require_anchors(plain, CAMERA, GRID, IDS)
    # One dirty anchor is no other print, nor is a common change of size by blur or exposure.
    area = CHOSEN.area_px.copy()
    area[np.flatnonzero(large)[0]] /= 2.25
    checks.require_anchors(dataclasses.replace(CHOSEN, area_px=area), CAMERA, GRID, IDS)
    blurred = dataclasses.replace(CHOSEN, area_px=1.4 * CHOSEN.area_px)
    checks.require_anchors(blurred, CAMERA, GRID, IDS)


def test_many_dots_off_the_print_are_another_print():
    extra = 100
    more = Detections(
        centres_px=np.vstack([DOTS.centres_px, DOTS.centres_px[:extra] + 9.0]),
        area_px=np.concatenate([DOTS.area_px, DOTS.area_px[:extra]]),
        contrast=np.concatenate([DOTS.contrast, DOTS.contrast[:extra]]),
        moments_px2=np.vstack([DOTS.moments_px2, DOTS.moments_px2[:extra]]),
        flags=np.concatenate([DOTS.flags, np.zeros(extra, dtype=int)]),
    )
    foreign = np.arange(len(DOTS), len(more))
    strange = dataclasses.replace(FOUND, spurious=foreign)
    with refused("print", "100 "):
        checks.require_print(strange, more, IN_VIEW)
    few = dataclasses.replace(FOUND, dots=np.where(IDS % 2 == 0, FOUND.dots, -1))
    with refused("print", f"{(IDS % 2 == 0).sum()} "):
        checks.require_print(few, DOTS, IN_VIEW)


def _field(**changes):
    bump = ResidualBump(x_mm=1.0, y_mm=2.0, shift_mm=0.05, sigmas=20.0, spread=0.05)
    return ResidualField(0.01, 0.01, dataclasses.replace(bump, **changes))


def test_contact_is_local_strong_and_beyond_noise():
    with refused("contact", "50 µm") as caught:
        checks.require_no_contact(_field())
    assert caught.value.position_mm == (1.0, 2.0)
    for harmless in ({"shift_mm": 0.01}, {"sigmas": 4.0}, {"spread": 0.6}):
        checks.require_no_contact(_field(**harmless))
    checks.require_no_contact(ResidualField(0.01, 0.0, None))


def test_far_deviations_and_poor_fits_are_refused():
    fit = fit_camera(CAMERA, GRID.positions_mm, GRID.diameter_mm, CHOSEN.centres_px)
    values = fit.values.copy()
    values[PARAMETERS.index("focal_percent")] = -5.5 * CameraTolerance().focal_percent
    with refused("camera", "focal_percent.*-11"):
        checks.require_fit(dataclasses.replace(fit, values=values), 1.1, 24.0)
    with refused("fit"):
        checks.require_fit(dataclasses.replace(fit, residual_px=fit.residual_px + 4), 1.1, 24.0)
    with refused("fit", "40%"):
        checks.require_fit(dataclasses.replace(fit, used=IDS % 5 < 3), 1.1, 24.0)


def test_lens_that_folds_the_picture_is_a_refusal_and_no_crash():
    """The fit's steps may leave the distortion's domain: a refusal, not a bare error."""
    tight = dataclasses.replace(CAMERA, focal_px=380.0)
    tolerance = CameraTolerance(k1=2.0, k2=2.0, tangential=0.2)
    with pytest.raises(CalibrationError):
        calibrate(small_bundle(GRID, tight), FRAME, tolerance=tolerance)
