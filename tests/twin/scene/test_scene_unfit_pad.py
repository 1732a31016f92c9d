"""Scenes that want large strain of a pad that has none: refused on the scene's line."""

from __future__ import annotations

from pathlib import Path

import pytest
from sim_rig import write_sensor, written_scene

from gelslim.cli.main import main
from gelslim_core.yaml.errors import InputError
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor
from gelslim_twin.simulation.simulate import SimulationJob
from ifem_export.bundle.files import load_bundle
from ifem_export.markers.grid import build_marker_grid
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

PADS = {
    "crowned": (Paraboloid(0.4, 9.0), 8.0, "crown_height_mm"),
    "cut": (None, 8.3, "mesh.weighting"),
    "flat": (None, 8.0, ""),
}
UNFIT = ("crowned", "cut")


@pytest.fixture(scope="module", params=PADS)
def pad(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder named after the pad, its bundle within."""
    crown, size, _ = PADS[request.param]
    mesh, _ = build_pad_mesh(
        RoundedRectangle(size, size, 1.0), 2.0, cells=(8, 8, 2), crown=crown,
        weighting="cell_centre" if request.param == "flat" else "volume_fraction",
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("pad") / request.param
    folder.mkdir()
    write_sensor(folder / BUNDLE, mesh, build_marker_grid(5, 5, 1.1, 0.5, anchors="odd_sized"))
    return folder


def scene(folder: Path, use: str) -> LoadedScene:
    """Observes what needs no camera."""
    path = written_scene(folder, ("use: off", f"use: {use}"))
    text = path.read_text().replace("force, markers, image]", "force]")
    path.write_text(text)
    return read_scene(path)


def job(folder: Path, loaded: LoadedScene) -> SimulationJob:
    return job_of(loaded, TwinSensor(load_bundle(folder / BUNDLE)), folder)


def test_wanted_by_name(pad: Path) -> None:
    loaded = scene(pad, "on")
    if pad.name not in UNFIT:
        assert job(pad, loaded)
        return
    with pytest.raises(InputError) as caught:
        job(pad, loaded)
    problem = caught.value.problems[0]
    lines = Path(loaded.path).read_text().splitlines()
    assert problem.line is not None
    assert lines[problem.line - 1].strip().startswith("nonlinearity")
    assert pad.name in problem.message
    assert "nonlinearity: off" in problem.remedy
    assert PADS[pad.name][2] in problem.remedy


def test_wanted_by_the_planner(pad: Path) -> None:
    """`auto` takes large strain in for a tight tolerance and leaves it out for a loose one."""
    loaded = scene(pad, "auto")
    assert job(pad, loaded.with_tolerance(1000.0, 1000.0))
    tight = loaded.with_tolerance(1e-4, 1e-3)
    if pad.name not in UNFIT:
        assert "nonlinearity" in job(pad, tight).plan.order
        return
    with pytest.raises(InputError, match=pad.name):
        job(pad, tight)


def test_switched_off(pad: Path) -> None:
    assert "nonlinearity" not in job(pad, scene(pad, "off")).plan.order


def test_the_command_says_so_and_writes_nothing(
    pad: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if pad.name not in UNFIT:
        pytest.skip("a flat pad is strained")
    loaded, out = scene(pad, "on"), pad / "out" / "run"
    assert main(["simulate", str(loaded.path), "-o", str(out)]) != 0
    told = capsys.readouterr().err
    assert "scene.yaml:" in told
    assert pad.name in told
    assert "Traceback" not in told
    assert not out.exists()
