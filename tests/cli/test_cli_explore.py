"""`gelslim explore` and `optimise` from the command line."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_samples import MINI20, ROOT, fresh

from gelslim.cli import main
from gelslim_core.optional_library import install_command

VARY = ["--vary", "gel.length_mm=16:24:4", "--vary", "camera.f_number=2,4"]


@pytest.mark.slow
def test_table_pictures_and_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    folder = tmp_path / "ein Raum ä"
    command = ["explore", str(MINI20), *VARY, "-o", str(folder), "-j", "1"]
    assert main(command) == 0
    shown = capsys.readouterr().out
    assert "finger.thickness_mm" in shown
    with open(folder / "designs.csv", encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 6
    feasible = [r for r in rows if r["status"] == "feasible"]
    for name in ("pareto.png", "feasibility.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    before = {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}
    assert main([*command, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["feasible"] == len(feasible) > 0
    assert answer["tasks"] == {"done": 0, "taken_over": 1}
    assert sum(answer["binding"].values()) == 6 - len(feasible)
    thinnest = min(feasible, key=lambda r: float(r["finger.thickness_mm"]))
    assert int(thinnest["design"]) in answer["pareto"]["view.keystone"]
    assert before == {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}


@pytest.mark.parametrize(
    ("vary", "word"),
    [
        (["--vary", "gel.lenght_mm=1,2"], "design.gel.length_mm"),
        (["--vary", "gel.length_mm=1:2"], "1:2"),
        ([], "--vary"),
        (["--vary", "gel.length_mm=16", "--column", "finger.x"], "finger.x"),
        (["--vary", "gel.length_mm=16", "--jobs", "0"], "--jobs"),
    ],
)
@pytest.mark.parametrize("command", ["explore", "optimise"])
def test_bad_requests(
    command: str, vary: list[str], word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if command == "optimise" and "--column" in vary:
        pytest.skip("optimise has no --column")
    assert main([command, str(MINI20), *vary, "-o", str(tmp_path / "x")]) == 2
    captured = capsys.readouterr()
    assert word in captured.err
    assert "Traceback" not in captured.err
    assert not (tmp_path / "x").exists()


def test_without_parquet_and_pictures_the_table_is_still_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gelslim_core.optional_library.installed", lambda module: False)
    command = ["explore", str(MINI20), "--vary", "gel.length_mm=16", "-o", str(tmp_path / "x")]
    assert main(command) == 0
    captured = capsys.readouterr()
    assert install_command("record") in captured.err
    assert install_command("plot") in captured.err
    assert sorted(p.name for p in (tmp_path / "x").iterdir() if p.is_file()) == [
        "designs.csv",
        "explore.json",
    ]


@pytest.mark.slow
def test_optimise_saves_a_spec_that_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    best = tmp_path / "best.yaml"
    command = ["optimise", str(MINI20), *VARY, "-o", str(tmp_path / "x"), "-j", "1"]
    assert main([*command, "--rounds", "1", "--save", str(best)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "design.gel.length_mm: 16" in shown
    assert "17.64 mm" in shown
    assert "400 mm² 320 mm² -20.0 % worse" in shown
    assert main(["check", str(best)]) == 0
    capsys.readouterr()
    assert (
        main(["optimise", str(MINI20), "--vary", "gel.length_mm=60", "-o", str(tmp_path / "y")])
        == 1
    )
    assert capsys.readouterr().err


def test_a_read_only_place_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("x")
    command = ["explore", str(MINI20), "--vary", "gel.length_mm=16"]
    assert main([*command, "-o", str(tmp_path / "file")]) == 2
    assert str(tmp_path / "file") in capsys.readouterr().err
    assert main([*command, "-o", str(tmp_path / "file" / "x")]) == 2
    assert str(tmp_path / "file") in capsys.readouterr().err


def test_a_full_disk_is_told_and_nothing_is_half_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.replace

    def full(source: str, target: Path) -> None:
        if "designs-" in str(target):
            raise OSError(28, "No space left on device", str(target))
        real(source, target)

    monkeypatch.setattr("os.replace", full)
    command = ["explore", str(MINI20), *VARY, "-o", str(tmp_path / "x"), "-j", "1"]
    assert main(command) == 2
    assert "designs-" in capsys.readouterr().err
    assert not list((tmp_path / "x" / "chunks").iterdir())
    monkeypatch.undo()
    assert main(command) == 0


@pytest.mark.slow
def test_two_runs_on_one_folder_wait_for_each_other(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "gelslim", "explore", str(MINI20)]
    command += ["--vary", "gel.length_mm=16:24:0.01", "-o", str(tmp_path / "x"), "-j", "1"]
    runs = [
        subprocess.Popen([*command, "--no-pictures", "--json"], cwd=ROOT, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    answers = [json.loads(run.communicate(timeout=120)[0]) for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    assert sorted(a["tasks"]["done"] for a in answers) == [0, 2]
    assert answers[0]["pareto"] == answers[1]["pareto"]


@pytest.mark.skipif(sys.platform == "win32", reason="bash completion")
def test_completion_answers_without_a_traceback() -> None:
    asked = {"_GELSLIM_COMPLETE": "complete_bash", "COMP_CWORD": "1"}
    done = fresh(COMP_WORDS="gelslim opt", **asked)
    assert (done.returncode, done.stdout.split()) == (0, ["optimise"])
    # Else the shell is sought among the parents, which are none under some schedulers.
    done = fresh("--show-completion", "bash", _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert done.returncode == 0
    assert "complete" in done.stdout
    assert "unexpected" not in done.stderr
