"""`gelslim validate` with a budget: which operator the validation is handed, and refusals."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from cli_samples import ROOT

sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from sensor_samples import sensor_bundle

from gelslim.cli.main import main
from gelslim_core.budget.budget import Budget
from gelslim_force.settings import PipelineSettings
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.validation import validate as validation
from gelslim_twin.validation.validate import chains_for
from ifem_export.operators.condensed_operators import CondensedOperator

SPEC = str(ROOT / "designs" / "mini20.yaml")


@dataclass(frozen=True)
class Answer:
    """In place of a `Validation`."""

    operator: str = ""
    remarks: tuple[str, ...] = ()

    def to_record(self) -> dict[str, object]:
        record: dict[str, object] = {"format": "gelslim-validation/1"}
        return record | ({"operator": self.operator} if self.operator else {})


@pytest.mark.slow
def test_the_operator_of_the_budget_is_what_our_chains_start_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The experiment takes minutes: here it only answers which sensor it was given."""
    given: list[TwinSensor] = []
    budgets: list[object] = []

    def caught(sensor: TwinSensor, *more: object) -> Answer:
        given.append(sensor)
        budgets.append(more[-1])
        return Answer()

    monkeypatch.setattr(validation, "validate", caught)
    out = ("-o", str(tmp_path / "v"), "--no-pictures", "--json")
    assert main(["validate", SPEC, *out]) == 0
    assert "operator" not in json.loads(capsys.readouterr().out)
    assert main(["validate", SPEC, *out, "--error", "15%"]) == 0
    said = capsys.readouterr()
    label = json.loads(said.out)["operator"]
    assert budgets == [Budget(), Budget(0.15)]
    bare, chosen = (sensor.bundle for sensor in given)
    assert bare.ladder is None
    assert chosen.ladder is not None
    assert label == chosen.ladder.choose(Budget(0.15)).rung.name == chosen.operator
    rung = chosen.ladder.named(label)
    assert rung is not None
    assert PipelineSettings().operator(chosen).name == rung.rung
    assert rung.error_field <= 0.15
    # The cheapest within 15 % is not what it starts with without a budget.
    by_default = PipelineSettings().operator(bare)
    assert isinstance(by_default, CondensedOperator)
    assert rung.rung != by_default.name or rung.parameters["rtol"] > by_default.rtol
    assert json.loads((tmp_path / "v" / "validation.json").read_text())["operator"] == label
    assert main(["validate", SPEC, *out, "--error", "15%", "--time", "1us"]) == 2
    message = json.loads(capsys.readouterr().out)["message"]
    assert "15 %" in message
    assert len(given) == 2


def test_our_chains_take_the_budget_and_the_papers_its_operator() -> None:
    bundle, asked = sensor_bundle(), Budget(0.02, 3.0)
    for chain in chains_for(bundle, asked):
        paper = chain.name.startswith("paper")
        assert chain.settings.budget == (None if paper else asked)
        assert chain.settings.rung == ("paper" if paper else None)
    assert all(c.settings.budget is None for c in chains_for(bundle))


def test_words_that_are_no_budget_are_refused_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for wrong in (("--error", "much"), ("--error", "3"), ("--time", "-1s"), ("--time", "5h")):
        assert main(["validate", SPEC, "-o", str(tmp_path / "v"), *wrong]) == 2
        said = capsys.readouterr().err
        assert said.startswith(wrong[0])
        assert "Traceback" not in said
    assert not (tmp_path / "v").exists()
