"""`gelslim grippers`, and specs that `gelslim new --gripper` writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim_cad.spec.gripper_library import gripper_names, library_gripper
from gelslim_cad.spec.reader import read_spec

Capture = pytest.CaptureFixture[str]


def test_the_list_has_a_row_for_each_gripper_that_fits_a_narrow_terminal(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["grippers"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in gripper_names():
        row = next(line for line in lines if line.startswith(name))
        assert library_gripper(name).jaw.bolt in row.split()
    assert main(["grippers", "--json"]) == 0
    rows = {row["key"]: row for row in json.loads(capsys.readouterr().out)}
    assert tuple(rows) == gripper_names()
    assert rows["robotiq_2f85"]["force_n"] == [20, 235]
    assert rows["generic"]["stroke_mm"] is None


@pytest.mark.parametrize("name", gripper_names())
def test_one_gripper_is_shown_with_every_figure_and_source(
    name: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "110")
    assert main(["grippers", name]) == 0
    shown, entry = capsys.readouterr().out, library_gripper(name)
    assert all(figure in shown for figure in entry.figures)
    assert all(source.text.split()[0] in shown for source in entry.sources)
    assumed = sum(len(s.gives) for s in entry.sources if s.assumed)
    assert shown.count("] assumed") == assumed + sum(s.assumed for s in entry.sources)
    assert main(["grippers", name, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["jaw"]["bolt"] == entry.jaw.bolt


def test_an_unknown_gripper_is_bad_input_and_nothing_is_written(
    tmp_path: Path, capsys: Capture
) -> None:
    assert main(["grippers", "wsg51"]) == 2
    assert "wsg50" in capsys.readouterr().err
    target = tmp_path / "mine.yaml"
    assert main(["new", "mine", "--gripper", "wsg51", "-o", str(target)]) == 2
    assert main(["new", "mine", "--gripper", "wsg50", "--from", "thin", "-o", str(target)]) == 2
    assert not target.exists()


def test_a_new_spec_takes_the_gripper_and_check_judges_it(tmp_path: Path, capsys: Capture) -> None:
    target = tmp_path / "mine.yaml"
    assert main(["new", "mine", "--gripper", "franka_hand", "-o", str(target)]) == 0
    assert read_spec(target).spec.design.mount.gripper == "franka_hand"
    capsys.readouterr()
    assert main(["check", str(target), "--json"]) in (0, 1)
    told = {c["id"]: c["status"] for c in json.loads(capsys.readouterr().out)["checks"]}
    assert (told["object.size_mm"], told["flange.measured"]) == ("pass", "warn")
