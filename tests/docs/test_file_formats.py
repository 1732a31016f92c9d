"""The pages on file formats name every file and field that is written, and no other."""

from __future__ import annotations

import csv
import json
import re
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_text import DOCS, ROOT, text_of

from gelslim.cli import main

FORMATS = text_of(DOCS / "file_formats.md")
FORCE = text_of(DOCS / "force_formats.md")
ONLY_SOMETIMES = ("cell_fill.npy", "surface_shift.npy", "stiffness_*", "pad.vtu")
"""Listed as such."""
SPEC = """\
format: gelslim-spec/1
name: small
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 9, width_mm: 9}
mesh: {layers: 2}
"""
SCENE = """\
format: gelslim-scene/1
name: press
sensor: {spec: small.yaml}
indenters: [{shape: sphere, radius_mm: 4}]
motion: {waypoints: [{move: press, depth_mm: 0.3, steps: 2}]}
effects: {nonlinearity: off}
observe: [displacement, force, markers, image]
tolerance: {force_n: 0.5, image_px: 0.5}
"""


def section(command: str) -> str:
    """What the page says of a command's files."""
    found = re.search(rf"^## [^\n]*`gelslim {command}`.*?(?=^## |\Z)", FORMATS, re.M | re.S)
    assert found is not None, command
    return found.group(0)


def named_files(text: str) -> list[str]:
    """Files of a section's table, with *."""
    cells = re.findall(r"^\| ([^|]*) \|", text, re.MULTILINE)
    return [name for cell in cells for name in re.findall(r"`([\w./*-]+)`", cell)]


def compare(folder: Path, command: str) -> None:
    """Every file below a folder is listed, and every one listed is there."""
    listed = named_files(section(command))
    there = [p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()]
    assert there
    for path in there:
        assert any(fnmatch(path, pattern) for pattern in listed), f"not in the page: {path}"
    for pattern in listed:
        if not any(fnmatch(pattern, seldom) for seldom in ONLY_SOMETIMES):
            assert any(fnmatch(path, pattern) for path in there), f"not written: {pattern}"


def words(text: str) -> set[str]:
    """All names in backticks."""
    return {part for name in re.findall(r"`([^`\n]+)`", text) for part in re.split(r"[ ,]+", name)}


