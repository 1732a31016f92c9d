"""The description of a sensor: its starter, its schema, and what is wrong with a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from imported_samples import described
from jsonschema import Draft202012Validator
from pydantic import BaseModel

from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.fields import model_fields
from gelslim_core.yaml.reader import load_bytes
from gelslim_force.imported.description import SensorDescription, read_description
from gelslim_force.imported.starter import schema_text, starter_text


def leaves(content: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(content, dict):
        return {k: v for n, c in content.items() for k, v in leaves(c, f"{prefix}{n}.").items()}
    return {prefix.removesuffix("."): content}


def test_the_starter_shows_every_field_with_its_default() -> None:
    text = starter_text("mine")
    loaded = load_bytes("mine.yaml", text.encode(), SensorDescription)
    assert loaded.model.name == "mine"
    lines = [line.partition("##")[0].replace("# ", "", 1) for line in text.splitlines()]
    shown = yaml.safe_load("\n".join(line for line in lines if not line.startswith("#")))
    told = leaves(shown)
    defaults = leaves(loaded.model.model_dump(mode="json"))
    for field in model_fields(SensorDescription):
        name = field.path.partition("[")[0]
        assert any(path == name or path.startswith(f"{name}.") for path in told), name
    same = {n: v for n, v in told.items() if n in loaded.defaulted and defaults[n]}
    assert len(same) >= 9
    assert {n: defaults[n] for n in same} == same


def test_the_schema_takes_the_starter_and_refuses_a_misspelt_field() -> None:
    check = Draft202012Validator(json.loads(schema_text()))
    content = yaml.safe_load(starter_text("mine"))
    assert list(check.iter_errors(content)) == []
    assert list(check.iter_errors({**content, "gle": {}})) != []


def test_every_field_is_described() -> None:
    def described_fields(model: type[BaseModel]) -> None:
        for name, field in model.model_fields.items():
            inner = field.annotation
            if isinstance(inner, type) and issubclass(inner, BaseModel):
                described_fields(inner)
            else:
                assert field.description or name in ("windows",), name

    described_fields(SensorDescription)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"gel": {"length_mm": None}}, "gel.length_mm"),
        ({"gel": {"corner_radius_mm": 12.0}}, "gel.corner_radius_mm"),
        ({"gel": {"youngs_modulus_mpa": 200.0}}, "gel.youngs_modulus_mpa"),
        ({"gel": {"poissons_ratio": 0.5}}, "gel.poissons_ratio"),
        ({"markers": {"pitch_mm": None}}, "markers.pitch_mm"),
        ({"markers": {"diameters_px": [20.0, 6.0]}}, "markers.diameters_px"),
        ({"markers": {"pitch_mm": None, "pitch_across_mm": 1.0}}, "markers.pitch_across_mm"),
        ({"view": {"x_points": "north"}}, "view.x_points"),
        ({"view": {"points": [{"gel_mm": [0, 0], "picture_px": [1, 1]}]}}, "view.points"),
        ({"view": {"homography": [[1.0, 0, 0], [0, 1.0, 0]]}}, "view.homography"),
        ({"view": {"pinhole": {"position_mm": [0, 0, -20]}}}, "lens.focal_px"),
        (
            {"view": {"homography": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]],
                      "gel_middle_px": [1.0, 2.0]}},
            "view.gel_middle_px",
        ),
        ({"lens": {"focal_px": 600.0, "field_of_view_deg": 60.0}}, "lens.field_of_view_deg"),
        ({"windows": [{"index": 1.5}]}, "windows[0].thickness_mm"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_its_field(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as refused:
        described(**changes)
    assert field in [problem.field for problem in refused.value.problems]


def test_a_problem_has_its_line(tmp_path: Path) -> None:
    path = tmp_path / "sensor.yaml"
    path.write_text(starter_text("mine").replace("thickness_mm: 3", "thickness_mm: -3", 1))
    with pytest.raises(InputError) as refused:
        read_description(path)
    (problem,) = refused.value.problems
    assert path.read_text().splitlines()[problem.line - 1].strip().startswith("thickness_mm: -3")
