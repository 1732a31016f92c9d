"""The committed JSON Schema is the models', and agrees with the reader."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from reader_cases import MINIMAL, load, with_length
from ruamel.yaml import YAML

from gelslim_cad.spec.reference import schema_text
from gelslim_cad.spec.spec import Spec
from gelslim_cad.spec.starter import starter_text
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.fields import field_table

COMMITTED = Path(__file__).parents[2] / "docs" / "gelslim-spec-1.schema.json"
SCHEMA = json.loads(schema_text())
VALIDATOR = Draft202012Validator(SCHEMA)


def test_the_committed_schema_matches_the_models():
    assert COMMITTED.read_text(encoding="utf-8") == schema_text(), (
        f"the models changed: `gelslim schema > docs/{COMMITTED.name}`"
    )


def test_it_is_a_valid_draft_2020_12_schema():
    Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$id"] == "gelslim-spec/1"
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def _objects(node):
    if isinstance(node, dict):
        if node.get("type") == "object":
            yield node
        for value in node.values():
            yield from _objects(value)
    elif isinstance(node, list):
        for value in node:
            yield from _objects(value)


def test_no_block_takes_unknown_keys_and_every_field_is_described():
    blocks = list(_objects(SCHEMA))
    assert len(blocks) > 10
    for block in blocks:
        assert block["additionalProperties"] is False
        assert all(item.get("description") for item in block["properties"].values())
    names = {name for block in blocks for name in block["properties"]}
    assert names == {field.name for field in field_table(Spec)}


ACCEPTED = [
    MINIMAL,
    starter_text("full"),
    MINIMAL + "mesh:\n  layers: 3\n  cells_along: 40\n  cells_across: 40\n",
    MINIMAL + "manufacturing:\n  acrylic_stock_mm: [2, 2.5]\n  fabric_skin: false\n",
    MINIMAL + "  markers:\n    rows: null\n    anchors: omitted\n",
]
REFUSED = [
    *(
        with_length(value)
        for value in ("-2", "121", "true", '"12"', "null", "[24]", "{a: 1}", "no")
    ),
    MINIMAL + "    thicknes_mm: 2\n",
    MINIMAL.replace("    length_mm: 24\n", ""),
    MINIMAL.replace("spec/1", "spec/2"),
    MINIMAL.replace("name: sample", "name: two words"),
    MINIMAL.replace("name: sample", "name: 3"),
    MINIMAL + "mesh:\n  layers: 2.5\n",
    MINIMAL + "mesh:\n  element: hex\n",
    MINIMAL + "mesh:\n",
    MINIMAL + "manufacturing:\n  acrylic_stock_mm: []\n",
    MINIMAL + "manufacturing:\n  acrylic_stock_mm: [2, 0]\n",
    MINIMAL + "manufacturing:\n  fabric_skin: 1\n",
    MINIMAL + "material:\n  gel:\n    poissons_ratio: 0.5\n",
]


@pytest.mark.parametrize("text", ACCEPTED)
def test_what_the_reader_accepts_the_schema_accepts(text):
    load(text)
    VALIDATOR.validate(YAML(typ="safe", pure=True).load(text))


@pytest.mark.parametrize("text", REFUSED)
def test_what_the_schema_refuses_the_reader_refuses(text):
    assert not VALIDATOR.is_valid(YAML(typ="safe", pure=True).load(text))
    with pytest.raises(InputError):
        load(text)


def test_descriptions_of_blocks_hold_no_sections_of_docstrings():
    assert "Attributes:" in (Spec.__doc__ or "")
    for block in _objects(SCHEMA):
        assert "\n\n" not in block["description"]
