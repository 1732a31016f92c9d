"""Scenes that a newcomer gets wrong: a line, a reason and a remedy, and no traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_samples import ROOT

from gelslim.cli import main

SCENE = ROOT / "designs" / "scenes" / "press_sphere.yaml"
SENSOR = ROOT / "designs" / "gelslim2.yaml"
MOTION = "motion:\n  csv: path.csv\ncontact:"


def _scene(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SCENE.read_text(encoding="utf-8").replace("../gelslim2.yaml", str(SENSOR))
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "szene ü.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("depth_mm: 0.8", "depth_mm: 5", "5 mm deep into a gel of 2 mm; press at most 1.8 mm"),
        ("radius_mm: 10", "radiusmm: 10", "did you mean indenters[0].radius_mm"),
        ("depth_mm: 0.8", "depth_mm: .nan", "must be a finite number"),
        ("duration_s: 0.8", "duration_s: 0", "must be > 0"),
        (str(SENSOR), "nowhere.yaml", "sensor.spec = nowhere.yaml: no such file"),
        ("effects:\n", "effects:\n  normal_contact: off\n", "it alone provides the force"),
        ("[displacement, force, markers, image]", "[]", "at least 1"),
    ],
)
@pytest.mark.parametrize("command", ["plan", "simulate"])
def test_faults_are_told_by_line(tmp_path, capsys, command, old, new, told):
    path = _scene(tmp_path, (old, new))
    extra = ["-o", str(tmp_path / "out")] if command == "simulate" else []
    assert main([command, str(path), *extra]) == 2
    error = capsys.readouterr().err
    assert f"{path}:" in error
    assert told in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("value", "told"), [(".nan", "must be a finite number"), ("NaN", "text")])
def test_the_only_waypoint_refused_is_one_fault(tmp_path, capsys, value, told):
    path = _scene(tmp_path)
    text = path.read_text(encoding="utf-8")
    start, end = text.index("motion:"), text.index("contact:")
    only = f"{{move: press, depth_mm: {value}, steps: 2, duration_s: 0.1}}"
    motion = f"motion:\n  waypoints:\n    - {only}\n"
    path.write_text(text[:start] + motion + text[end:], encoding="utf-8")
    assert main(["plan", str(path)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert told in lines[0]


def test_a_tool_held_above_its_origin_may_go_deeper(tmp_path):
    raised = ("radius_mm: 10", "radius_mm: 10\n    raised_mm: 4.5")
    assert main(["plan", str(_scene(tmp_path, raised, ("depth_mm: 0.8", "depth_mm: 5")))]) == 0


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("time_s,depth_mm,x_mm\n0,0,0\n0.1,,0\n", "path.csv:3 depth_mm"),
        ("time_s,depth_mm\n0,0\n0.2,0.1\n0.1,0.2\n", "must be above the time of the line before"),
        ("time_s,depth_mm\n", "has no poses"),
        ("time_s,depth_mm\n0,0\n1,4\n", "motion.csv"),
    ],
)
def test_tables_with_gaps_are_told_by_line(tmp_path, capsys, table, told):
    text = _scene(tmp_path).read_text(encoding="utf-8")
    start, end = text.index("motion:"), text.index("contact:")
    path = tmp_path / "table.yaml"
    path.write_text(text[:start] + MOTION + text[end + len("contact:") :], encoding="utf-8")
    (tmp_path / "path.csv").write_text(table)
    assert main(["plan", str(path)]) == 2
    assert told in capsys.readouterr().err
    (tmp_path / "path.csv").unlink()
    (tmp_path / "path.csv").mkdir()
    assert main(["plan", str(path)]) == 2
    assert "is a directory; name a file in it" in capsys.readouterr().err
