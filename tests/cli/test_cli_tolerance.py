"""`gelslim tolerance`: its answers for people and programs, and its exit status."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_samples import MINI20

from gelslim.cli import main

FEW = ("--samples", "128", "--least-yield")


def unprepared(folder: Path, name: str) -> Path:
    """A design as it falls into its clamp, of acrylic as bought."""
    text = MINI20.with_name(f"{name}.yaml").read_text(encoding="utf-8")
    path = folder / f"{name}.yaml"
    path.write_text(text.split("tolerance:")[0], encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_answer_for_programs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    design = str(unprepared(tmp_path, "mini20"))
    assert main(["tolerance", design, *FEW, "0.8", "--json", "--seed", "3"]) == 1
    record = json.loads(capsys.readouterr().out)
    assert record["format"] == "gelslim-tolerance/1"
    assert (record["samples"], record["seed"], record["assembly"]) == (128, 3, "as_built")
    assert set(record["yields"]) == {"as_built", "adjusted"}
    everything = record["yields"]["adjusted"]["all"]
    assert everything["low"] < everything["yield"] < everything["high"]
    assert all({"field", "source", "distribution", "spread"} <= set(c) for c in record["causes"])
    assert len(record["forces"]) == 4
    assert record["worst_rule"] == "coverage.along"
    worst = next(v for v in record["variance"] if v["place"].startswith("coverage.along"))
    assert max(worst["total"], key=worst["total"].get) == "camera in its clamp"


def test_the_answer_for_people_and_the_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tolerance", str(MINI20), *FEW, "0.8"]) == 0
    out = capsys.readouterr().out
    assert "adjusted" in out
    assert "design.housing.camera_play_mm" in out or "tolerance." in out


@pytest.mark.slow
def test_the_changed_spec_is_written_and_has_the_yield(tmp_path: Path) -> None:
    better = tmp_path / "better.yaml"
    design = str(unprepared(tmp_path, "long50"))
    few = ("--samples", "256", "--least-yield", "0.9")
    assert main(["tolerance", design, *few, "--save", str(better)]) == 1
    assert main(["tolerance", str(better), *few]) == 0
    other = tmp_path / "notes.txt"
    other.write_text("mine", encoding="utf-8")
    assert main(["tolerance", design, *few, "--save", str(other)]) == 2
    assert other.read_text(encoding="utf-8") == "mine"


def test_too_few_samples_are_bad_input() -> None:
    assert main(["tolerance", str(MINI20), "--samples", "3"]) == 2
