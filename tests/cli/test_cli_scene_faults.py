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
    ("old", "new", "named"),
    [
        ("depth_mm: 0.8", "depth_mm: 5", "1.8 mm"),
        ("radius_mm: 10", "radiusmm: 10", "indenters[0].radius_mm"),
        ("depth_mm: 0.8", "depth_mm: .nan", "depth_mm = "),
        ("duration_s: 0.8", "duration_s: 0", "> 0"),
        (str(SENSOR), "nowhere.yaml", "sensor.spec = nowhere.yaml: "),
        ("effects:\n", "effects:\n  normal_contact: off\n", "effects.normal_contact"),
        ("[displacement, force, markers, image]", "[]", "observe"),
    ],
)
@pytest.mark.parametrize("command", ["plan", "simulate"])
def test_faults_are_reported_by_line(tmp_path, capsys, command, old, new, named):
    path = _scene(tmp_path, (old, new))
    extra = ["-o", str(tmp_path / "out")] if command == "simulate" else []
    assert main([command, str(path), *extra]) == 2
    error = capsys.readouterr().err
    assert f"{path}:" in error
    assert named in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("value", "named"), [(".nan", "depth_mm = "), ("NaN", "depth_mm = ")])
def test_the_only_waypoint_refused_is_one_fault(tmp_path, capsys, value, named):
    path = _scene(tmp_path)
    text = path.read_text(encoding="utf-8")
    start, end = text.index("motion:"), text.index("contact:")
    only = f"{{move: press, depth_mm: {value}, steps: 2, duration_s: 0.1}}"
    motion = f"motion:\n  waypoints:\n    - {only}\n"
    path.write_text(text[:start] + motion + text[end:], encoding="utf-8")
    assert main(["plan", str(path)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert named in lines[0]


@pytest.mark.slow
def test_a_tool_held_above_its_origin_may_go_deeper(tmp_path):
    raised = ("radius_mm: 10", "radius_mm: 10\n    raised_mm: 4.5")
    assert main(["plan", str(_scene(tmp_path, raised, ("depth_mm: 0.8", "depth_mm: 5")))]) == 0


@pytest.mark.parametrize(
    ("table", "named"),
    [
        ("time_s,depth_mm,x_mm\n0,0,0\n0.1,,0\n", "path.csv:3 depth_mm"),
        ("time_s,depth_mm\n0,0\n0.2,0.1\n0.1,0.2\n", "path.csv:4 time_s"),
        ("time_s,depth_mm\n", "path.csv"),
        ("time_s,depth_mm\n0,0\n1,4\n", "motion.csv"),
    ],
)
def test_tables_with_gaps_are_reported_by_line(tmp_path, capsys, table, named):
    text = _scene(tmp_path).read_text(encoding="utf-8")
    start, end = text.index("motion:"), text.index("contact:")
    path = tmp_path / "table.yaml"
    path.write_text(text[:start] + MOTION + text[end + len("contact:") :], encoding="utf-8")
    (tmp_path / "path.csv").write_text(table)
    assert main(["plan", str(path)]) == 2
    assert named in capsys.readouterr().err
    (tmp_path / "path.csv").unlink()
    (tmp_path / "path.csv").mkdir()
    assert main(["plan", str(path)]) == 2
    assert "path.csv" in capsys.readouterr().err
