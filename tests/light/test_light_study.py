"""The light of a finger: scene, comparison, exposure, choice of the bends, record and pictures."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gelslim_cad.dimensions import Dimensions, derive, derive_batch
from gelslim_cad.dimensions.bend import brightest_ratio, candidates
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.exposure import exposure
from gelslim_cad.light.scene import dark_faces, launched_na, light_inputs, light_scene
from gelslim_cad.light.study import Comparison, study_light, study_record
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.guide.shapes import MirrorGuide, mirror_profile
from gelslim_optics.light.result import Estimate
from gelslim_optics.light.trace import trace_light

DESIGNS = Path(__file__).parents[2] / "designs"
RAYS = 1 << 14


def spec_of(changes: dict[str, Any], name: str = "gelslim2") -> Spec:
    data = read_spec(DESIGNS / f"{name}.yaml").spec.model_dump()
    for path, value in changes.items():
        *blocks, key = path.split(".")
        block = data
        for part in blocks:
            block = block[part]
        assert key in block
        block[key] = value
    return Spec(**data)


def sized(changes: dict[str, Any] | None = None) -> Dimensions:
    return derive(spec_of(changes or {}))


@pytest.fixture(scope="module")
def finger() -> Dimensions:
    return sized()


@pytest.fixture(scope="module")
def study(finger: Dimensions) -> Any:
    return study_light(finger, rays=RAYS)


def test_light_needs_no_more_than_its_inputs(finger: Dimensions) -> None:
    again = study_light(light_inputs(finger), rays=RAYS >> 4)
    assert study_record(again) == study_record(study_light(finger, rays=RAYS >> 4))


def test_every_ledger_closes_and_nothing_is_lost(study: Any) -> None:
    for guide in (study.light, study.glued, study.air_gap):
        assert guide.ledger_gap() < 1e-12
        assert guide.value("lost") == 0
        total = sum(found.value for found in guide.ledger().values())
        assert total == pytest.approx(1.0, abs=1e-12)


def test_light_that_leaves_ends_in_the_black_inside(finger: Dimensions) -> None:
    profile = guide_profile(finger)
    dark = set(dark_faces(profile))
    assert {"foot_left", "inner_bend_right", "window_bottom", "gel_side_left"} <= dark
    assert "gel_face" not in dark
    gap = mirror_profile(MirrorGuide(29.0, 2.5, 1.0, "air_gap"))
    open_faces = {"leg_top_left", "window_end_right", "mirror_left"}
    assert not open_faces & set(dark_faces(gap))


def test_a_denser_coat_and_more_absorption_darken(finger: Dimensions) -> None:
    def lit(**changes: Any) -> float:
        d = {**light_inputs(finger), **changes}
        return trace_light(light_scene(d, guide_profile(d)), RAYS).arrived().value

    reference = lit()
    assert lit(**{"material.acrylic.absorption_per_m": 20.0}) < 0.9 * reference
    assert lit(**{"material.gel.coat_reflectance": 0.0}) < reference
    assert lit(**{"material.gel.refractive_index": 1.4906}) > 1.2 * reference


def test_emission_laws() -> None:
    assert launched_na(sized()) == 1.0
    dome = sized({"design.leds.emission": "dome", "design.leds.dome_half_angle_deg": 30.0})
    assert launched_na(dome) == pytest.approx(0.5)
    table = {
        "design.leds.emission": "table",
        "design.leds.emission_angle_deg": (0.0, 20.0, 40.0, 60.0),
        "design.leds.emission_intensity": (1.0, 0.8, 0.0, 0.0),
    }
    assert launched_na(sized(table)) == pytest.approx(math.sin(math.radians(40)))
    narrow = study_light(dome, rays=RAYS, curve=False)
    assert narrow.certificate.guided > 0.95


def test_a_table_that_makes_no_sense_is_refused() -> None:
    for angles, values in (((), ()), ((0.0, 10.0), (1.0,)), ((5.0, 9.0), (1, 1)), ((0, 9), (0, 0))):
        with pytest.raises(ValueError, match="emission"):
            spec_of(
                {
                    "design.leds.emission": "table",
                    "design.leds.emission_angle_deg": angles,
                    "design.leds.emission_intensity": values,
                }
            )


def test_exposure_follows_the_lens_and_the_leds(finger: Dimensions, study: Any) -> None:
    base = exposure(finger, study.light, "red")
    assert base.limit == "readout"
    assert base.frame_rate_hz == finger["camera.frame_rate_hz"]
    inputs = light_inputs(finger)
    dim = exposure({**inputs, "design.leds.radiant_flux_mw": 1.0}, study.light, "red")
    assert dim.exposure_ms == pytest.approx(
        base.exposure_ms * inputs["design.leds.radiant_flux_mw"]
    )
    assert dim.limit == "exposure"
    assert dim.frame_rate_hz == pytest.approx(1000 / dim.exposure_ms)
    slow = exposure(
        {**inputs, "camera.f_number": 2 * inputs["camera.f_number"]}, study.light, "red"
    )
    assert slow.exposure_ms == pytest.approx(4 * base.exposure_ms)


def test_exposure_by_hand(finger: Dimensions, study: Any) -> None:
    """10 µW/mm² of 500 nm on a coat of 0.5, index 1 throughout, f/2, QE 1, no losses."""
    inputs = light_inputs(finger) | {
        "design.leds.radiant_flux_mw": 1.0,
        "led.count": 1.0,
        "design.leds.red_wavelength_nm": 500.0,
        "material.gel.coat_reflectance": 0.5,
        "material.gel.refractive_index": 1.0,
        "material.acrylic.refractive_index": 1.0,
        "camera.f_number": 2.0,
        "camera.lens_transmission": 1.0,
        "camera.quantum_efficiency": 1.0,
        "camera.full_well_e_um2": 1000.0,
    }
    mean = float(study.light.irradiance("red").mean())
    on_sensor_w_um2 = 0.001 * mean * 0.5 / 16 * 1e-6
    photons = on_sensor_w_um2 / (6.62607e-34 * 2.99792e8 / 500e-9)
    found = exposure(inputs, study.light, "red")
    assert found.exposure_ms == pytest.approx(500 / photons * 1000, rel=1e-4)


def test_verdicts_follow_the_interval() -> None:
    def verdict(low: float, high: float) -> str:
        return Comparison("x", "arrived", Estimate((low + high) / 2, 0.0, low, high)).verdict

    assert verdict(1.01, 1.2) == "brighter"
    assert verdict(0.8, 0.99) == "darker"
    assert verdict(0.98, 1.02) == "no different"


def test_a_tight_bend_with_leds_against_it_is_darker() -> None:
    """R/t = 1 under the conditions the older figures were measured for: a short leg, no gap."""
    d = sized({"design.light_guide.bend_radius_ratio": 1.0}).values
    inputs = light_inputs(sized({"design.light_guide.bend_radius_ratio": 1.0})) | {
        "design.light_guide.leg_length_mm": 0.55,
        "design.leds.package_mm": 2.5,
        "material.gel.coat_reflectance": 0.0,
        "guide.flat_width_mm": 28.0,
        "design.housing.fit_clearance_mm": 0.0,
    }
    assert d["guide.bend_ratio"] == 1.0
    found = study_light(inputs, rays=1 << 16, curve=False)
    wide = study_light(
        {**inputs, "guide.inner_radius_mm": 7.5, "guide.bend_ratio": 3.0}, rays=1 << 16, curve=False
    )
    ours, more = (s.comparisons[0].ratio for s in (found, wide))
    assert ours.high < more.low
    assert found.certificate.guided < wide.certificate.guided


@pytest.mark.slow
def test_auto_takes_the_least_bend_that_is_bright_enough() -> None:
    auto = {"design.light_guide.bend_radius_ratio": "auto"}
    free = sized(auto)
    assert 2.0 <= free["guide.bend_ratio"] <= 4.5
    limit = free["finger.width_mm"] - 4.0
    tight = sized({**auto, "design.envelope.max_width_mm": limit})
    assert tight["guide.bend_ratio"] < free["guide.bend_ratio"]
    assert tight["finger.width_mm"] <= limit + 1e-9
    hopeless = sized({**auto, "design.envelope.max_width_mm": 20.0})
    assert hopeless["guide.bend_ratio"] == 0.5


@pytest.mark.slow
def test_auto_is_the_brightest_of_its_candidates(finger: Dimensions) -> None:
    values = dict(light_inputs(finger))
    values["design.housing.side_wall_mm"] = finger["design.housing.side_wall_mm"]
    values["design.envelope.max_width_mm"] = None
    ratios = candidates(values)
    assert ratios == sorted(ratios)
    light = []
    for ratio in ratios:
        d = {**values, "guide.inner_radius_mm": ratio * values["design.light_guide.thickness_mm"]}
        light.append(trace_light(light_scene(d, guide_profile(d)), 1 << 14).value("delivered"))
    chosen = brightest_ratio(values)
    assert light[ratios.index(chosen)] >= 0.99 * max(light)
    assert all(x < 0.99 * max(light) for x in light[: ratios.index(chosen)])


def test_auto_works_for_batches() -> None:
    spec = spec_of({"design.light_guide.bend_radius_ratio": "auto"})
    limits = np.array([44.0, 48.0])
    d = derive_batch(spec, {"design.envelope.max_width_mm": limits})
    assert d["guide.bend_ratio"].shape == (2,)
    assert d["guide.bend_ratio"][0] < d["guide.bend_ratio"][1]


def test_record_is_plain_json_and_says_it_in_words(study: Any) -> None:
    record = study_record(study)
    text = json.dumps(record, allow_nan=False)
    assert json.loads(text)["format"] == "gelslim-light/1"
    assert record["certificate"]["sentences"][0].startswith("Not fully guided")
    assert {c["verdict"] for c in record["comparisons"]} <= {"brighter", "darker", "no different"}
    dark = replace(study, light=replace(study.light, tallies=0 * study.light.tallies))
    json.dumps(study_record(dark), allow_nan=False)


@pytest.mark.slow
def test_pictures_are_drawn_and_reproducible(finger: Dimensions, study: Any) -> None:
    pytest.importorskip("matplotlib")
    import io

    from PIL import Image

    from gelslim_cad.light.figures import irradiance_png, paths_png, ratio_png

    for draw in (
        lambda: paths_png(finger),
        lambda: irradiance_png(finger, study),
        lambda: ratio_png(study),
    ):
        first = draw()
        assert first == draw()
        image = np.asarray(Image.open(io.BytesIO(first)).convert("RGB")).astype(int)
        assert image.shape[1] > 800
        assert (np.ptp(image, axis=2) > 60).mean() > 0.002
