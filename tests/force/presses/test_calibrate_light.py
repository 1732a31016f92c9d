"""Hidden gains of the light from drawn presses of a ball; see `ball_presses`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ball_presses import (
    YOUNG_MPA,
    Built,
    ball_bundle,
    ball_calibration,
    ball_picture,
    rest_picture,
)
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.presses.ball_check import fitted_ball
from gelslim_force.presses.calibrate_light import calibrate_light
from gelslim_force.presses.light_fit import PressLight, fit_light
from gelslim_force.presses.light_report import light_report_html
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError
from gelslim_force.presses.press_model import PressModel
from gelslim_force.presses.seen_press import PressView
from gelslim_force.settings import PipelineSettings
from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
GAMMA = JointSettings().gamma
"""The drawn pictures are linear in the light, so that their gain is GAMMA times the hidden one."""
PLACES = np.array([(0, 0), (7, 0), (-7, 0), (0, 6), (0, -6), (5, 5), (-5, -5)], dtype=float)


def presses(built: Built, seed: int, count: int) -> dict[str, NDArray[np.uint8]]:
    rng = np.random.default_rng([9, seed])
    pictures = {}
    for number in range(count):
        load = YOUNG_MPA * built.young * built.ball_mm / 6 * rng.uniform(1.0, 4.0)
        place = np.array([rng.uniform(-6.5, 6.5), rng.uniform(-6, 6)])
        pictures[f"p{number}.png"] = ball_picture(built, load, place, 1000 * seed + number)
    return pictures


def calibrated(
    built: Built, seed: int, count: int, ball_mm: float | None = None, *, fit_ball: bool = False
) -> LightCalibration:
    return calibrate_light(
        ball_bundle(built.poissons_ratio), ball_calibration(), rest_picture(),
        presses(built, seed, count), ball_mm or 2 * built.ball_mm, fit_ball=fit_ball,
    )  # fmt: skip


def traced() -> LightMap:
    light = ball_bundle().light
    return LightMap(**{name: np.asarray(value) for name, value in light.items()})


def test_gains_of_perfect_data_are_found() -> None:
    """Changes made with the law itself, with gains that vary over the gel."""
    law = LightLaw.of(traced(), GAMMA)
    rng = np.random.default_rng(2)
    terms = np.array([[1.2, 0.1, -0.05, 0.04, 0.03, -0.06], [0.8, -0.1, 0.02, 0.0, 0.05, 0.1]])
    data = []
    for _ in range(12):
        centre = rng.uniform(-7, 7, 2)
        places = centre + rng.uniform(-2, 2, (300, 2))
        slope = (places - centre) / 5
        x, y = (places / [11.0, 10.25]).T
        basis = np.column_stack([x**0, x, y, x * x - 1 / 3, x * y, y * y - 1 / 3])
        share = np.tile(np.eye(2)[:, :, None], (1, 1, 300))
        level = np.full((2, 300), 0.97)
        change, _, _ = law.change(slope, share, level, terms @ basis.T)
        noise = np.full((2, 300), 0.002)
        noise[0, :20] = np.inf
        change[0, :20] = 9.0
        area = np.full(300, 0.02)
        data.append(PressLight(places, slope, change, noise, share, level, area, law))
    found = fit_light(data, np.zeros(2), np.array([11.0, 10.25]))
    np.testing.assert_allclose(found.gain, terms, atol=0.02)
    assert (found.explained > 0.99).all()
    assert (found.explained_as_traced < found.explained).all()
    assert found.light_error.max() < 0.01
    sigma = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    assert (np.abs(found.gain - terms) < 4 * sigma).all()


@pytest.mark.slow
def test_a_hidden_light_is_found_and_explains_other_presses() -> None:
    """Red 20 % too strong, green 20 % too weak, both stronger towards the tip."""
    hidden = Built(poissons_ratio=0.3223, light=(1.2, 0.8, 1.0), light_tilt=0.2, ball_mm=3.0)
    found = calibrated(hidden, 1, 10)
    truth = np.asarray(hidden.light_gain(PLACES))[:, :2].T * GAMMA
    assert np.abs(found.gain_at(PLACES) / truth - 1).max() < 0.05
    assert np.abs(found.gain[:, 0] / truth[:, 0] - 1).max() < 0.03
    assert 0.02 <= found.gain_sigma < 0.08
    page = light_report_html(found)
    assert page.count("<circle") == 20
    assert "p9.png" in page
    bundle, camera = ball_bundle(0.3223), ball_calibration()
    sources = {
        "traced": unknown_shape(
            bundle, camera, rest_picture(), gel="linear", settings=JointSettings(gamma=1.0)
        ),
        "built": unknown_shape(bundle, camera, rest_picture(), gel="linear", light=found),
    }
    other = replace(hidden, ball_mm=5.0)
    rng = np.random.default_rng(3)
    seen: dict[str, list[FrameResult]] = {name: [] for name in sources}
    for number in range(4):
        load = rng.uniform(0.15, 0.5)
        picture = ball_picture(other, load, rng.uniform(-6, 6, 2), 5000 + number)
        for name, source in sources.items():
            linear = PipelineSettings(gel="linear")
            result = ForcePipeline(bundle, camera, linear, source).process(picture)
            assert result.normal_known
            assert result.wrench is not None
            assert abs(result.wrench.force_n[2] + load) < 0.12 * load
            seen[name].append(result)
    left = {n: np.mean([r.extra["normal"]["unexplained"] for r in rs]) for n, rs in seen.items()}
    assert left["built"] < 0.75 * left["traced"]
    gains = np.array([r.extra["normal"]["gain"] for r in seen["built"]])
    assert np.abs(gains - 1).max() < 0.045


@pytest.mark.slow
def test_random_lights_are_within_five_percent() -> None:
    rng = np.random.default_rng(6)
    off, scores = [], []
    for seed in range(5):
        light = (rng.uniform(0.75, 1.25), rng.uniform(0.75, 1.25), 1.0)
        hidden = Built(
            poissons_ratio=(0.3223, 0.48)[seed % 2], light=light, ball_mm=(3.0, 4.0)[seed % 2]
        )
        found = calibrated(hidden, 30 + seed, 6)
        own = found.gain_at(PLACES) / (np.array(light[:2])[:, None] * GAMMA) - 1
        off.append(np.abs(found.gain[:, 0] / (np.array(light[:2]) * GAMMA) - 1).max())
        scores.append(own / found.gain_sigma)
    assert np.max(off) < 0.05
    assert np.sqrt(np.mean(np.square(scores))) < 1.2


@pytest.mark.slow
def test_another_ball_is_refused_or_fitted() -> None:
    hidden = Built(ball_mm=3.0, light=(1.1, 0.9, 1.0))
    with pytest.raises(PressError, match=r"fit a ball of [56]\.\d") as refused:
        calibrated(hidden, 4, 5, 10.0)
    assert refused.value.reason == "ball"
    found = calibrated(hidden, 4, 5, 5.0, fit_ball=True)
    assert found.ball_mm == pytest.approx(6.0, rel=0.03)
    assert any("fit a ball" in line for line in found.diagnosis)


@pytest.mark.slow
def test_sizes_of_random_balls_are_within_their_deviations() -> None:
    """Without loads, and with a first value that is off by up to 15 %."""
    rng = np.random.default_rng(21)
    off, scores = [], []
    for number in range(6):
        hidden = Built(
            poissons_ratio=(0.3223, 0.48)[number % 2], ball_mm=(3.0, 4.0, 5.0)[number % 3],
            light=(*rng.uniform(0.75, 1.25, 2), 1.0), sticking=number % 4 > 1,
        )  # fmt: skip
        bundle = ball_bundle(hidden.poissons_ratio)
        named = hidden.ball_mm * rng.uniform(0.85, 1.15)
        view = PressView(bundle, ball_calibration(), rest_picture(), named)
        young = bundle.material.youngs_modulus_mpa
        shown = presses(hidden, 21000 + number, 5)
        models = [PressModel(view, view.look(*press), young) for press in shown.items()]
        size, sigma = fitted_ball(view, models, [Load(name, 1.0, np.inf) for name in shown])
        off.append(np.log(size / (2 * hidden.ball_mm)))
        scores.append(off[-1] / sigma)
    assert np.abs(off).max() < 0.03
    assert np.sqrt(np.mean(np.square(scores))) < 1.2


def test_bad_input_is_refused() -> None:
    sensor = ball_bundle(), ball_calibration(), rest_picture()
    few = {"a.png": rest_picture()}
    with pytest.raises(PressError, match="1 presses") as refused:
        calibrate_light(*sensor, few, 6.0)
    assert refused.value.reason == "count"
    four = {f"{name}.png": rest_picture() for name in "abcd"}
    with pytest.raises(PressError, match=r"a\.png: no contact"):
        calibrate_light(*sensor, four, 6.0)
    with pytest.raises(PressError, match="no traced light"):
        calibrate_light(replace(ball_bundle(), light={}), *sensor[1:], four, 6.0)
