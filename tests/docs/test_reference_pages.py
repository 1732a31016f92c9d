"""The reference pages are what the schema says, whole, and the rules they add are enforced."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest
from pydantic import BaseModel
from pydantic import Field as Range

from gelslim.cli import main
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reference import RULES as SPEC_RULES
from gelslim_cad.spec.reference import reference_text as spec_page
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.fields import Field, field_table
from gelslim_core.yaml.reader import load_bytes
from gelslim_core.yaml.schema import heading_anchor, reference_markdown
from gelslim_twin.scene.reference import RULES as SCENE_RULES
from gelslim_twin.scene.reference import reference_text as scene_page
from gelslim_twin.scene.scene import Scene

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {"spec_reference.md": (spec_page, Spec), "scene_reference.md": (scene_page, Scene)}

SPEC = """\
format: gelslim-spec/1
name: finger
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 24, width_mm: 22}
"""
SCENE = """\
format: gelslim-scene/1
name: press
sensor: {spec: finger.yaml}
indenters: [{shape: sphere, radius_mm: 4}]
motion: {waypoints: [{move: press, depth_mm: 0.5}]}
observe: [force]
"""


@pytest.mark.parametrize("name", PAGES)
def test_committed_page_is_what_the_schema_says(name: str) -> None:
    made = PAGES[name][0]()
    assert (DOCS / name).read_text("utf-8") == made, "run: make docs"


@pytest.mark.parametrize(("page", "options"), [("spec", []), ("scene", ["--scene"])])
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
    told = rows(page())
    assert len(told) == len(wanted)
    paths = [
        cells[0].strip("`") if head == "Top" else f"{head.partition(':')[0]}.{cells[0].strip('`')}"
        for head, cells in told
    ]
    assert sorted(paths) == sorted(f.path for f in wanted)


@pytest.mark.parametrize("name", PAGES)
def test_rows_tell_default_unit_limits_and_meaning(name: str) -> None:
    page, model = PAGES[name]
    told: dict[tuple[str, str], list[list[str]]] = {}
    for head, cells in rows(page()):
        told.setdefault((head.partition(":")[0], cells[0].strip("`")), []).append(cells)
    for field in field_table(model):
        block = field.path.rpartition(".")[0] or "Top"
        candidates = told[block, field.name]
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


@pytest.mark.parametrize("name", PAGES)
def test_links_of_a_page_lead_to_its_headings(name: str) -> None:
    page = PAGES[name][0]()
    headings = {heading_anchor(h) for h in re.findall(r"^## (.*)$", page, re.MULTILINE)}
    assert len(headings) == len(re.findall(r"^## ", page, re.MULTILINE))
    linked = set(re.findall(r"\]\(#([^)]*)\)", page))
    assert linked
    assert linked <= headings


SPEC_FAULTS: tuple[tuple[str, Callable[[str], str]], ...] = (
    ("camera", lambda t: t.replace("640", "400")),
    ("camera", lambda t: t.replace("3.6288", "3.9")),
    ("camera", lambda t: t.replace("f_number: 2.9", "f_number: 2.9, vertical_fov_deg: 60")),
    ("camera", lambda t: t.replace("f_number: 2.9", "f_number: 2.9, lens_diameter_mm: 9")),
    ("design.gel", lambda t: t.replace("width_mm: 22}", "width_mm: 22, corner_radius_mm: 11.5}")),
    ("design.leds", lambda t: t + "  leds: {emission: table}\n"),
    ("design.markers", lambda t: t + "  markers: {rows: 40}\n"),
    ("design.markers", lambda t: t + "  markers: {pitch_mm: 0.4}\n"),
    ("material.gel", lambda t: t + "material: {gel: {youngs_modulus_mpa: 147}}\n"),
    ("mesh", lambda t: t + "mesh: {cells_along: 30}\n"),
)
SCENE_FAULTS: tuple[tuple[str, Callable[[str], str]], ...] = (
    ("sensor", lambda t: t.replace("finger.yaml", "finger.yaml, bundle: b")),
    (
        "indenters[]: ring",
        lambda t: t.replace("sphere, radius_mm: 4", "ring, outer_radius_mm: 4, inner_radius_mm: 4"),
    ),
    ("indenters[]: flat_punch", lambda t: t.replace("sphere, radius_mm: 4", "flat_punch")),
    ("motion", lambda t: t.replace("{waypoints", "{csv: a.csv, waypoints")),
    (
        "motion",
        lambda t: t.replace(
            "[{move: press, depth_mm: 0.5}]",
            "[" + ", ".join(["{move: hold, steps: 5000}"] * 4) + "]",
        ),
    ),
    ("observe", lambda t: t.replace("[force]", "[force, force]")),
    ("vary", lambda t: t + "vary: {depth_factor: [1, 0.5]}\n"),
)


def _read(text: str, model: type) -> Any:
    return load_bytes("input.yaml", text.encode(), model)


def test_each_rule_between_fields_has_a_fault_that_breaks_it() -> None:
    assert [block for block, _ in SPEC_RULES] == [block for block, _ in SPEC_FAULTS]
    assert [block for block, _ in SCENE_RULES] == [block for block, _ in SCENE_FAULTS]


@pytest.mark.parametrize(
    ("text", "model", "fault"),
    [(SPEC, Spec, f) for _, f in SPEC_FAULTS] + [(SCENE, Scene, f) for _, f in SCENE_FAULTS],
)
def test_rules_between_fields_are_enforced(
    text: str, model: type, fault: Callable[[str], str]
) -> None:
    assert _read(text, model)
    broken = fault(text)
    assert broken != text
    with pytest.raises(InputError) as raised:
        _read(broken, model)
    assert len(raised.value.problems) == 1, "the fault must break this rule only"


class _Part(BaseModel):
    """One | part."""

    kind: Literal["a", "b"] = "a"


class _Thing(BaseModel):
    """A thing."""

    size_mm: float = Range(gt=0, le=2.5)
    parts: tuple[_Part, ...] | None = Range(default=None, min_length=1)


def test_a_small_model_as_a_page() -> None:
    assert reference_markdown(_Thing).split("\n") == [
        "## Top",
        "",
        "A thing.",
        "",
        "| field | type | unit | default | range | meaning |",
        "|---|---|---|---|---|---|",
        "| `size_mm` | number | mm | **required** | > 0, ≤ 2.5 | – |",
        "| `parts` | list of [parts[]](#parts) | – | none | 1 or more items | – |",
        "",
        "## parts[]",
        "",
        "One | part.",
        "",
        "| field | type | unit | default | range | meaning |",
        "|---|---|---|---|---|---|",
        "| `kind` | `a`, `b` | – | `a` | – | – |",
        "",
    ]
