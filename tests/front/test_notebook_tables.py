"""What a spec, its dimensions and its checks show in a notebook."""

from __future__ import annotations

import re
from pathlib import Path

from gelslim_cad.checks import RULES, check
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec

SPEC = Path(__file__).parents[2] / "designs" / "gelslim2.yaml"


def rows(table: str) -> dict[str, list[str]]:
    """The cells of each row by the first of them."""
    found = [re.findall(r"<td>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", table)]
    return {row[0]: row[1:] for row in found if row}


def test_a_spec_shows_fields_with_their_lines() -> None:
    loaded = read_spec(SPEC)
    shown = rows(loaded._repr_html_())
    line = loaded.source_map["design.gel.length_mm"].line
    length_mm = loaded.spec.design.gel.length_mm
    assert shown["design.gel.length_mm"][:3] == [str(length_mm), "mm", str(line)]
    assert {row[2] for row in shown.values()} >= {"default", str(line)}


def test_dimensions_and_checks_show_each_value_with_its_unit() -> None:
    d = derive(read_spec(SPEC).spec)
    shown = rows(d._repr_html_())
    assert shown.keys() == d.values.keys()
    assert shown["finger.thickness_mm"][:2] == [f"{d['finger.thickness_mm']:.4g}", "mm"]
    checks = check(d)
    shown = rows(checks._repr_html_())
    assert shown.keys() == RULES.keys()
    screws = checks.of("screw.wall_mm")
    assert screws.limit is not None
    assert shown["screw.wall_mm"][1:] == [
        f"{screws.value:.4g}", f"{screws.limit:.4g}", "mm", screws.status
    ]  # fmt: skip
