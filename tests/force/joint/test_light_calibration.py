"""A calibrated light: its file, its gain over the gel, and what the joint estimate makes of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pressed_samples import calibration, light_map, lit_bundle, pressed, reference

from gelslim_force.built_sensor import built_light
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.joint.light.calibration import (
    GAINS,
    LightCalibration,
    light_calibration_record,
    read_light_calibration,
    write_light_calibration,
)
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import SensorError, open_sensor
from gelslim_optics.light.light_law import LightLaw


def built(**other: Any) -> LightCalibration:
    gain = np.zeros((2, 6))
    gain[:, 0], gain[0, 1], gain[1, 5] = (1.2, 0.8), 0.1, -0.3
    values: dict[str, Any] = {
        "geometry_hash": lit_bundle().geometry_hash,
        "channels": (0, 1),
        "middle_mm": np.zeros(2),
        "half_mm": np.array([11.0, 10.25]),
        "gain": gain,
        "covariance": np.tile(np.eye(6) * 1e-4, (2, 1, 1)),
        "gamma": 1.8,
        "gain_sigma": 0.03,
        "light_error": 0.12,
        "ball_mm": 6.0,
        "presses": ({"picture": "a.png"},),
        "diagnosis": ("One line.",),
        "warnings": ("look here",),
        "gel": {"law": "linear", "presses": {"linear": 1}},
    }
    return LightCalibration(**{**values, **other})


def test_gain_at_places() -> None:
    found = built()
    places = np.array([(0.0, 0.0), (11.0, 0.0), (-11.0, 0.0), (0.0, 10.25), (99.0, 0.0)])
    gain = found.gain_at(places)
    assert gain[0] == pytest.approx([1.2, 1.3, 1.1, 1.2, 1.3])
    assert gain[1] == pytest.approx([0.9, 0.9, 0.9, 0.6, 0.9])
    steep = np.zeros((2, 6))
    steep[:, 1] = 9.0
    assert np.unique(built(gain=steep).gain_at(places[1:3])).tolist() == list(GAINS)


def test_a_file_keeps_everything(tmp_path: Path) -> None:
    write_light_calibration(built(), tmp_path / "light.json")
    again = read_light_calibration(tmp_path / "light.json")
    assert light_calibration_record(again) == light_calibration_record(built())
    assert again.gel == built().gel


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"format": "other/1"}, "format"),
        ({"gain": [[1.0]]}, "gain"),
        ({"channels": []}, "gain"),
        ({"half_mm": [0.0, 1.0]}, "half_mm"),
        ({"light_error": -1.0}, "light_error"),
        ({"gain_sigma": "much"}, "light calibration"),
        ({"presses": 3}, "light calibration"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, changed: dict[str, Any], words: str) -> None:
    record = {**light_calibration_record(built()), **changed}
    (tmp_path / "light.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(CalibrationError, match=words) as refused:
        read_light_calibration(tmp_path / "light.json")
    assert refused.value.reason == "file"


def test_missing_files_and_other_sensors_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="calibrate-light"):
        read_light_calibration(tmp_path / "none.json")
    record = light_calibration_record(built())
    del record["gamma"]
    (tmp_path / "light.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(CalibrationError, match="gamma is missing"):
        built_light(lit_bundle(), tmp_path / "light.json")
    with pytest.raises(CalibrationError, match="belongs"):
        built_light(lit_bundle(), built(geometry_hash="0" * 64))
    assert built_light(lit_bundle(), None) is None
    with pytest.raises(SensorError, match="unknown"):
        open_sensor(
            lit_bundle(), reference=reference().image, calibration=calibration(),
            indenter="sphere:5", light_calibration=built(),
        )  # fmt: skip
    with pytest.raises(ValueError, match="channels"):
        unknown_shape(
            lit_bundle(), calibration(), reference().image, gel="linear",
            light=built(channels=(0, 2)),
        )  # fmt: skip


def test_gains_of_places_enter_the_law() -> None:
    law = LightLaw.of(light_map(2), 1.0)
    rng = np.random.default_rng(1)
    slope = rng.uniform(-0.4, 0.4, (5, 2))
    share = np.tile(np.eye(2)[:, :, None], (1, 1, 5))
    gain = rng.uniform(0.7, 1.3, (2, 5))
    found, by_slope, by_gain = law.change(slope, share, np.ones((2, 5)), gain)
    plain, _, _ = law.change(slope, share, np.ones((2, 5)), 1.0)
    np.testing.assert_allclose(found, gain * plain, atol=1e-12)
    more, _, _ = law.change(slope, share, np.ones((2, 5)), gain + 1e-6)
    np.testing.assert_allclose(by_gain, (more - found) / 1e-6, rtol=1e-5, atol=1e-9)
    moved, _, _ = law.change(slope + np.array([0.0, 1e-6]), share, np.ones((2, 5)), gain)
    np.testing.assert_allclose(by_slope[..., 1], (moved - found) / 1e-6, rtol=1e-4, atol=1e-6)


def test_what_is_left_unexplained_adds_to_the_error_of_the_light() -> None:
    chosen = JointSettings().with_light(built())
    assert chosen.light_error == pytest.approx(np.hypot(JointSettings().light_error, 0.12))
    assert (chosen.gain_sigma, chosen.gamma) == (0.03, 1.8)


@pytest.mark.slow
def test_what_is_left_unexplained_enters_the_deviation_of_forces() -> None:
    even = np.zeros((2, 6))
    even[:, 0] = 1.0
    exact = built(gain=even, gamma=1.0, gain_sigma=0.2, light_error=1e-6)
    found = []
    for light in (exact, replace(exact, light_error=0.1), replace(exact, light_error=0.3)):
        source = unknown_shape(
            lit_bundle(), calibration(), reference().image, gel="linear", light=light
        )
        pipeline = ForcePipeline(lit_bundle(), calibration(), None, source)
        wrench = pipeline.process(pressed(13).image).wrench
        assert wrench is not None
        found.append(wrench.standard_deviation[2])
    assert found[1] > 1.05 * found[0]
    assert found[2] > 1.15 * found[0]
