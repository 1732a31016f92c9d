"""The commands of the pages, typed one after the other as a reader would, and what they say.

Each page in a folder of its own with the designs beside it. Slow: it builds, traces and simulates.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from page_text import DOCS, PAGES, ROOT, blocks, commands, named, text_of, training_scenes

from gelslim_cad.spec.reader import read_spec

SHORT_VALIDATE = ROOT / "tests" / "robustness" / "short_validate.py"
SMALLER = (
    ("gelslim validate", f"python {SHORT_VALIDATE} validate"),
    ("--count 1000 -j 8", "--count 2"),
    ("--count 1600", "--count 2"),
    ("--count 300", "--count 2"),
    ("--rays 1048576", "--rays 16384"),
    ("--count 100 -j 2", "--count 2"),
    ("gel.length_mm=16:50:1", "gel.length_mm=16:50:17"),
    ("gel.length_mm=16:30:1", "gel.length_mm=16:30:7"),
    ("gel.length_mm=10:30:0.5", "gel.length_mm=10:30:10"),
    ("gel.length_mm=16:24:1", "gel.length_mm=16:24:4"),
    ("gel.length_mm=16:24:2", "gel.length_mm=16:24:8"),
    ("gel.length_mm=16:22:2", "gel.length_mm=18:20:2"),
    ("gel.thickness_mm=0.5:5:0.25", "gel.thickness_mm=1:5:2"),
    ("gel.thickness_mm=1.5:3:0.5", "gel.thickness_mm=1.5:3:1.5"),
    ("f_number=2,2.9,4", "f_number=2,4"),
    ("blur_per_diameter=0.25,0.333,0.5", "blur_per_diameter=0.25,0.5"),
    ("designs/gelslim2.yaml designs/long50.yaml", "designs/thin.yaml"),
    ("designs/*.yaml", "designs/mini20.yaml designs/thin.yaml"),
)
"""The same work, less of it."""
EDITED = (
    (
        "gelslim import-sensor my_sensor.yaml",
        "sed -i 's/length_mm: 24 /length_mm: 28 /; s/width_mm: 18 /width_mm: 28 /;"
        "s/thickness_mm: 3$/thickness_mm: 2/; s/pitch_mm: 1.5 /pitch_mm: 1.0 /;"
        "s/# x_points: right/x_points: down/; s/# mirrored: false/mirrored: true/' my_sensor.yaml"
        " && gelslim import-sensor my_sensor.yaml",
    ),
    (
        "gelslim score out/press labels --axes -x,-y,z",
        "gelslim score out/press out/frames/truth.csv",
    ),
)
"""What the reader fills in before a line, and labels that there are."""
ELSEWHERE = (
    *("--scheduler", "--install-completion", "gelslim view"),
    *(() if find_spec("av") else ("--pictures video",)),
)
"""Needs a cluster, a shell of one's own, PyAV, or goes on until it is interrupted."""
PRESS = """\
format: gelslim-scene/1
name: frames
sensor: {spec: designs/gelslim2.yaml}
indenters: [{shape: sphere, radius_mm: 10}]
motion: {waypoints: [{move: press, depth_mm: 0.5, steps: 3}]}
effects: {nonlinearity: off}
observe: [force, markers, image]
tolerance: {force_n: 0.05, image_px: 0.2}
"""
BALL = """\
format: gelslim-scene/1
name: ball
sensor: {spec: designs/gelslim2.yaml}
indenters: [{shape: sphere, radius_mm: 6}]
motion: {waypoints: [{move: press, depth_mm: 0.5, steps: 5}]}
effects: {nonlinearity: off}
observe: [force, markers, image]
tolerance: {force_n: 0.02, image_px: 0.2}
"""
RUN = [p for p in PAGES if commands(p) and p != DOCS / "start_here.md"]


def typed(line: str, place: Path) -> subprocess.CompletedProcess[str]:
    """A line of shell, with this interpreter's `gelslim`."""
    here = shutil.which("gelslim", path=str(Path(sys.executable).parent)) or ""
    assert here, "the command line is not installed"
    path = f"{Path(here).parent}{os.pathsep}{os.environ['PATH']}"
    given = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        line, cwd=place, env=given, shell=True, capture_output=True, text=True, check=False
    )