def keys(path: Path) -> set[str]:
    return set(json.loads(path.read_text("utf-8")))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundle, simulation, calibration, tracks and exploration of a small finger."""
    folder = tmp_path_factory.mktemp("formats")
    (folder / "small.yaml").write_text(SPEC, encoding="utf-8")
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    made, frames = str(folder / "bundle"), str(folder / "press" / "frames")
    rest = f"{frames}/frame_000000.png"
    mini, explored = str(ROOT / "designs" / "mini20.yaml"), str(folder / "explore")
    for line in (
        ["bundle", str(folder / "small.yaml"), "-o", made],
        ["simulate", str(folder / "scene.yaml"), "-o", str(folder / "press")],
        ["calibrate", made, rest, "-o", str(folder / "calibration.json")],
        ["track", frames, "-o", str(folder / "track")],
        ["force", made, frames, "-r", rest, "--indenter", "sphere:4", "-o", str(folder / "force")],
        ["explore", mini, "--vary", "gel.length_mm=18,20", "-j", "1", "-o", explored],
    ):
        assert main(line) == 0, line
    return folder


def test_bundle(place: Path) -> None:
    text = section("bundle")
    compare(place / "bundle", "bundle")
    assert keys(place / "bundle" / "manifest.json") <= words(text)
    ladder = json.loads((place / "bundle" / "ladder.json").read_text("utf-8"))
    assert set(ladder) | set(ladder["rungs"][0]) <= words(text)


def test_shapes_and_types_of_the_bundle(place: Path) -> None:
    """As the table says, for all of one shape."""
    folder = place / "bundle"
    sizes = {
        "n": len(np.load(folder / "nodes_mm.npy")),
        "m": len(np.load(folder / "hexes.npy")),
        "s": len(np.load(folder / "surface_nodes.npy")),
        "k": len(np.load(folder / "marker_row.npy")),
    }
    seen = 0
    for cell, told in re.findall(r"^\| ([^|]*\.npy`) \| (\([^|]*) \|$", section("bundle"), re.M):
        shape = re.match(r"\(([^)]*)\) (float64|int64|int32|bool)", told)
        for name in re.findall(r"`([\w.]+)`", cell):
            if shape is None or not (folder / name).exists():
                continue
            parts = [p.strip() for p in shape.group(1).split(",") if p.strip()]
            array = np.load(folder / name)
            assert str(array.dtype) == shape.group(2), name
            if all(p in sizes or p.isdigit() for p in parts):
                assert array.shape == tuple(sizes.get(p) or int(p) for p in parts), name
                seen += 1
    assert seen >= 11


def test_calibration(place: Path) -> None:
    assert keys(place / "calibration.json") - {"format"} <= words(section("calibrate"))


def test_tracks(place: Path) -> None:
    text = section("track")
    compare(place / "track", "track")
    assert keys(place / "track" / "summary.json") <= words(text)
    with np.load(place / "track" / "tracks.npz") as held:
        assert set(held.files) <= words(text)
    with (place / "track" / "frames.csv").open() as lines:
        assert set(next(csv.reader(lines))) <= words(text)


def test_simulation(place: Path) -> None:
    text = text_of(DOCS / "digital_twin.md").partition("\n## The folder")[2]
    text = text.partition("\n## ")[0]
    there = {
        p.name + "/" * p.is_dir() for p in (place / "press").iterdir() if not p.name.startswith(".")
    }
    told = {n.split("/")[0] + "/" * ("/" in n) for n in named_files(text)}
    assert there == told
    assert there <= words(section("simulate"))
    with np.load(place / "press" / "truth.npz") as held:
        assert set(held.files) <= words(text)


def test_exploration(place: Path) -> None:
    compare(place / "explore", "explore")
    with (place / "explore" / "designs.csv").open() as lines:
        columns = next(csv.reader(lines))
    told = words(text_of(DOCS / "design_space.md"))
    fixed = [c for c in columns if not c.startswith("design.")]
    assert set(fixed) <= told, sorted(set(fixed) - told)


def table_names(heading: str) -> list[str]:
    """First cells of the tables under a heading of force_formats.md."""
    text = FORCE.partition(f"\n### {heading}\n")[2].partition("\n##")[0]
    cells = re.findall(r"^\| (`[^|]*) \|", text, re.MULTILINE)
    return [name for cell in cells for name in re.findall(r"`([^`]+)`", cell)]


def test_run_record(place: Path) -> None:
    record: dict[str, Any] = json.loads((place / "force" / "run.json").read_text("utf-8"))
    assert table_names("run.json") == list(record)
    assert set(record["counts"]) | set(record["fields"]) <= words(FORCE)


def test_wrenches(place: Path) -> None:
    with (place / "force" / "wrenches.csv").open() as lines:
        columns = next(csv.reader(lines))
    told = table_names("wrenches.csv")
    first, last = told.index("sigma_fx_n"), told.index("sigma_tz_nmm")
    wrench = columns[columns.index("fx_n") : columns.index("tz_nmm") + 1]
    told[first : last + 1] = [f"sigma_{name}" for name in wrench]
    assert sorted(told) == sorted(columns)


def test_fields(place: Path) -> None:
    with np.load(place / "force" / "fields_00000.npz") as held:
        assert sorted(table_names("fields_NNNNN.npz")) == sorted(held.files)
        for name in ("status", "dots", "index", "wrench_covariance"):
            row = re.search(rf"^\| [^|]*`{name}`[^|]*\| [^|]* \| ([^|]*) \|$", FORCE, re.MULTILINE)
            assert row is not None
            assert row.group(1).startswith(str(held[name].dtype)), name
