"""YAML blocks of the pages are legal; Python blocks run as their readers would run them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from page_text import DOCS, PAGES, ROOT, blocks, named, text_of, training_scenes

sys.path.insert(0, str(ROOT / "tests" / "force"))
sys.path.insert(0, str(ROOT / "tests" / "twin"))

from gelslim.cli import main
from gelslim_cad.spec.reader import read_spec
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.records import COLUMNS, FrameTruth, fields_npz, wrench_csv

FORCE, TWIN, OWN, BUILT = (
    DOCS / f"{n}.md" for n in ("force_pipeline", "digital_twin", "own_parts", "calibration")
)
"""Their blocks need frames, simulated data or a solid, and run in tests of their own."""
LATER = ("budget.md", "contributing.md", "data_sets.md")
PYTHON = [p for p in PAGES if blocks(p, "python") and p not in (FORCE, TWIN, OWN, BUILT)]
YAML = [(p, k) for p in PAGES for k in range(len(blocks(p, "yaml")))]
SMALL = """\
format: gelslim-spec/1
name: gelslim2
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 9, width_mm: 9}
"""


@pytest.mark.parametrize(("page", "number"), YAML, ids=[f"{named(p)}-{k}" for p, k in YAML])
def test_yaml_blocks_are_legal(page: Path, number: int, tmp_path: Path) -> None:
    text = blocks(page, "yaml")[number]
    file = tmp_path / "scenes" / "block.yaml"
    file.parent.mkdir()
    if "gelslim-scene/1" in text:
        for place in (tmp_path / "gelslim2.yaml", tmp_path / "scenes" / "mine.yaml",
                      tmp_path / "scenes" / "finger.yaml"):  # fmt: skip
            place.write_text(SMALL, encoding="utf-8")
        file.write_text(text, encoding="utf-8")
        scene = read_scene(file)
        assert scene.sensor_path.is_file(), "the sensor that the block names"
    else:
        if page == OWN:
            for name in ("my_adapter.step", "my_parts.py"):
                (file.parent / name).write_bytes(b"")
        # A part of a spec is completed by what every spec needs.
        file.write_text(text if "gelslim-spec/1" in text else SMALL + text, encoding="utf-8")
        assert read_spec(file).spec.name


def test_the_script_trains_on_the_data_sets_of_its_page() -> None:
    """What the page's commands have made is not made again."""
    source = (ROOT / "examples" / "train_regressor.py").read_text("utf-8")
    pattern = re.search(r'^SCENE = """\\\n(.*?)"""$', source, re.DOTALL | re.MULTILINE)
    assert pattern is not None
    for (name, text), sensors, seed in zip(training_scenes().items(), (4, 3), (1, 2), strict=True):
        assert f'("{name}", {sensors}, {seed}, ' in source
        written = pattern.group(1).format(name=name, sensors=sensors, seed=seed)
        assert yaml.safe_load(written) == yaml.safe_load(text)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle with its ladder, of a finger small enough to measure in a second or two."""
    folder = tmp_path_factory.mktemp("bundle")
    (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
    assert main(["bundle", str(folder / "small.yaml"), "-o", str(folder / "made")]) == 0
    return folder / "made"


def _recorded_run(folder: Path) -> None:
    from output_samples import frame

    from gelslim_force import RunRecorder

    with RunRecorder(folder) as recorder:
        for k in range(3):
            recorder.append(frame(k))


@pytest.mark.parametrize(
    "page",
    [pytest.param(p, marks=pytest.mark.slow if p.name in LATER else ()) for p in PYTHON],
    ids=named,
)
def test_python_blocks_run(page: Path, bundle: Path, tmp_path: Path) -> None:
    """In a process of their own: what a page registers must not reach other tests."""
    shutil.copytree(bundle, tmp_path / "out" / "gelslim2-bundle")
    shutil.copytree(ROOT / "designs", tmp_path / "designs")
    if page == DOCS / "force_formats.md":
        _recorded_run(tmp_path / "out" / "press")
    given = ""
    if page == DOCS / "stiffness.md":
        from gelslim import load_bundle

        # The page's reader has the motion of the surface.
        np.save(tmp_path / "u.npy", np.zeros((len(load_bundle(bundle).mesh.surface), 3)))
        given = "import numpy; surface_displacement_mm = numpy.load('u.npy')\n"
    script = tmp_path / "page.py"
    script.write_text(given + "\n".join(blocks(page, "python")), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr[-2000:]


def _run_blocks(page: Path, names: dict[str, object]) -> None:
    for number, block in enumerate(blocks(page, "python"), 1):
        exec(compile(block, f"{page.name}, snippet {number}", "exec"), names)


@pytest.mark.slow
def test_the_guide_of_the_force_pipeline_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("PIL")
    from sensor_samples import frame, press, sensor_bundle, stream

    from gelslim_force.outputs.canvas import encoded
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.settings import PipelineSettings
    from ifem_export.bundle.files import write_bundle

    write_bundle(tmp_path / "out" / "gelslim2-bundle", sensor_bundle())
    (tmp_path / "reference.png").write_bytes(encoded(frame(0.0).image, ".png"))
    (tmp_path / "frames").mkdir()
    for k, seen in enumerate(stream(5)):
        (tmp_path / "frames" / f"{k:04d}.png").write_bytes(encoded(seen.image, ".png"))
    monkeypatch.chdir(tmp_path)
    names: dict = {"w_mm": press().nodes_mm[:, 2]}
    _run_blocks(FORCE, names)
    assert names["summary"].frames == names["summary"].with_forces == 5
    assert names["run"].complete
    assert list((tmp_path / "out" / "press" / "pictures").glob("*.png"))
    # What the guide says is unknown without a normal source is unknown, and known with one.
    assert np.isnan(names["tangential"].wrench.force_n).tolist() == [False, False, True]
    assert np.isfinite(names["known"].wrench.vector).all()
    # The press is that of a linear gel, the guide's pipeline takes the law by the depth.
    assert -1.2 < names["known"].wrench.force_n[2] < -1.05
    settings = PipelineSettings(gel="linear")
    linear = ForcePipeline(names["bundle"], names["calibration"], settings)
    pressed = linear.process(names["frame"], normal_mm=names["w_mm"]).wrench
    assert pressed.force_n[2] == pytest.approx(-1.0, abs=0.05)
    assert names["tracked"].tracks.coverage == 1.0


@pytest.mark.slow
def test_the_guide_of_calibration_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("PIL")
    from ball_presses import YOUNG_MPA, Built, ball_bundle, ball_picture, rest_picture

    from gelslim_force.outputs.canvas import encoded
    from gelslim_force.presses.load_table import read_loads
    from ifem_export.bundle.files import write_bundle

    write_bundle(tmp_path / "out" / "gelslim2-bundle", ball_bundle())
    table = next(b for b in blocks(BUILT, "") if b.startswith("picture,"))
    (tmp_path / "loads.csv").write_text(table, encoding="utf-8")
    (tmp_path / "presses").mkdir()
    built, rng = Built(young=1.1), np.random.default_rng(8)
    for number, load in enumerate(read_loads(tmp_path / "loads.csv")):
        place = rng.uniform(-3, 3, 2)
        image = ball_picture(built, load.load_n, place, number) if load.load_n else rest_picture()
        (tmp_path / "presses" / load.picture).write_bytes(encoded(image, ".png"))
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    _run_blocks(BUILT, names)
    assert names["gel"].youngs_modulus_mpa == pytest.approx(1.1 * YOUNG_MPA, rel=0.05)
    assert names["pipeline"].gel is not None
    assert np.abs(names["light"].gain[:, 0] / names["light"].gamma - 1).max() < 0.08
    assert names["lit"].normal.estimator.settings.gain_sigma == names["light"].gain_sigma


def test_the_guide_of_the_twin_runs_and_names_columns_arrays_and_effects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    rest = GelState.at_rest(3)
    force = np.zeros((3, 3))
    force[1, 2] = -1.0
    seen, drawn = np.zeros((4, 2)), np.ones(4, dtype=bool)
    frames = [
        FrameTruth(k, float(k), Pose(float(k)), state, seen, seen, drawn)
        for k, state in enumerate((rest, replace(rest, force_n=force)))
    ]
    folder = tmp_path / "out" / "press_sphere"
    folder.mkdir(parents=True)
    every = ("displacement", "force", "markers")
    (folder / "truth.npz").write_bytes(fields_npz(frames, np.zeros((3, 3)), every))
    (folder / "truth.csv").write_bytes(wrench_csv(frames, np.zeros((3, 3))))
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    _run_blocks(TWIN, names)
    assert names["force_n"][-1] == pytest.approx([0.0, 0.0, -1.0])
    text = text_of(TWIN)
    with np.load(folder / "truth.npz") as held:
        for name in (*COLUMNS, *held.files):
            assert f"`{name}`" in text, name
    rows = re.findall(r"^\| `(\w+)` \|.*\|.*\|$", text, re.MULTILINE)
    effects = [e.name for e in EFFECTS]
    assert [r for r in rows if r in effects] == effects
    for scene in (ROOT / "designs" / "scenes").glob("*.yaml"):
        assert f"`{scene.stem}`" in text, scene.stem