def done(line: str, place: Path) -> str:
    """What a line prints; a failure of the test where it fails."""
    run = typed(line, place)
    assert run.returncode == 0, f"{line}\n{run.stdout[-1500:]}\n{run.stderr[-1500:]}"
    assert "Traceback" not in run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundle, frames and picture without contact of gelslim2, as the pages assume."""
    folder = tmp_path_factory.mktemp("sensor")
    shutil.copytree(ROOT / "designs", folder / "designs")
    (folder / "scene.yaml").write_text(PRESS, encoding="utf-8")
    done("gelslim bundle designs/gelslim2.yaml -o out/gelslim2-bundle", folder)
    done("gelslim simulate scene.yaml -o out/frames", folder)
    shutil.copytree(folder / "out" / "frames" / "frames", folder / "frames")
    shutil.copy(folder / "frames" / "frame_000000.png", folder / "reference.png")
    line = "gelslim calibrate out/gelslim2-bundle reference.png -o calibration.json"
    done(line, folder)
    _press_ball(folder)
    for name, text in training_scenes().items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder


def _press_ball(folder: Path) -> None:
    """Pictures of a ball, and the table of its loads, as the page on calibration has them."""
    (folder / "ball.yaml").write_text(BALL, encoding="utf-8")
    done("gelslim simulate ball.yaml -o out/ball", folder)
    frames = sorted((folder / "out" / "ball" / "frames").glob("*.png"))
    names = ["rest.png", *(f"press{k}.png" for k in range(1, len(frames)))]
    (folder / "presses").mkdir()
    # The first press is too faint for a patch.
    kept = [k for k in range(len(frames)) if k != 1]
    for k in kept:
        shutil.copy(frames[k], folder / "presses" / names[k])
    with (folder / "out" / "ball" / "truth.csv").open() as lines:
        loads = [-float(row["fz_n"]) for row in csv.DictReader(lines)]
    rows = [f"{names[k]},{loads[k]:.4f}" for k in kept]
    (folder / "loads.csv").write_text("picture,load_n\n" + "\n".join(rows), encoding="utf-8")


def lessened(line: str) -> str:
    for long, short in (*SMALLER, *EDITED):
        line = line.replace(long, short)
    return line


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=named)
def test_commands_of_a_page_run(page: Path, sensor: Path, tmp_path: Path) -> None:
    place = tmp_path / "reader"
    shutil.copytree(sensor, place)
    for line in dict.fromkeys(commands(page)):
        if not any(word in line for word in ELSEWHERE):
            done(lessened(line), place)


EDITS = (
    ("name: first", "name: mine"),
    ("    length_mm: 24.0", "    length_mm: 20.0"),
    ("  # markers:", "  markers:"),
    ("  #   pitch_mm: 1.2", "    pitch_mm: 1.0"),
)
"""What the newcomer changes in an editor."""


@pytest.mark.slow
def test_start_here_to_the_letter(tmp_path: Path) -> None:
    page = DOCS / "start_here.md"
    spec_block, scene_block = blocks(page, "yaml")
    lines = commands(page)
    assert lines[1] == "gelslim new first"
    for line in lines[:2]:
        done(line, tmp_path)
    text = (tmp_path / "first.yaml").read_text("utf-8")
    for old, new in EDITS:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "block.yaml").write_text(spec_block, encoding="utf-8")
    assert _without_camera_name(tmp_path / "mine.yaml") == _without_camera_name(
        tmp_path / "block.yaml"
    )
    (tmp_path / "press.yaml").write_text(scene_block, encoding="utf-8")
    for line in lines[2:]:
        done(line, tmp_path)
    assert (tmp_path / "out" / "mine" / "report.html").stat().st_size > 100_000
    _forces_agree(page, tmp_path)
    _ladder_agrees(page, tmp_path)


def _without_camera_name(path: Path) -> dict[str, Any]:
    values = read_spec(path).spec.model_dump()
    del values["camera"]["name"]
    return values


def _forces_agree(page: Path, place: Path) -> None:
    names = ("fx_n", "fy_n", "fz_n")
    for row, file in (("true", "press/truth.csv"), ("estimated", "force/wrenches.csv")):
        cells = re.search(rf"^\| {row} \|(.*)\|$", text_of(page), re.MULTILINE)
        assert cells is not None
        shown = [float(c.replace("−", "-")) for c in cells.group(1).split("|")]
        with (place / "out" / file).open() as lines:
            last = list(csv.DictReader(lines))[-1]
        assert shown == pytest.approx([float(last[n]) for n in names], abs=0.03), row


def _ladder_agrees(page: Path, place: Path) -> None:
    ladder = json.loads((place / "out" / "mine-bundle" / "ladder.json").read_text("utf-8"))
    errors = [rung["error_field"] for rung in ladder["rungs"]]
    part = text_of(page).partition("\n## 5.")[2].partition("\n## 6.")[0]
    shown = [float(e) / 100 for e in re.findall(r"\| ([\d.]+) % \|", part)]
    assert len(shown) >= 5
    for error in shown:
        assert min(abs(error - e) for e in errors) < 0.05 * error + 5e-4, error
