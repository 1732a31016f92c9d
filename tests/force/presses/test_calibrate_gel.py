"""Hidden gels from drawn presses of a ball; see `ball_presses` for where the truth comes from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ball_presses import (
    THICKNESS_MM,
    YOUNG_MPA,
    Built,
    ball_bundle,
    ball_calibration,
    ball_picture,
    rest_picture,
)
from camera_rig import off_centre_view
from numpy.typing import NDArray
from shaded_frames import shaded
from weighed_presses import LOADS_N, calibrated, presses

from gelslim_force.presses.calibrate_gel import calibrate_gel
from gelslim_force.presses.gel_calibration import GelCalibration
from gelslim_force.presses.gel_report import gel_report_html
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings

Array = NDArray[np.float64]


def errors(found: GelCalibration, built: Built) -> Array:
    """(2,) relative errors of modulus and thickness."""
    truth = YOUNG_MPA * built.young, THICKNESS_MM * built.thickness
    return np.array([found.youngs_modulus_mpa / truth[0] - 1, found.thickness_mm / truth[1] - 1])


@pytest.mark.slow
def test_five_presses_find_a_hidden_gel_and_forces_follow() -> None:
    """Forces of an object of unknown shape, before and after the calibration."""
    built = Built(young=1.2, thickness=0.94)
    found = calibrated(built, 1, LOADS_N)
    assert (np.abs(errors(found, built)) < [0.03, 0.015]).all()
    assert len(found.presses) == 5
    assert not found.warnings
    page = gel_report_html(found)
    assert page.count("<circle") == 10
    assert "press3.png" in page
    picture = ball_picture(built, 0.4, np.array([1.0, -2.0]), 999)
    wrenches = []
    for gel in (None, found):
        sensor = open_sensor(
            ball_bundle(), reference=rest_picture(), calibration=ball_calibration(),
            indenter="unknown", gel_calibration=gel, settings=PipelineSettings(gel="linear"),
        )  # fmt: skip
        wrench = sensor.process(picture).wrench
        assert wrench is not None
        wrenches.append(wrench)
    before, after = wrenches
    assert abs(before.force_n[2] + 0.4) > 0.06
    assert abs(after.force_n[2] + 0.4) < 0.025
    sigma = after.standard_deviation[2]
    assert abs(after.force_n[2] + 0.4) < 2 * sigma
    share = abs(after.force_n[2]) * np.sqrt(found.covariance[0, 0])
    assert sigma > max(share, before.standard_deviation[2])


@pytest.mark.slow
def test_random_sensors_are_within_the_stated_deviations() -> None:
    """Modulus ±30 %, thickness ±8 %, two ratios, three balls; half of the gels stick to them."""
    rng = np.random.default_rng(5)
    off, stated, scores = [], [], []
    for seed in range(10):
        built = Built(
            rng.uniform(0.7, 1.3), round(rng.uniform(0.92, 1.08), 3), (0.48, 0.3223)[seed % 2],
            (6.0, 4.0, 8.0)[seed % 3], sticking=seed % 4 > 1,
        )  # fmt: skip
        loads = LOADS_N * built.young * built.ball_mm / 6 * rng.uniform(0.7, 1.1)
        found = calibrated(built, 20 + seed, loads)
        own = errors(found, built)
        off.append(own)
        stated.append(np.sqrt(np.diag(found.covariance)[:2]))
        scores.append(own / stated[-1])
    assert (np.abs(off).max(axis=0) < [0.05, 0.02]).all()
    assert (np.max(stated, axis=0) < [0.06, 0.025]).all()
    assert (np.sqrt(np.mean(np.square(scores), axis=0)) < 1.2).all()
    assert np.mean(np.abs(scores) < 1.96) >= 0.9


@pytest.mark.slow
def test_poissons_ratio_is_found_if_asked() -> None:
    truth = Built(poissons_ratio=0.46)
    pictures, loads = presses(truth, 3, LOADS_N)
    found = calibrate_gel(
        ball_bundle(0.48), ball_calibration(), rest_picture(), pictures, loads, 12.0,
        fit_ratio=True,
    )  # fmt: skip
    sigma = found.standard_deviation[2]
    assert 0 < sigma < 0.02
    assert abs(found.poissons_ratio - 0.46) < 3 * sigma
    assert abs(found.poissons_ratio - 0.48) > 2 * sigma


@pytest.mark.slow
def test_another_ball_is_refused_with_its_size() -> None:
    pictures, loads = presses(Built(ball_mm=6.0), 4, LOADS_N[:4])
    for named in (8.0, 16.0):
        with pytest.raises(PressError, match=r"fit a ball of 1[12]\.\d") as refused:
            calibrate_gel(ball_bundle(), ball_calibration(), rest_picture(), pictures, loads, named)
        assert refused.value.reason == "ball"


@pytest.mark.slow
def test_creep_hysteresis_rest_and_a_wrong_line_are_told() -> None:
    built = Built()
    pictures, loads = presses(built, 6, np.array([0.1, 0.2, 0.3, 0.45, 0.6, 0.8]))
    fading = [replace(load, load_n=load.load_n * (1 - 0.06 * k), sigma_n=0.002, time_s=60.0 * k)
              for k, load in enumerate(loads)]  # fmt: skip
    pictures["rest.png"] = shaded(camera=off_centre_view(), seed=77).image
    rest = Load("rest.png", 0.0, 0.01, 400.0)
    sensor = ball_bundle(), ball_calibration(), rest_picture(), pictures
    found = calibrate_gel(*sensor, [*fading, rest], 12.0)
    told = " ".join(found.diagnosis)
    assert "(creep" in told
    assert "rest.png" in told
    # The gel has become softer by a third during the series: the modulus is that of its middle.
    assert 0.05 < np.sqrt(found.covariance[0, 0]) < 0.15
    assert abs(errors(found, built)[0]) < 2 * np.sqrt(found.covariance[0, 0])
    page = gel_report_html(found)
    assert "time, s" in page
    assert all(f"{press['residual_n']:+.4f}" in page for press in found.presses)
    wrong = [replace(load, load_n=2 * load.load_n) if k == 2 else load
             for k, load in enumerate(loads)]  # fmt: skip
    found = calibrate_gel(*sensor, wrong, 12.0)
    assert any("press2.png" in line for line in found.warnings)
    own = errors(found, built)
    assert (np.abs(own) < 3 * np.sqrt(np.diag(found.covariance)[:2])).all()
    # Up to the largest load and down again, where the gel pushes back with 10 % less.
    shares = ((0, 1.0), (2, 1.0), (4, 1.0), (5, 1.0), (3, 0.9), (1, 0.9))
    there_and_back = [replace(loads[k], load_n=loads[k].load_n * share, sigma_n=0.002)
                      for k, share in shares]  # fmt: skip
    found = calibrate_gel(*sensor, there_and_back, 12.0)
    assert any("(hysteresis)" in line for line in found.diagnosis)


def test_too_few_presses_and_missing_pictures() -> None:
    sensor = ball_bundle(), ball_calibration(), rest_picture()
    one = [Load("a.png", 0.5, 0.01), Load("rest.png", 0.0, 0.01)]
    with pytest.raises(PressError, match="1 presses") as refused:
        calibrate_gel(*sensor, {"a.png": rest_picture()}, one, 12.0)
    assert refused.value.reason == "count"
    three = [Load(f"{name}.png", 0.5, 0.01) for name in "abc"]
    with pytest.raises(PressError, match=r"no picture b\.png"):
        calibrate_gel(*sensor, {"a.png": rest_picture()}, three, 12.0)


def test_a_picture_without_contact_is_named() -> None:
    loads = [Load(f"{name}.png", 0.5, 0.01) for name in "abc"]
    pictures = {load.picture: rest_picture() for load in loads}
    sensor = ball_bundle(), ball_calibration(), rest_picture()
    with pytest.raises(PressError, match=r"a\.png: no contact") as refused:
        calibrate_gel(*sensor, pictures, loads, 12.0)
    assert refused.value.reason == "contact"
    pictures["a.png"] = rest_picture()[::2, ::2].copy()
    with pytest.raises(PressError, match="320 x 240"):
        calibrate_gel(*sensor, pictures, loads, 12.0)


@pytest.mark.slow
@pytest.mark.parametrize("indenter", ["sphere:6", "unknown"])
def test_the_share_of_the_thickness_is_that_of_rebuilt_sensors(indenter: str) -> None:
    """F_z of sensors that were opened with a thinner and a thicker gel, against the share stated.

    The share of an unknown shape takes its motion as given, that of a ball follows the patch.
    """
    bundle = ball_bundle(0.3223)
    picture = ball_picture(Built(poissons_ratio=0.3223), 0.35, np.array([1.0, -2.0]), 5)
    material = bundle.material

    def opened(thickness: float, variance: float) -> tuple[float, float]:
        gel = GelCalibration(
            bundle.geometry_hash, material.youngs_modulus_mpa, thickness * THICKNESS_MM,
            material.poissons_ratio, np.diag([0.0, variance, 0.0]), {}, 12.0,
        )  # fmt: skip
        sensor = open_sensor(
            bundle, reference=rest_picture(), calibration=ball_calibration(), indenter=indenter,
            gel_calibration=gel, settings=PipelineSettings(gel="linear"),
        )  # fmt: skip
        wrench = sensor.process(picture).wrench
        assert wrench is not None
        return float(wrench.force_n[2]), float(wrench.covariance[2, 2])

    slope = (opened(np.exp(0.02), 0.0)[0] - opened(np.exp(-0.02), 0.0)[0]) / 0.04
    variance = 1e-4
    share = opened(1.0, variance)[1] - opened(1.0, 0.0)[1]
    assert np.sqrt(share / variance) == pytest.approx(abs(slope), rel=0.3)
