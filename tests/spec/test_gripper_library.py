"""Grippers of the library: figures with sources, and specs that take them."""

from __future__ import annotations

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from gelslim_cad.spec import Spec
from gelslim_cad.spec.camera_library import lend_fields
from gelslim_cad.spec.gripper_library import (
    GRIPPERS,
    GripperLibraryError,
    LibraryGripper,
    gripper_names,
    library_gripper,
)
from gelslim_cad.spec.reference import schema_text
from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.reader import Loaded, load_bytes

TEXT = """\
format: gelslim-spec/1
name: finger
camera: {model: ov9281}
design:
  gel: {length_mm: 24, width_mm: 22}
  mount:
    gripper: wsg50
"""


def load(text: str) -> Loaded[Spec]:
    return load_bytes("finger.yaml", text.encode(), Spec, lend_fields)


def problem(text: str) -> Problem:
    with pytest.raises(InputError) as caught:
        load(text)
    (found,) = caught.value.problems
    return found


def test_the_names_are_those_of_the_files() -> None:
    assert set(gripper_names()) == {path.stem for path in GRIPPERS.glob("*.yaml")}
    assert gripper_names()[0] == "generic"


@pytest.mark.parametrize("name", gripper_names())
def test_every_figure_has_one_source(name: str) -> None:
    entry = library_gripper(name)
    for figure in entry.figures:
        assert sum(figure in source.gives for source in entry.sources) == 1, figure
        assert entry.source(figure).text
    with pytest.raises(KeyError):
        entry.source("colour")
    assert load(TEXT.replace("wsg50", name)).model.design.mount.gripper == name


def test_known_sheets() -> None:
    franka, weiss = library_gripper("franka_hand"), library_gripper("wsg50")
    # Two fingers of 40 mm each; two jaws of 55 mm each.
    assert (franka.stroke_mm, weiss.stroke_mm) == (80, 110)
    assert library_gripper("robotiq_2f85").force_n == (20, 235)
    assert library_gripper("generic").stroke_mm is None


def broken(old: str, new: str) -> str:
    text = (GRIPPERS / "robotiq_2f85.yaml").read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    "text",
    [
        broken("payload_kg, mass_kg]", "payload_kg]"),
        broken("gives: [jaw.bolt]", "gives: [jaw.bolt, jaw.face]"),
        broken("[20.0, 235.0]", "[235.0, 20.0]"),
        broken("[20.0, 235.0]", "[20.0, 20.0]"),
        broken("  closed_gap_mm: 13.2\n", ""),
        broken("[[0.0, -9.0], [0.0, 9.0]]", "[[0.0, 9.0], [0.0, 9.0]]"),
        broken("[[0.0, -9.0], [0.0, 9.0]]", "[[0.0, -9.0], [0.0, 19.0]]"),
        broken("[[0.0, -9.0], [0.0, 9.0]]", "[[11.5, -9.0], [0.0, 9.0]]"),
        broken("[[0.0, -9.0], [0.0, 9.0]]", "[]"),
        broken("bolt: M5", "bolt: M7"),
        broken("face: lateral", "face: upward"),
        broken("stroke_mm: 85.0", "stroke_mm: 0"),
        broken("stroke_mm: 85.0", "strok_mm: 85.0"),
    ],
    ids=[
        "unsourced", "twice", "falling", "no_range", "gap", "same_hole", "beyond", "beside",
        "no_hole", "bolt", "face", "stroke", "name",
    ],
)  # fmt: skip
def test_a_file_that_is_not_consistent_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        load_bytes("gripper.yaml", text.encode(), LibraryGripper)


@pytest.mark.parametrize("wrong", ["WSG-5O", "franka", "robotiq", "", "zzz", "3"])
def test_an_unknown_gripper_is_told_what_there_is(wrong: str) -> None:
    found = problem(TEXT.replace("wsg50", f'"{wrong}"'))
    assert (found.field, found.line) == ("design.mount.gripper", 7)
    told = found.message + found.remedy
    assert all(name in told for name in gripper_names()), told
    with pytest.raises(GripperLibraryError, match="franka_hand"):
        library_gripper(wrong)


def test_a_close_name_is_suggested() -> None:
    assert "did you mean wsg50?" in problem(TEXT.replace("wsg50", "WSG-50")).remedy
    assert "did you mean franka_hand?" in problem(TEXT.replace("wsg50", "franka-hand")).remedy


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("flange_bolt", "M2"), ("flange_bolt_spacing_mm", 4.9), ("flange_thickness_mm", 1.9),
        ("grip_force_n", 0), ("object_size_mm", -1), ("object_mass_g", ".nan"),
    ],
)  # fmt: skip
def test_a_field_out_of_range_is_named(field: str, value: object) -> None:
    found = problem(TEXT + f"    {field}: {value}\n")
    assert (found.field, found.line) == (f"design.mount.{field}", 8)


def test_the_schema_knows_the_names() -> None:
    schema = Draft202012Validator(YAML(typ="safe").load(schema_text()))
    content = YAML(typ="safe").load(TEXT)
    assert schema.is_valid(content)
    content["design"]["mount"]["gripper"] = "wsg51"
    assert not schema.is_valid(content)
