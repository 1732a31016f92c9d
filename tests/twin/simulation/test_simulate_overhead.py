"""What is done once per simulation is not done per frame: calls counted, no clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sim_rig import SCENE, small_sensor

from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning import planner
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.scene.scene import Effects
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.simulation.simulate import simulate
from ifem_export.bundle.files import load_bundle


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("overhead")
    small_sensor(place)
    return place


def counted(calls: Counter[str], name: str, real: Callable[..., Any]) -> Callable[..., Any]:
    def call(*args: Any, **more: Any) -> Any:
        calls[name] += 1
        return real(*args, **more)

    return call


def simulated(folder: Path, out: Path, steps: int, monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Calls of what one simulation needs once, at `steps` poses of the press."""
    path = folder / f"scene_{steps}.yaml"
    text = SCENE.format(bundle=folder / "bundle")
    assert "depth_mm: 0.3, steps: 4" in text
    path.write_text(text.replace("depth_mm: 0.3, steps: 4", f"depth_mm: 0.3, steps: {steps}"))
    calls: Counter[str] = Counter()
    with monkeypatch.context() as patch:
        for owner, name in (
            (Effects, "parameters"), (Plan, "to_record"), (Viewer, "frame"),
        ):  # fmt: skip
            patch.setattr(owner, name, counted(calls, name, getattr(owner, name)))
        loaded, sensor = read_scene(path), TwinSensor(load_bundle(folder / "bundle"))
        simulate(job_of(loaded, sensor, folder), out)
    return calls


@pytest.mark.slow
def test_parameters_and_plans_json_are_not_made_again_per_frame(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = simulated(folder, tmp_path / "few", 2, monkeypatch)
    many = simulated(folder, tmp_path / "many", 9, monkeypatch)
    assert many.pop("frame") == few.pop("frame") + 7
    assert many["to_record"] == few["to_record"] == 1
    # A plan of more poses may be made once more.
    assert max(many["parameters"], few["parameters"]) <= 4


def test_each_bound_and_ladder_is_worked_out_once_per_plan(folder: Path) -> None:
    path = folder / "scene.yaml"
    path.write_text(SCENE.format(bundle=folder / "bundle"))
    asked = question(read_scene(path), bundle_figures(folder / "bundle"))
    calls: Counter[str] = Counter()
    effects = [
        replace(
            e,
            bound=counted(calls, f"bound {e.name}", e.bound),
            ladder=counted(calls, f"ladder {e.name}", e.ladder),
        )
        for e in EFFECTS
    ]
    assert planner.make_plan(asked, effects) == planner.make_plan(asked)
    assert calls
    assert set(calls.values()) == {1}
