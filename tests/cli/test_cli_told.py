"""What people read: no change without a digit that shows it, fields as the spec spells them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cli_samples import MINI20, altered

from gelslim.cli import main
from gelslim.cli.answer import given


def test_diff_shows_no_row_whose_two_sides_read_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = altered(tmp_path, "length_mm: 20", "length_mm: 20.5")
    assert main(["diff", str(MINI20), str(other), "--no-parts"]) == 0
    shown = capsys.readouterr().out
    rows = [line.split() for line in shown.splitlines() if re.match(r"[a-z_]+\.[a-z_]+ ", line)]
    assert len(rows) > 10
    for name, *cells in rows:
        numbers = [c for c in cells if c not in ("mm", "px")]
        assert numbers[0] != numbers[1], name


def test_diff_shows_every_field_that_differs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = altered(tmp_path, "focal_length_mm: 3.6", "focal_length_mm: 3.60001")
    assert main(["diff", str(MINI20), str(other), "--no-parts"]) == 0
    assert "3.60001 mm" in capsys.readouterr().out


def test_explain_spells_fields_as_the_spec_does(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(MINI20), "view.across_fov_deg"]) == 0
    told = capsys.readouterr().out
    assert "camera.sensor_width_mm = 3.6288 mm" in told
    assert "docs/physics.md#" in told


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.6288, "mm", "3.6288 mm"),
        (1 / 3, "", "0.333333"),
        (60.0, "°", "60°"),
        ((), "°", "none"),
        (None, "mm", "none"),
        (4, "", "4"),
        (1e6, "mm", "1000000 mm"),
        ("auto", "", "auto"),
    ],
)
def test_a_field_is_written_with_its_digits(value: object, unit: str, text: str) -> None:
    assert given(value, unit) == text
