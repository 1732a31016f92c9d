"""YAML blocks of the pages are legal; Python blocks run as their readers would run them.

The guides of the force pipeline and of the twin have tests of their own.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from page_text import DOCS, PAGES, ROOT, blocks, named

from gelslim.cli import main
from gelslim_cad.spec.reader import read_spec
from gelslim_twin.scene.reader import read_scene

ELSEWHERE = {"force_pipeline.md", "digital_twin.md"}
"""Run by test_force_doc.py and test_twin_doc.py."""
PYTHON = [p for p in PAGES if blocks(p, "python") and p.name not in ELSEWHERE]
YAML = [(p, k) for p in PAGES for k in range(len(blocks(p, "yaml")))]
SMALL = """\
format: gelslim-spec/1
name: gelslim2
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 9, width_mm: 9}
"""


def test_all_languages_of_blocks_are_known() -> None:
    told = {kind for p in PAGES for kind in re.findall(r"^```(\w+)$", p.read_text("utf-8"), re.M)}
    assert told <= {"python", "yaml"}


@pytest.mark.parametrize(("page", "number"), YAML, ids=[f"{named(p)}-{k}" for p, k in YAML])
def test_yaml_blocks_are_legal(page: Path, number: int, tmp_path: Path) -> None:
    text = blocks(page, "yaml")[number]
    file = tmp_path / "scenes" / "block.yaml"
    file.parent.mkdir()
    if "gelslim-scene/1" in text:
        for place in (tmp_path / "gelslim2.yaml", tmp_path / "scenes" / "mine.yaml"):
            place.write_text(SMALL, encoding="utf-8")
        file.write_text(text, encoding="utf-8")
        scene = read_scene(file)
        assert scene.sensor_path.is_file(), "the sensor that the block names"
    else:
        # A part of a spec is completed by what every spec needs.
        whole = text if "gelslim-spec/1" in text else SMALL + text
        file.write_text(whole, encoding="utf-8")
        assert read_spec(file).spec.name


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle with its ladder, of a finger small enough to measure in a second or two."""
    folder = tmp_path_factory.mktemp("bundle")
    (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
    assert main(["bundle", str(folder / "small.yaml"), "-o", str(folder / "made")]) == 0
    return folder / "made"


def _recorded_run(folder: Path) -> None:
    sys.path.insert(0, str(ROOT / "tests" / "force"))
    from output_samples import frame

    from gelslim_force.outputs.run_recorder import RunRecorder

    with RunRecorder(folder) as recorder:
        for k in range(3):
            recorder.append(frame(k))


@pytest.mark.parametrize("page", PYTHON, ids=named)
def test_python_blocks_run(page: Path, bundle: Path, tmp_path: Path) -> None:
    """In a process of their own: what a page registers must not reach other tests."""
    shutil.copytree(bundle, tmp_path / "out" / "gelslim2-bundle")
    shutil.copytree(ROOT / "designs", tmp_path / "designs")
    if page == DOCS / "force_formats.md":
        _recorded_run(tmp_path / "out" / "press")
    given = ""
    if page == DOCS / "stiffness.md":
        # The page's reader has the motion of the surface.
        np.save(tmp_path / "u.npy", np.zeros((_surface_nodes(bundle), 3)))
        given = "import numpy; surface_displacement_mm = numpy.load('u.npy')\n"
    script = tmp_path / "page.py"
    script.write_text(given + "\n".join(blocks(page, "python")), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    if page == DOCS / "contributing.md":
        assert re.search(r"^pass \d", run.stdout, re.M), run.stdout
        assert run.stdout.count("field ") == 3


def _surface_nodes(bundle: Path) -> int:
    from ifem_export.bundle.files import load_bundle

    return len(load_bundle(bundle).mesh.surface)
