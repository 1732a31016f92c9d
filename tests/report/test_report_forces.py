"""The report's table of force operators, from a ladder of known figures."""

from __future__ import annotations

from dataclasses import replace

from report_sample import report
from test_report_tolerance import Cells

from gelslim_cad.report.forces import forces_section
from gelslim_cad.report.render import render_report
from ifem_export.operators.operator_ladder import ContactError, MeasuredRung, OperatorLadder

CONTACTS = {
    "small_ball": ContactError(0.0516, 0.02),
    "sharp_punch": ContactError(0.1, 0.128),
    "edge": ContactError(0.03, 0.02),
    "two_contacts": ContactError(0.0531, 0.01),
}
LADDER = OperatorLadder(
    (
        MeasuredRung("fft", {"lumped": 1}, 0.0295, 0, 0.001, 1, 1, None, 645752, 0.24, CONTACTS),
        MeasuredRung("pcg", {"rtol": 0.01}, 0.0111, 0, 0.001, 1, 1, None, 19607064),
    ),
    "eight layers <at half the pitch>", 4, "bbar", 0.3223,
)  # fmt: skip


def rows(markup: str) -> list[list[str]]:
    cells = Cells()
    cells.feed(markup)
    return cells.rows


def test_the_section_shows_the_larger_error_of_each_kind() -> None:
    found = forces_section(LADDER, "pcg (rtol 0.01)")
    heads, first, second = rows(found)
    assert len(heads) == len(first) == len(second) == 7
    assert first == ["fft (lumped 1)", "2.95 %", "5.16 %", "12.8 %", "24 %", "5.31 %", "0.646"]
    assert second == ["pcg (rtol 0.01)", "1.11 %", "–", "–", "–", "–", "19.6"]
    assert found.count("<strong>") == 1
    assert "&lt;at half the pitch&gt;" in found
    assert not rows(forces_section(None))


def test_the_page_holds_the_section() -> None:
    page = render_report(replace(report(), operators=LADDER, operator="fft (lumped 1)")).decode()
    assert "<strong>fft (lumped 1)</strong>" in page
    assert 'id="forces"' in page
