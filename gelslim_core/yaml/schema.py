"""A model as JSON Schema, by which editors check and complete the YAML, and as a page to read."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from gelslim_core.yaml.fields import Field, Shape, model_fields

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_HEADER = "| field | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n"
_KINDS = {float: "number", int: "whole number", bool: "true or false", str: "text"}


def schema_text(model: type[BaseModel], identifier: str) -> str:
    """The JSON Schema (draft 2020-12) of a model.

    It holds what a single field can say: names, types, limits, choices, defaults and descriptions.
    Rules between fields are checked by the reader alone, and so is one about numbers: JSON Schema
    calls 2.0 an integer, the reader does not.

    Args:
        model: The class of the model.
        identifier: The `$id` of the schema.

    Returns:
        The schema as text.
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
    if "description" in node:
        node = {**node, "description": _prose(node["description"])}
    return {
        key: _tidy(item, key in ("properties", "$defs"))
        for key, item in node.items()
        if key != "title" and not (key == "default" and isinstance(item, dict))
    }


def _prose(docstring: str) -> str:
    """A docstring without its sections, which say of the fields what their own rows say."""
    return re.split(r"\n\s*(?:Attributes|Raises):\n", docstring)[0].strip()


def reference_markdown(model: type[BaseModel], level: int = 2) -> str:
    """A reference page: a section for the model and for every block below it, each field a row.

    The fields at the top come first, under the heading "Top"; then the blocks in the order of the
    fields, each followed by the blocks inside it.

    Args:
        model: The class of the model.
        level: Level of the headings.

    Returns:
        The sections in Markdown.
    """
    return "\n".join(_sections("Top", "", model, "#" * level))


def heading_anchor(title: str) -> str:
    """The fragment by which web pages of a repository link to a heading."""
    kept = (c for c in title.strip().lower() if c.isalnum() or c in " -_")
    return "".join(kept).replace(" ", "-")


def _sections(title: str, path: str, model: type[BaseModel], marks: str) -> Iterator[str]:
    about = " ".join(_prose(model.__doc__ or "").split()).rstrip(".")
    # The field that distinguishes the members of a union heads its table.
    fields = sorted(model_fields(model, path), key=lambda f: len(f.choices) != 1 or bool(f.types))
    yield f"{marks} {title}\n\n{about}.\n\n{_HEADER}" + "".join(map(_row, fields))
    for field in model_fields(model, path):
        for below, place, heading in _blocks(field):
            yield from _sections(heading, place, below, marks)


def _blocks(field: Field) -> list[tuple[type[BaseModel], str, str]]:
    """The blocks that a field may hold, itself or as items of a list: model, path and heading."""
    items = field.item.models if field.item else ()
    path = f"{field.path}[]" if items else field.path
    models = field.models or items
    kinds = [_kind(model) for model in models] if len(models) > 1 else [""] * len(models)
    return [
        (model, path, f"{path}: {kind}" if kind else path)
        for model, kind in zip(models, kinds, strict=True)
    ]


def _kind(model: type[BaseModel]) -> str:
    """The constant by which a member of a union is known."""
    return next(str(f.choices[0]) for f in model_fields(model) if len(f.choices) == 1)


def _row(field: Field) -> str:
    cells = (
        f"`{field.name}`",
        _type(field),
        field.unit.label if field.unit and field.unit.label else "–",
        _default(field),
        _range(field) or "–",
        field.description or "–",
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def _type(field: Field) -> str:
    links = [
        f"[{heading.rpartition(': ')[2]}](#{heading_anchor(heading)})"
        for _, _, heading in _blocks(field)
    ]
    words = _words(field)
    if links:
        words.append(("block " if field.models else "list of ") + ", ".join(links))
    return " or ".join(words)


def _words(shape: Shape) -> list[str]:
    """The types of a value, blocks left out."""
    words = list(dict.fromkeys(_KINDS[kind] for kind in shape.types if kind in _KINDS))
    if shape.choices:
        words.append(", ".join(f"`{_yaml(choice)}`" for choice in shape.choices))
    if shape.item and not shape.item.models:
        inner = " or ".join(_words(shape.item)).replace("list of", "lists of")
        words.append(f"list of {re.sub('number(?!s)', 'numbers', inner)}")
    return words


def _default(field: Field) -> str:
    if field.required:
        return "**required**"
    if isinstance(field.default, BaseModel):
        return "its defaults"
    return "none" if field.default is None else f"`{_yaml(field.default)}`"


def _yaml(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_yaml(item) for item in value)}]"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() else f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def _range(shape: Shape) -> str:
    """Limits of a value, of its length, and of its items."""
    low = max(((v, k) for k, v in shape.limits if k in ("gt", "ge")), default=None)
    high = min(((v, k) for k, v in shape.limits if k in ("lt", "le")), default=None)
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    parts = [f"{signs[end[1]]} {_yaml(end[0])}" for end in (low, high) if end]
    if low and high and (low[1], high[1]) == ("ge", "le"):
        parts = [f"{_yaml(low[0])} to {_yaml(high[0])}"]
    parts.append(_length(shape))
    parts.append(f"`{shape.pattern}`" if shape.pattern else "")
    inner = _range(shape.item) if shape.item else ""
    parts.append(f"each {inner}" if inner else "")
    return ", ".join(part for part in parts if part)


def _length(shape: Shape) -> str:
    (low, high), noun = shape.length, "items" if shape.item else "characters"
    if high is None:
        return f"{low} or more {noun}" if low else ""
    if low == high:
        return f"{low} {noun}"
    return f"{low} to {high} {noun}" if low else f"up to {high} {noun}"
