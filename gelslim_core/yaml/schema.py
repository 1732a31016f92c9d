"""The JSON Schema of a model, by which editors check and complete the YAML."""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_text(model: type[BaseModel], identifier: str) -> str:
    """The JSON Schema (draft 2020-12) of `model` as text with the `$id` `identifier`.

    It holds what a single field can tell: names, types, limits, choices, defaults and
    descriptions. Rules between fields are the reader's alone, and so is one about numbers:
    JSON Schema calls 2.0 an integer, the reader does not.
    """
    body = model.model_json_schema(mode="validation")
    schema = {"$schema": DIALECT, "$id": identifier, **_tidy(body)}
    return json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _tidy(node: Any, is_names: bool = False) -> Any:
    """`node` without titles that repeat the name, and without defaults that repeat whole blocks.

    `is_names` marks a mapping whose keys are field names, of which none is a keyword.
    """
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    if is_names:
        return {name: _tidy(item) for name, item in node.items()}
    return {
        key: _tidy(item, key in ("properties", "$defs"))
        for key, item in node.items()
        if key != "title" and not (key == "default" and isinstance(item, dict))
    }
