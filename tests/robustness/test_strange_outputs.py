"""Outputs that are there already and of other origin stay as they are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sweep_commands import MINI20

from gelslim.cli import main
from gelslim.cli.commands.trial.validate import PLOTS, picture_name, picture_names
from gelslim.scene_sensor import spec_bundle
from gelslim_cad.build.folder import require_ours
from gelslim_core.errors import OutputError
from gelslim_force.outputs.run_recorder import RunRecorder
from gelslim_twin.simulation.run_folder import RunFolder, SimulationError
from gelslim_twin.simulation.sensor import TwinSensor, store_sensor
from gelslim_twin.validation.experiment import other_contacts, sphere_experiment


def holding(folder: Path, name: str, content: object) -> Path:
    folder.mkdir()
    (folder / name).write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize("content", [{"format": "gelslim-bundle/1"}, {"name": "an app"}, [1]])
def test_a_manifest_of_another_program_is_no_build(content: object, tmp_path: Path) -> None:
    folder = holding(tmp_path / "out", "manifest.json", content)
    with pytest.raises(OutputError, match="out"):
        require_ours(folder)


def test_a_build_is_no_bundle(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = holding(tmp_path / "out", "manifest.json", {"format": "gelslim-build/1"})
    assert main(["bundle", str(MINI20), "--no-ladder", "-o", str(folder)]) == 2
    assert "is not a bundle" in capsys.readouterr().err
    assert [p.name for p in folder.iterdir()] == ["manifest.json"]


def test_a_run_does_not_take_a_simulations_place(tmp_path: Path) -> None:
    folder = holding(tmp_path / "out", "run.json", {"format": "gelslim-simulation/1"})
    before = (folder / "run.json").read_bytes()
    with pytest.raises(OutputError, match="gelslim-run/1"):
        RunRecorder(folder, overwrite=True)
    assert (folder / "run.json").read_bytes() == before


def test_a_second_run_in_one_folder_is_told(tmp_path: Path) -> None:
    with (
        RunRecorder(tmp_path / "out"),
        pytest.raises(OutputError, match="another process is writing"),
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


@pytest.mark.parametrize("name", ["validation.json", "fields.png", "punch_and_twist.png"])
def test_pictures_of_others_stop_a_validation_before_it_starts(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text("mine")
    assert main(["validate", str(MINI20), "-o", str(tmp_path)]) == 2
    assert name in capsys.readouterr().err
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(name, "mine")]


def test_every_picture_of_a_validation_was_looked_for() -> None:
    sensor = TwinSensor(spec_bundle(MINI20, with_light=False))
    mesh = sensor.bundle.mesh
    thickness = mesh.layers * mesh.cell_size_mm[2]
    slides = len(sphere_experiment(thickness, *sensor.size_mm).tests)
    names = [f"slide {slides}", *(c.name for c in other_contacts(thickness, *sensor.size_mm))]
    assert picture_names(sensor) == [*PLOTS, *(picture_name(name) for name in names)]


@pytest.mark.parametrize("name", ["sensor.json"])
def test_a_sensor_spares_files_of_others(name: str, tmp_path: Path) -> None:
    sensor = TwinSensor(spec_bundle(MINI20, with_light=False))
    (tmp_path / name).write_text("mine")
    with pytest.raises(SimulationError, match=f"{name} of other origin"):
        store_sensor(sensor, tmp_path)
    assert (tmp_path / name).read_text() == "mine"
    assert {p.name for p in tmp_path.iterdir()} <= {name, ".lock"}
