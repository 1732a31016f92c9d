"""`gelslim validate` with a budget: which operator the validation is handed, and refusals."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from cli_samples import ROOT

from accuracy_budget.budget import Budget
from gelslim_cad.cli.main import main
from gelslim_force.pipeline_settings import PipelineSettings
from gelslim_twin.simulation.twin_sensor import TwinSensor
from gelslim_twin.validation import validate as validation

SPEC = str(ROOT / "designs" / "mini20.yaml")


@pytest.mark.slow
def test_the_operator_of_the_budget_is_what_our_chains_start_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The experiment takes minutes: here it only answers which sensor it was given."""
    given: list[TwinSensor] = []

    def caught(sensor: TwinSensor, *_: object) -> SimpleNamespace:
        given.append(sensor)
        return SimpleNamespace(to_record=lambda: {"markers": len(sensor.grid)})

    monkeypatch.setattr(validation, "validate", caught)
    out = ("-o", str(tmp_path / "v"), "--no-pictures", "--json")
    assert main(["validate", SPEC, *out]) == 0
    assert "operator" not in json.loads(capsys.readouterr().out)
    assert main(["validate", SPEC, *out, "--error", "15%"]) == 0
    said = capsys.readouterr()
    label = json.loads(said.out)["operator"]
    bare, chosen = (sensor.bundle for sensor in given)
    assert bare.ladder is None
    assert chosen.ladder is not None
    assert label == chosen.ladder.choose(Budget(0.15)).rung.name == chosen.operator
    rung = chosen.ladder.named(label)
    assert rung is not None
    assert PipelineSettings().operator(chosen).name == rung.rung
    assert rung.error_field <= 0.15
    # The cheapest within 15 % is not what it starts with without a budget.
    assert rung.rung != PipelineSettings().operator(bare).name
    assert json.loads((tmp_path / "v" / "validation.json").read_text())["operator"] == label
    assert main(["validate", SPEC, *out, "--error", "15%", "--time", "1us"]) == 2
    told = json.loads(capsys.readouterr().out)["message"]
    assert "on the side of time" in told
    assert "on the side of error" in told
    assert len(given) == 2


def test_words_that_are_no_budget_are_refused_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for wrong in (("--error", "much"), ("--error", "3"), ("--time", "-1s"), ("--time", "5h")):
        assert main(["validate", SPEC, "-o", str(tmp_path / "v"), *wrong]) == 2
        said = capsys.readouterr().err
        assert said.startswith(wrong[0])
        assert "Traceback" not in said
    assert not (tmp_path / "v").exists()
