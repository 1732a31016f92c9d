"""The rays' ladder against light traced with many more rays; budgets through the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gelslim.cli import main
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light import ray_ladder
from gelslim_cad.light.ray_ladder import (
    BEYOND,
    SEEDS,
    TRACED,
    RayErrors,
    _rising,
    half_widths,
    measure_errors,
    rays_of,
    rung_name,
    times_key,
)
from gelslim_cad.light.scene import light_scene
from gelslim_cad.light.study import study_light
from gelslim_cad.sensor import spec_hash
from gelslim_cad.spec.reader import read_spec
from gelslim_core.budget.budget import Budget, BudgetError
from gelslim_core.budget.machine_times import read_times, write_times
from gelslim_optics.light.trace import trace_light

SPEC = str(Path(__file__).parents[2] / "designs" / "gelslim2.yaml")
JSON = ("--json", "--no-pictures")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GELSLIM_CACHE_DIR", str(tmp_path / "cache"))


@pytest.fixture(scope="module")
def finger() -> Dimensions:
    return derive(read_spec(Path(SPEC)).spec)


@pytest.fixture(scope="module")
def errors(finger: Dimensions) -> RayErrors:
    return measure_errors(finger)


@pytest.mark.slow
@pytest.mark.parametrize("colour", ["red", "green"])
def test_errors_hold_against_many_more_rays(
    finger: Dimensions, errors: RayErrors, colour: str
) -> None:
    scene = light_scene(finger, guide_profile(finger))
    true = trace_light(scene, 1 << 18, seed=77).arrived(colour).value
    for rays in (1 << 11, 1 << 13):
        seeds = range(40)
        assert not set(seeds) & set(SEEDS)
        off = [
            abs(trace_light(scene, rays, seed=s).arrived(colour).value / true - 1) for s in seeds
        ]
        # A half-width of 95 %: of 40 draws, 2 outside on average; 7 are less than 1 in 100.
        assert sum(o > errors.halves[rays] for o in off) < 7
        # And it is no idle margin: about two standard deviations.
        assert 1.2 < errors.halves[rays] / float(np.sqrt(np.mean(np.square(off)))) < 5


def test_the_very_rays_of_the_answer_keep_the_error_they_were_chosen_for(
    finger: Dimensions, errors: RayErrors
) -> None:
    """Other seeds alone promised 4.4 % for rays that then said 6.9 % of themselves."""
    scene = light_scene(finger, guide_profile(finger))
    for rays in TRACED[:4]:
        assert max(half_widths(trace_light(scene, rays, seed=0))) <= errors.halves[rays]


def test_errors_fall_and_go_on_with_the_square_root(errors: RayErrors) -> None:
    rungs = errors.ladder({}).rungs
    halves = [r.error for r in rungs]
    assert halves == sorted(halves, reverse=True)
    assert [rays_of(r) for r in rungs] == [*TRACED, *BEYOND]
    assert rungs[-1].error == pytest.approx(errors.halves[TRACED[-1]] * 2**-5.5)
    assert [r.measured for r in rungs] == [True] * len(TRACED) + [False] * len(BEYOND)
    slope = np.polyfit(np.log(TRACED), np.log([errors.halves[r] for r in TRACED]), 1)[0]
    assert -0.75 < slope < -0.45


def test_times_go_on_with_the_rays(errors: RayErrors) -> None:
    times = {rung_name(r): 1e-2 * r for r in TRACED}
    for rung in errors.ladder(times).rungs:
        assert rung.time_ms == pytest.approx(1e-2 * rung.work)


def test_fewer_rays_never_count_as_slower() -> None:
    assert _rising({"a": 9.0, "b": 2.0, "c": 3.0}) == {"a": 2.0, "b": 2.0, "c": 3.0}


def light(capsys: pytest.CaptureFixture[str], *more: str) -> tuple[dict, str]:
    assert main(["light", SPEC, *JSON, *more]) == 0
    said = capsys.readouterr()
    return json.loads(said.out), said.err


@pytest.mark.slow
def test_an_error_picks_the_rays_whatever_the_clock_says(
    errors: RayErrors, capsys: pytest.CaptureFixture[str]
) -> None:
    expected = rays_of(errors.ladder({}).choose(Budget(0.03)).rung)
    first, said = light(capsys, "--error", "3%")
    assert said == ""
    assert first["guides"]["curved"]["rays"] == expected
    key = times_key(spec_hash(read_spec(Path(SPEC)).spec))
    assert read_times(key) == {}
    write_times(key, {rung_name(r): 1e6 / r for r in TRACED})
    again, _ = light(capsys, "--error", "3%")
    assert again == first


@pytest.mark.slow
def test_an_answer_keeps_the_error_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    asked = 0.05
    found, said = light(capsys, "--error", f"{asked}", "--seed", "3")
    for told in found["guides"]["curved"]["by_colour"].values():
        arrived = told["arrived"]
        assert (arrived["high"] - arrived["low"]) / 2 <= asked * arrived["value"]
    assert "came out" not in said


def test_extrapolated_rays_that_miss_are_told(
    finger: Dimensions, capsys: pytest.CaptureFixture[str]
) -> None:
    from gelslim.cli.commands.trial.light import _note_missed

    study = study_light(finger, rays=2048, curve=False)
    half = max(half_widths(study.light))
    _note_missed(study, Budget(half))
    assert capsys.readouterr().err == ""
    _note_missed(study, Budget(half / 2))
    said = capsys.readouterr().err
    assert f"{100 * half:.3g} % with 2048 rays" in said
    assert "--rays 4096" in said


@pytest.fixture
def known_errors(errors: RayErrors, monkeypatch: pytest.MonkeyPatch) -> None:
    """The errors as measured once; they do not know of times."""
    monkeypatch.setattr(ray_ladder, "measure_errors", lambda d, seed, tell: errors)


@pytest.mark.usefixtures("known_errors")
def test_a_time_uses_this_machines_times(capsys: pytest.CaptureFixture[str]) -> None:
    key = times_key(spec_hash(read_spec(Path(SPEC)).spec))
    write_times(key, {rung_name(r): float(r) for r in TRACED})
    found, said = light(capsys, "--time", "5s")
    assert found["guides"]["curved"]["rays"] == 4096
    assert said == ""
    assert main(["light", SPEC, *JSON, "--error", "0.5%", "--time", "5s"]) == 2
    told = json.loads(capsys.readouterr().out)["message"]
    assert "no number of rays keeps the budget" in told
    assert "4096 rays" in told
    assert "in time" in told
    assert "in error" in told


@pytest.mark.usefixtures("known_errors")
def test_a_time_without_calibration_measures_and_keeps_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    measured = {rung_name(r): float(r) for r in TRACED}
    monkeypatch.setattr(ray_ladder, "measure_times", lambda d, tell: measured)
    found, said = light(capsys, "--time", "3s")
    assert found["guides"]["curved"]["rays"] == 2048
    assert said == ""
    assert read_times(times_key(spec_hash(read_spec(Path(SPEC)).spec))) == measured


def test_rays_beyond_the_calibration_are_said(errors: RayErrors) -> None:
    finest = errors.halves[TRACED[-1]]
    choice = errors.ladder({}).choose(Budget(finest / 1.3))
    assert rays_of(choice.rung) == BEYOND[0]
    assert "outside the calibrated range" in choice.remarks[0]
    with pytest.raises(BudgetError):
        errors.ladder({}).choose(Budget(finest / 1000))


def test_rays_and_budget_together_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["light", SPEC, "--rays", "2048", "--error", "3%"]) == 2
    assert "not both" in capsys.readouterr().err
    assert main(["light", SPEC, "--error", "3"]) == 2
    assert "for 3 per cent write 3%" in capsys.readouterr().err
