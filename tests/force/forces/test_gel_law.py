"""Which law of the gel gave the forces: told for each frame, each run, and with the reason."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sensor_samples import frame, sensor_bundle

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.forces.gel_law import GelLaw, GelUse
from gelslim_force.outputs.live_view import live_state
from gelslim_force.outputs.run_recorder import RunRecorder
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.run import RunSummary
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle

TENTH_MM = 0.2


def crowned() -> Bundle:
    mesh = sensor_bundle().mesh
    return replace(sensor_bundle(), mesh=replace(mesh, surface_shift=np.zeros(len(mesh.surface))))


def cut() -> Bundle:
    mesh = sensor_bundle().mesh
    return replace(sensor_bundle(), mesh=replace(mesh, fill=np.ones(mesh.occupancy.shape)))


def motion(depth_mm: float) -> np.ndarray:
    return np.array([[0.1, 0.0, 0.0], [0.0, 0.0, -depth_mm]])


def test_auto_takes_the_law_by_the_depth_of_the_frame() -> None:
    gel = GelLaw.of(sensor_bundle(), "auto")
    assert (gel.law, gel.fallback) == ("auto", "")
    assert gel.deep_mm == pytest.approx(TENTH_MM)
    assert gel.at(motion(0.9 * TENTH_MM)) == {"law": "linear", "deep": False}
    assert gel.at(motion(1.1 * TENTH_MM)) == {"law": "neo_hookean", "deep": True}
    assert gel.at(motion(np.nan)) == {"law": "linear", "deep": None}
    assert gel.at(motion(0.5), by_linear_law=True) == {"law": "linear", "deep": True}


@pytest.mark.parametrize("asked", ["linear", "neo_hookean"])
def test_a_law_that_is_asked_for_holds_at_every_depth(asked: str) -> None:
    gel = GelLaw.of(sensor_bundle(), asked)
    assert {gel.at(motion(depth))["law"] for depth in (0.0, 0.5, np.nan)} == {asked}
    assert gel.fallback == ""


def test_pads_without_a_neo_hookean_law_have_different_reasons() -> None:
    found = [GelLaw.of(bundle, "auto") for bundle in (crowned(), cut())]
    assert all(gel.law == "linear" and gel.record()["fallback"] for gel in found)
    assert found[0].fallback != found[1].fallback
    assert found[0].at(motion(0.5)) == {"law": "linear", "deep": True}
    assert all(gel.fallback in " ".join(GelUse(1).sentences(gel)) for gel in found)


def test_sentences_tell_what_was_used_and_only_that() -> None:
    bundle = sensor_bundle()
    mixed = GelUse(linear=3, neo_hookean=2)
    auto, linear = (GelLaw.of(bundle, law) for law in ("auto", "linear"))
    assert len(mixed.sentences(auto)) == 2
    assert len(GelUse(linear=5).sentences(linear)) == 1
    assert len(GelUse(linear=5, deep_linear=1).sentences(linear)) == 2
    assert "--gel auto" in GelUse(linear=5, deep_linear=1).sentences(linear)[1]
    instead = GelUse(linear=5, deep_linear=1).sentences(auto)
    assert len(instead) == 4
    assert "give --gel auto" not in " ".join(instead)
    assert GelUse().sentences(linear) == ()
    unseen = GelLaw.of(bundle, "auto", depth_seen=False)
    assert GelUse(5).sentences(unseen) != GelUse(5).sentences(auto)


def test_presses_are_all_by_the_linear_law_of_a_layer() -> None:
    layer = GelLaw.of_layer(2.0)
    assert layer.deep_mm == pytest.approx(TENTH_MM)
    depths = np.array([0.05, 0.15, 0.25, 0.6])
    use = GelUse.of_depths(layer, depths)
    counts = {"linear": 4, "neo_hookean": 0, "deep_linear": 2}
    assert layer.record_of(use, "presses") == {
        "asked": "linear", "law": "linear", "fallback": None, "presses": counts,
    }  # fmt: skip
    one, deep = use.sentences(layer, "presses")
    assert "linear in 4 presses" in one
    assert "2 presses" in deep
    assert "deviation" not in deep
    assert "--gel" not in deep
    (alone,) = GelUse.of_depths(layer, depths[:1]).sentences(layer, "presses")
    assert "linear in 1 press." in alone
    by_frame = GelUse()
    for depth in depths:
        by_frame.add(layer.at(motion(depth)))
    assert by_frame == use


def test_a_run_counts_the_frames_of_each_law(tmp_path: Path) -> None:
    """The depth is given, so that the same picture is a shallow and a deep contact."""
    picture = frame(0.0).image
    bundle = sensor_bundle()
    settings = PipelineSettings(gel="auto")
    pipeline = ForcePipeline(bundle, calibrate(bundle, picture), settings)
    away = np.hypot(*pipeline.points_mm[:, :2].T)
    dent = -np.exp(-((away / 2.0) ** 2))
    summary = RunSummary()
    with RunRecorder(tmp_path / "run") as recorder:
        for depth_mm in (0.0, 0.1, 0.25):
            result = pipeline.process(picture, normal_mm=depth_mm * dent)
            summary.add(result)
            recorder.append(result)
    assert summary.gel == GelUse(linear=2, neo_hookean=1)
    manifest = json.loads((tmp_path / "run" / "run.json").read_text())
    assert manifest["counts"]["gel"] == {"linear": 2, "neo_hookean": 1, "deep_linear": 0}
    assert live_state(result)["gel"] == {"law": "neo_hookean", "deep": True}
