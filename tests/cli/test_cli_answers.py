"""What the commands answer, for people and for programs."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from cli_samples import MINI20, altered, too_long

from gelslim.cli import main
from gelslim.cli.answer import number, plain, say
from gelslim_cad.checks import RULES, check
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec


def truth_thickness() -> float:
    return float(derive(read_spec(MINI20).spec)["finger.thickness_mm"])


def answered(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    assert main([*arguments, "--json"]) == status
    captured = capsys.readouterr()
    assert captured.err == ""
    return json.loads(captured.out)


def test_a_long_path_is_not_broken(capsys: pytest.CaptureFixture[str]) -> None:
    path = "/" + "a-long-name/" * 20
    say(f"Some words before. Wrote {path}. " + "Some words follow. " * 10)
    lines = capsys.readouterr().out.splitlines()
    assert f"{path}." in lines
    assert len(lines) >= 4
    assert max(map(len, lines)) == len(path) + 1


def test_check_as_json_holds_every_rule(capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, "check", str(MINI20))
    assert answer["ok"] is True
    assert answer["name"] == "mini20"
    truth = {c.id: c for c in check(derive(read_spec(MINI20).spec))}
    assert {c["id"] for c in answer["checks"]} == set(truth)
    for entry in answer["checks"]:
        assert entry["value"] == pytest.approx(truth[entry["id"]].value, rel=1e-9, abs=1e-9)
        assert entry["status"] == truth[entry["id"]].status
    assert f"{truth_thickness():.2f} mm" in answer["binding"][0]


def test_check_lists_what_holds_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    held = re.compile(r"^ok ", re.MULTILINE)
    assert main(["check", str(MINI20)]) == 0
    shown = capsys.readouterr().out
    assert not held.search(shown)
    assert str(len(RULES)) in shown
    assert main(["check", str(MINI20), "--verbose"]) == 0
    passed = [c for c in check(derive(read_spec(MINI20).spec)) if c.status == "pass"]
    assert len(held.findall(capsys.readouterr().out)) == len(passed)


def test_check_puts_failures_first_and_says_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(too_long(tmp_path)), "-v"]) == 1
    shown = capsys.readouterr().out
    marks = re.findall(r"^(FAIL|warn|ok) ", shown, re.MULTILINE)
    assert marks == sorted(marks, key=("FAIL", "warn", "ok").index)
    failed = {c.id for c in check(derive(read_spec(too_long(tmp_path)).spec)) if c.status == "fail"}
    assert failed
    for rule in failed:
        assert f"({rule})" in shown
    joined = " ".join(shown.split())
    assert "design.optics.min_px_per_marker" in joined
    assert f"{len(failed)} of {len(RULES)}" in joined


def test_a_failing_check_as_json_keeps_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answered(capsys, "check", str(too_long(tmp_path)), status=1)
    assert answer["ok"] is False
    assert any(c["status"] == "fail" and c["advice"] for c in answer["checks"])


def test_derive_shows_every_dimension(capsys: pytest.CaptureFixture[str]) -> None:
    d = derive(read_spec(MINI20).spec)
    assert main(["derive", str(MINI20)]) == 0
    shown = capsys.readouterr().out
    names = re.findall(r"^  ([a-z_]+\.[a-z_0-9]+) ", shown, re.MULTILINE)
    assert sorted(names) == sorted(d.values)
    assert f"{d['finger.thickness_mm']:.2f} mm" in shown
    answer = answered(capsys, "derive", str(MINI20))
    assert answer["feasible"] is True
    assert set(answer["dimensions"]) == set(d.values)
    thickness = answer["dimensions"]["finger.thickness_mm"]
    assert thickness["value"] == d["finger.thickness_mm"]
    assert thickness["unit"] == "mm"
    parts = ("design.housing.back_wall_mm", "finger.depth_mm", "stack.gel_total_mm")
    assert set(parts) < set(thickness["inputs"])
    assert sum(thickness["inputs"].values()) == pytest.approx(thickness["value"])


def test_derive_says_when_no_finger_fits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["derive", str(too_long(tmp_path))]) == 0
    assert "gelslim check" in capsys.readouterr().out
    assert answered(capsys, "derive", str(too_long(tmp_path)))["feasible"] is False


def test_explain_ends_at_the_lines_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = altered(tmp_path, "f_number: 2.9", "f_number: 2.8", name="mine.yaml")
    monkeypatch.chdir(tmp_path)
    assert main(["explain", "mine.yaml", "view.aperture_mm"]) == 0
    shown = capsys.readouterr().out
    lines = path.read_text(encoding="utf-8").splitlines()
    line = next(i for i, text in enumerate(lines, 1) if "f_number" in text)
    assert f"camera.f_number = 2.8  mine.yaml:{line}" in shown
    assert "view.aperture_mm = 1.29 mm" in shown
    assert "f / N" in shown


def test_explain_as_json_nests_inputs(capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, "explain", str(MINI20), "finger.thickness_mm")
    names = [child["name"] for child in answer["inputs"]]
    assert names == [n for n, _ in derive(read_spec(MINI20).spec).inputs("finger.thickness_mm")]
    assert answer["inputs"][0]["origin"] == "default"


@pytest.mark.parametrize("name", ["finger.thicknes_mm", "thickness_mm", "view.keystones"])
def test_explain_suggests_the_closest_name(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(MINI20), name]) == 2
    error = capsys.readouterr().err
    wanted = "view.keystone" if "keystone" in name else "finger.thickness_mm"
    assert wanted in error
    suggested = re.findall(r"[a-z_]+\.[a-z_.]+", error.partition(name)[2])
    assert len(suggested) == len(set(suggested))


def test_schema_prints_what_the_repository_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schema"]) == 0
    shown = capsys.readouterr().out
    assert json.loads(shown)["properties"]["design"]
    target = tmp_path / "a" / "schema.json"
    assert main(["schema", "-o", str(target)]) == 0
    assert target.read_text(encoding="utf-8") == shown


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (17.7918, "mm", "17.79 mm"),
        (1.2, "mm", "1.2 mm"),
        (1200.0, "mm", "1200 mm"),
        (634.92, "px", "634.9 px"),
        (0.00567, "mm", "0.00567 mm"),
        (2.04e-7, "mm", "0 mm"),
        (-4.5, "mm", "-4.5 mm"),
        (53.4962, "°", "53.5°"),
        (-0.0, "", "0"),
        (None, "mm", "none"),
        (True, "", "true"),
        ((1.0, 2.5), "mm", "1, 2.5 mm"),
    ],
)
def test_numbers_for_people(value: Any, unit: str, text: str) -> None:
    assert number(value, unit) == text


def test_json_never_holds_nan() -> None:
    assert plain({"a": (float("nan"), float("inf"), 1.0)}) == {"a": [None, None, 1.0]}
