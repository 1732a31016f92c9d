"""`gelslim light`: words, JSON, pictures whole or not at all."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gelslim.cli import main

SPEC = str(Path(__file__).parents[2] / "designs" / "gelslim2.yaml")
FEW = ("--rays", "4096")


def test_the_ledger_is_sorted_and_pictures_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    assert main(["light", SPEC, "-o", str(tmp_path / "light"), *FEW]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "4096 rays" in said
    assert str(tmp_path / "light") in said
    names = {p.name for p in (tmp_path / "light").iterdir()}
    assert names == {"light_paths.png", "irradiance.png", "light_ratio.png"}
    assert "0.00%" not in said
    ledger = said.partition("4096 rays")[2].partition("64th")[0]
    shares = [float(s) for s in re.findall(r"([\d.]+)% [\d.]+% to", ledger)]
    assert len(shares) > 5
    assert shares[1:] == sorted(shares[1:], reverse=True)


def test_json_without_pictures_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "none"
    assert main(["light", SPEC, "--json", "--no-pictures", "-o", str(folder), *FEW]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["guides"]["curved"]["ledger_gap"] < 1e-12
    assert not folder.exists()


def test_the_same_seed_gives_the_same_answer(capsys: pytest.CaptureFixture[str]) -> None:
    answers = []
    for seed in ("1", "1", "2"):
        main(["light", SPEC, "--json", "--no-pictures", "--seed", seed, *FEW])
        answers.append(capsys.readouterr().out)
    assert answers[0] == answers[1] != answers[2]
