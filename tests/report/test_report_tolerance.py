"""The report's section on tolerances, from the record of a real study."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gelslim_cad.report.tolerance import tolerance_section
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.study import study_record, tolerance_study

DESIGN = Path(__file__).parents[2] / "designs" / "mini20.yaml"


class Cells(HTMLParser):
    """Collects rows of cells, and the widths of the bars."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.widths: list[float] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "rect":
            self.widths.append(float(dict(attrs)["width"] or 0))

    def handle_data(self, data: str) -> None:
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] += data


def test_the_section_shows_the_numbers_of_the_study() -> None:
    spec = read_spec(DESIGN).spec
    record = study_record(tolerance_study(spec, samples=128, least_yield=0.01))
    record["name"] = record["plan"]["steps"][0]["words"] = "<b>&"
    page = tolerance_section(record)
    assert "<b>" not in page
    cells = Cells()
    cells.feed(page)
    rows = {row[0]: row for row in cells.rows if row}
    found = record["yields"]["adjusted"]["all"]["yield"]
    assert float(rows["Every rule"][2].split()[0]) == pytest.approx(100 * found, rel=5e-3)
    worst = next(v for v in record["variance"] if v["place"].startswith(record["worst_rule"]))
    largest = max(worst["total"], key=worst["total"].get)
    share = float(re.search(r"[\d.]+", rows[largest][3])[0])  # type: ignore[index]
    assert share == pytest.approx(100 * worst["total"][largest], rel=1e-2)
    assert cells.widths[1] == pytest.approx(cells.widths[0] * worst["total"][largest], abs=0.01)
    errors = [f["deviation_percent"] for f in record["forces"]]
    shown = [float(cell.split()[0]) for cell in rows["All together"][1:]]
    assert shown == pytest.approx(errors, rel=5e-3)


def test_a_report_without_a_study_says_so() -> None:
    assert "<table" not in tolerance_section({})
