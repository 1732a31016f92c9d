"""The reference pages are those that the schemas give, with every field."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reference import reference_text as spec_page
from gelslim_core.yaml.fields import Field, field_table
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.starter import reference_text as sensor_page
from gelslim_twin.scene.reader import reference_text as scene_page
from gelslim_twin.scene.scene import Scene

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {
    "spec_reference.md": (spec_page, Spec),
    "scene_reference.md": (scene_page, Scene),
    "sensor_reference.md": (sensor_page, SensorDescription),
}


@pytest.mark.parametrize("name", PAGES)
def test_committed_page_is_what_the_schema_says(name: str) -> None:
    made = PAGES[name][0]()
    assert (DOCS / name).read_text("utf-8") == made, "run: make docs"


@pytest.mark.parametrize(
    ("page", "options"), [("spec", []), ("scene", ["--scene"]), ("sensor", ["--sensor"])]
)
def test_the_command_line_prints_the_page(
    page: str, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schema", "--markdown", *options]) == 0
    assert capsys.readouterr().out == (DOCS / f"{page}_reference.md").read_text("utf-8")


def rows(page: str) -> list[tuple[str, list[str]]]:
    """Every row of a page with the heading that it stands under."""
    found, heading = [], ""
    for line in page.splitlines():
        if line.startswith("## "):
            heading = line[3:]
        elif line.startswith("| `"):
            found.append((heading, [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]))
    return found


@pytest.mark.parametrize("name", PAGES)
def test_every_field_of_the_models_has_its_row(name: str) -> None:
    """Counted against the table that the reader's messages come from, not the schema."""
    page, model = PAGES[name]
    wanted = field_table(model)
    shown = rows(page())
    assert len(shown) == len(wanted)
    paths = [
        cells[0].strip("`") if head == "Top" else f"{head.partition(':')[0]}.{cells[0].strip('`')}"
        for head, cells in shown
    ]
    assert sorted(paths) == sorted(f.path for f in wanted)


@pytest.mark.parametrize("name", PAGES)
def test_rows_give_default_unit_limits_and_meaning(name: str) -> None:
    page, model = PAGES[name]
    shown: dict[tuple[str, str], list[list[str]]] = {}
    for head, cells in rows(page()):
        shown.setdefault((head.partition(":")[0], cells[0].strip("`")), []).append(cells)
    for field in field_table(model):
        block = field.path.rpartition(".")[0] or "Top"
        candidates = shown[block, field.name]
        assert any(_agrees(field, cells) for cells in candidates), (field.path, candidates)


def _agrees(field: Field, cells: list[str]) -> bool:
    _, _, unit, default, limits, meaning = cells
    if field.description and meaning != field.description:
        return False
    if field.unit and field.unit.label and unit != field.unit.label:
        return False
    if field.required != (default == "**required**"):
        return False
    if isinstance(field.default, bool | int | float) and not field.required:
        shown = default.strip("`")
        same = shown == str(field.default).lower() or float(shown) == pytest.approx(
            field.default, rel=1e-5
        )
        if not same:
            return False
    # Of two bounds on one side the page gives the tighter.
    low = max((v for k, v in field.limits if k in ("gt", "ge")), default=None)
    high = min((v for k, v in field.limits if k in ("lt", "le")), default=None)
    given = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", limits)]
    return all(v is None or v in given for v in (low, high))
