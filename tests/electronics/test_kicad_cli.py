"""KiCad's own checks of the written projects, where KiCad 8 or later is installed."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from board_samples import ALL_BOARDS, board_of
from copper_reader import excellon_holes, gerber_shapes
from shapely.affinity import translate
from shapely.ops import unary_union

from gelslim_cad.electronics.gerber_layers import layer_files
from gelslim_cad.electronics.kicad_project import kicad_files

KICAD = shutil.which("kicad-cli")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(KICAD is None, reason="NO KICAD: its checks did not run; install KiCad 8"),
]


def run(*words: str) -> None:
    assert KICAD is not None
    done = subprocess.run([KICAD, *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def findings(report: Path) -> list[str]:
    data = json.loads(report.read_text())
    found = [data.get(n, []) for n in ("violations", "unconnected_items", "schematic_parity")]
    found += [sheet["violations"] for sheet in data.get("sheets", [])]
    return [f"{v['type']}: {v['description']}" for group in found for v in group]


@pytest.mark.parametrize(("case", "number"), ALL_BOARDS)
def test_kicad_finds_no_fault(case: str, number: int, tmp_path: Path) -> None:
    """Design rules, unconnected pads, electrical rules, and the board against the schematic."""
    board = board_of(case, number).board
    for name, data in kicad_files(board).items():
        (tmp_path / name).write_bytes(data)
    stem, report = str(tmp_path / board.name), tmp_path / "report.json"
    options = ["--severity-all", "--format", "json", "-o", str(report)]
    run("pcb", "drc", "--schematic-parity", *options, f"{stem}.kicad_pcb")
    assert findings(report) == []
    run("sch", "erc", *options, f"{stem}.kicad_sch")
    assert findings(report) == []


def test_kicad_sees_a_track_that_comes_too_close(tmp_path: Path) -> None:
    board = board_of("gelslim2", 0).board
    for name, data in kicad_files(board).items():
        (tmp_path / name).write_bytes(data)
    path = tmp_path / f"{board.name}.kicad_pcb"
    wide = path.read_text().replace("(width 0.56)", "(width 1.2)", 1)
    path.write_text(wide)
    report = tmp_path / "report.json"
    run("pcb", "drc", "--severity-all", "--format", "json", "-o", str(report), str(path))
    assert any(f.startswith(("clearance", "shorting")) for f in findings(report))


@pytest.mark.parametrize("case", ["gelslim2", "narrow"])
def test_kicad_draws_the_same_layers(case: str, tmp_path: Path) -> None:
    """The Gerber files that KiCad makes of the project cover the same areas as ours."""
    board = board_of(case, 0).board
    for name, data in kicad_files(board).items():
        (tmp_path / name).write_bytes(data)
    source = str(tmp_path / f"{board.name}.kicad_pcb")
    out = tmp_path / "out"
    out.mkdir()
    layers = "F.Cu,B.Cu,F.Paste,F.SilkS,B.SilkS"
    run("pcb", "export", "gerbers", "--no-protel-ext", "-l", layers, "-o", f"{out}/", source)
    ours = layer_files(board)
    for layer in ("F_Cu", "B_Cu", "F_Paste", "F_Silkscreen", "B_Silkscreen"):
        theirs = gerber_shapes(_plain((out / f"{board.name}-{layer}.gbr").read_text()))
        mine = gerber_shapes(ours[f"{board.name}-{layer}.gbr"])
        if not mine:
            assert not theirs
            continue
        moved = translate(unary_union(theirs), -150.0, 100.0)
        apart = moved.symmetric_difference(unary_union(mine)).area
        assert apart < 1e-3 * unary_union(mine).area
    run("pcb", "export", "drill", "--format", "excellon", "-o", f"{out}/", source)
    (drill,) = out.glob("*.drl")
    found = np.array(excellon_holes(drill.read_bytes()))
    wanted = np.array(excellon_holes(ours[f"{board.name}-PTH.drl"]))
    found[:, 0] -= 150.0
    found[:, 1] += 100.0
    order = [np.lexsort(np.round(a[:, :2], 3).T) for a in (found, wanted)]
    np.testing.assert_allclose(found[order[0]], wanted[order[1]], atol=2e-3)


def _plain(text: str) -> bytes:
    """A Gerber file of KiCad with the spellings that the plain reader of the tests knows."""
    lines = [line.replace("G01X", "X") for line in text.splitlines()]
    kept = [line for line in lines if line and line[0] in "%GMDX"]
    return "\n".join(kept).encode()
