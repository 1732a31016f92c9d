"""Outputs that are there already and of other origin stay as they are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sweep_commands import MINI20

from gelslim_cad.build.folder import OutputError, require_ours
from gelslim_cad.cli import main
from gelslim_force.outputs.output_error import OutputError as RunError
from gelslim_force.outputs.run_recorder import RunRecorder
from gelslim_twin.simulation.run_folder import RunFolder, SimulationError


def holding(folder: Path, name: str, content: object) -> Path:
    folder.mkdir()
    (folder / name).write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize("content", [{"format": "gelslim-bundle/1"}, {"name": "an app"}, [1]])
def test_a_manifest_of_another_program_is_no_build(content: object, tmp_path: Path) -> None:
    folder = holding(tmp_path / "out", "manifest.json", content)
    with pytest.raises(OutputError, match="no build wrote"):
        require_ours(folder)


def test_a_build_is_no_bundle(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = holding(tmp_path / "out", "manifest.json", {"format": "gelslim-build/1"})
    assert main(["bundle", str(MINI20), "--no-ladder", "-o", str(folder)]) == 2
    assert "is not a bundle" in capsys.readouterr().err
    assert [p.name for p in folder.iterdir()] == ["manifest.json"]


def test_a_run_does_not_take_a_simulations_place(tmp_path: Path) -> None:
    folder = holding(tmp_path / "out", "run.json", {"format": "gelslim-simulation/1"})
    before = (folder / "run.json").read_bytes()
    with pytest.raises(RunError, match="gelslim-run/1"):
        RunRecorder(folder, overwrite=True)
    assert (folder / "run.json").read_bytes() == before


def test_a_second_run_in_one_folder_is_told(tmp_path: Path) -> None:
    with (
        RunRecorder(tmp_path / "out"),
        pytest.raises(RunError, match="another process is writing"),
    ):
        RunRecorder(tmp_path / "out", overwrite=True)
    assert not (tmp_path / "out" / ".lock").exists()


def test_a_simulation_killed_at_its_start_goes_on(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    (folder / "frames").mkdir(parents=True)
    (folder / "states").mkdir()
    (folder / ".0123456789abcdef.part").write_bytes(b"{")
    RunFolder.opened(folder, "key")
    (folder / "states" / "mine.txt").write_text("mine")
    with pytest.raises(SimulationError, match="not empty"):
        RunFolder.opened(folder, "key")


@pytest.mark.parametrize(
    "words",
    ["schema -o {file}", "optimise {spec} --vary gel.length_mm=18,20 --save {file}",
     "markers {spec} -o {folder}"],
)  # fmt: skip
def test_files_of_the_users_are_not_written_over(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "markers.svg"
    mine.write_text("mine")
    filled = words.replace("{spec}", str(MINI20)).replace("{file}", str(mine))
    assert main(filled.replace("{folder}", str(tmp_path)).split()) == 2
    assert "markers.svg" in capsys.readouterr().err
    assert mine.read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["markers.svg"]
