"""FreeCAD on the written STEP files, where it is installed: valid solids, volumes, no overlap."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import cadquery as cq
import pytest
from shipped_fingers import NAMES, dimensions

from gelslim_cad.export.step import step_bytes
from gelslim_cad.geometry.part import Part
from gelslim_cad.sensor import marker_grid
from gelslim_cad.solids.finger import finger_parts, tooling_parts

FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        FREECAD is None, reason="NO FREECAD: no file was read; apt-get install freecad-python3"
    ),
]
SCRIPT = Path(__file__).parent / "freecad_inspection.py"
LEAST_OVERLAP_MM3 = 1e-4
"""Faces that touch have none; the kernel's tolerance of 1e-7 mm over 100 mm² gives 1e-5."""

Solids = dict[str, tuple[Part, ...]]


def inspect(solids: Solids, folder: Path) -> dict[str, Any]:
    """What FreeCAD finds in each file; it writes nothing where it failed."""
    assert FREECAD is not None
    for name, parts in solids.items():
        data = step_bytes(parts[0]) if len(parts) == 1 else step_bytes(parts, name=name)
        (folder / f"{name}.step").write_bytes(data)
    said = folder / "said.json"
    places = {"FREECAD_FOLDER": str(folder), "FREECAD_SAID": str(said)}
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    subprocess.run(
        [FREECAD, str(SCRIPT)],
        env=inherited | places,
        timeout=500,
        check=False,
        capture_output=True,
        stdin=subprocess.DEVNULL,
    )
    answer: dict[str, Any] = json.loads(said.read_text(encoding="utf-8"))
    return answer


@pytest.mark.parametrize("design", NAMES)
def test_freecad_finds_no_fault(design: str, tmp_path: Path) -> None:
    d = dimensions(design)
    finger = finger_parts(d)
    tooling = tooling_parts(d, marker_grid(d))
    solids: Solids = {part.name: (part.as_made(),) for part in (*finger, *tooling)}
    said = inspect(solids | {"assembly": finger}, tmp_path)
    assert said.keys() == solids.keys() | {"assembly"}
    assert [name for name, found in said.items() if found["faults"]] == []
    for name, (part,) in solids.items():
        assert sum(said[name]["volumes_mm3"]) == pytest.approx(part.solid.Volume(), rel=1e-6)
    together = said["assembly"]
    assert len(together["volumes_mm3"]) == len(finger)
    assert max(together["overlaps_mm3"]) < LEAST_OVERLAP_MM3


def test_freecad_sees_an_overlap(tmp_path: Path) -> None:
    parts = finger_parts(dimensions("mini20"))
    body, cover = (part for part in parts if part.name in ("body", "back_cover"))
    pressed_in = replace(cover, solid=cover.solid.translate(cq.Vector(0, 0, 0.1)))
    (overlap,) = inspect({"pair": (body, pressed_in)}, tmp_path)["pair"]["overlaps_mm3"]
    assert overlap == pytest.approx(body.solid.intersect(pressed_in.solid).Volume(), rel=1e-4)
    assert overlap > 1.0
