"""`gelslim diff` against what the two specs are known to differ in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from cli_samples import MINI20, ROOT, altered, too_long

from gelslim.cli import main
from gelslim_cad.compare import compare, differ
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main(["diff", *arguments, "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return json.loads(captured.out)


def test_a_spec_does_not_differ_from_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spelled = altered(tmp_path, "width_mm: 20\n", "width_mm: 20.0   # across\n")
    answer = answered(capsys, str(MINI20), str(spelled))
    assert answer["same"] is True
    assert answer["fields"] == answer["dimensions"] == answer["rules"] == answer["bundle"] == []
    assert main(["diff", str(MINI20), str(spelled)]) == 0
    assert "fields of the spec" not in capsys.readouterr().out


def test_every_dimension_that_differs_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = altered(tmp_path, "width_mm: 20", "width_mm: 22")
    answer = answered(capsys, str(MINI20), str(other), "--no-parts")
    assert [(c["name"], c["before"], c["after"]) for c in answer["fields"]] == [
        ("design.gel.width_mm", 20.0, 22.0)
    ]
    before, after = (derive(read_spec(p).spec).values for p in (MINI20, other))
    expected = {n for n in before if abs(before[n] - after[n]) > 1e-9 * max(1, abs(before[n]))}
    assert {c["name"] for c in answer["dimensions"]} == expected
    width = next(c for c in answer["dimensions"] if c["name"] == "finger.width_mm")
    assert width["difference"] == pytest.approx(2.0)
    assert width["unit"] == "mm"


def test_a_rule_that_breaks_comes_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    longer = too_long(tmp_path)
    assert main(["diff", str(MINI20), str(longer), "--no-parts"]) == 0
    shown = capsys.readouterr().out
    rules = shown.split("design rules")[1].splitlines()
    worse = [k for k, line in enumerate(rules) if "→ fail" in line]
    assert worse == list(range(1, 1 + len(worse)))
    assert any("marker.far_px" in rules[k] and "pass → fail" in rules[k] for k in worse)
    back = {c.id: c.verdict for c in compare(read_spec(longer).spec, read_spec(MINI20).spec).rules}
    assert back["marker.far_px"] == "gets better"


@pytest.mark.parametrize(
    ("old", "new", "blocks"),
    [
        ("f_number: 2.9", "f_number: 2.9\nmesh:\n  layers: 3", {"mesh"}),
        ("f_number: 2.9", "f_number: 2.9\nmaterial:\n  gel: {youngs_modulus_mpa: 0.3}",
         {"element"}),
        ("f_number: 2.9", "f_number: 3.4", {"camera"}),
        ("diameter_mm: 0.6 ", "diameter_mm: 0.65 ", {"markers", "camera"}),
    ],
)  # fmt: skip
def test_the_bundle_changes_where_its_inputs_do(
    old: str, new: str, blocks: set[str], tmp_path: Path
) -> None:
    other = altered(tmp_path, old, new)
    found = compare(read_spec(MINI20).spec, read_spec(other).spec)
    assert {c.block for c in found.bundle} == blocks


def test_numbers_within_the_solvers_accuracy_are_the_same() -> None:
    assert not differ(1.0, 1.0 + 1e-12)
    assert differ(1.0, 1.0 + 1e-6)
    assert differ(None, 1.0)
    assert differ(float("nan"), 1.0)
    assert not differ(float("nan"), float("nan"))


@pytest.mark.slow
def test_a_larger_flange_bolt_changes_the_adapter_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("cadquery")
    other = altered(
        tmp_path, "    width_mm: 20\n", "    width_mm: 20\n  mount: {flange_bolt: M5}\n"
    )
    parts = answered(capsys, str(MINI20), str(other))["parts"]
    assert [c["name"] for c in parts["changed"]] == ["gripper_adapter"]
    assert "part gripper_adapter" in parts["units"]
    assert "part body" not in parts["units"]
    assert "body" in parts["kept"]
    assert main(["diff", str(MINI20), str(ROOT / "designs" / "wide.yaml")]) == 0
    assert "body" in capsys.readouterr().out.split("parts")[-1]
