"""What a field wants, in words: its kind, its limits, its unit, its default."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from gelslim_core.yaml.fields import Field
from gelslim_core.yaml.suggest import one_of
from gelslim_core.yaml.units import split_unit

SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_KINDS = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


def kind_phrase(field: Field | None, item: bool = False) -> str:
    """`a number`, `a whole number or auto`, `one of a, b or c`, `a block of fields`."""
    if field is None:
        return "another kind of value"
    if item:
        return "a number" if field.item_limits else "an item of another kind"
    phrases = list(dict.fromkeys(_kind(kind) for kind in field.types))
    if field.choices:
        phrases.append(one_of(field.choices))
    return " or ".join(phrases) or "another kind of value"


def _kind(kind: type) -> str:
    if issubclass(kind, BaseModel):
        return "a block of fields"
    if issubclass(kind, list | tuple | set | frozenset):
        return "a list"
    return _KINDS.get(kind, "another kind of value")


def number(value: float) -> str:
    """A limit as a person writes it: no trailing zeros."""
    return f"{value:.12g}"


def unit_label(field: Field | None) -> str:
    """` mm`, with its space; empty without a unit."""
    unit = field.unit if field else None
    return f" {unit.label}" if unit and unit.label else ""


def range_phrase(field: Field, item: bool = False) -> str:
    """`from 0.3 to 15 mm`, `above 0 and up to 2`, `above 0 mm`; empty without limits."""
    limits = field.item_limits if item else field.limits
    low = max(((v, k) for k, v in limits if k in ("gt", "ge")), default=None)
    high = min(((v, k) for k, v in limits if k in ("lt", "le")), default=None)
    unit = unit_label(field)
    if low and high and (low[1], high[1]) == ("ge", "le"):
        return f"from {number(low[0])} to {number(high[0])}{unit}"
    words = []
    if low:
        words.append(("above " if low[1] == "gt" else "at least ") + number(low[0]))
    if high:
        words.append(("below " if high[1] == "lt" else "at most ") + number(high[0]))
    return " and ".join(words) + unit if words else ""


def give(field: Field | None, item: bool = False) -> str:
    """The remedy for a bad value: what to give instead, and the default where there is one."""
    if field is None:
        return "correct the value"
    if not item and any(issubclass(kind, BaseModel) for kind in field.types):
        return f"write the fields of {field.name} below it, indented{_required_names(field)}"
    if not item and list in field.types:
        return f"give a list, as in [1, 2]{_or_default(field)}"
    wanted = _wanted(field, item)
    return f"give {wanted}" + ("" if item else _or_default(field))


def _required_names(field: Field) -> str:
    names = [
        name
        for model in field.models[:1]
        for name, info in model.model_fields.items()
        if info.is_required()
    ]
    return f": at least {', '.join(names)}" if names else ""


def _wanted(field: Field, item: bool) -> str:
    numeric = item or float in field.types or int in field.types
    if not numeric:
        return kind_phrase(field)
    noun = split_unit(field.name)[0].replace("_", " ")
    limits = field.item_limits if item else field.limits
    if dict(limits) == {"gt": 0.0}:
        unit = unit_label(field)
        return f"a positive {noun}" + (f" in{unit}" if unit else "")
    spread = range_phrase(field, item)
    whole = "a whole number for " if int in field.types and not item else ""
    extra = f" (or {one_of(field.choices)})" if field.choices else ""
    article = "" if whole or _plural(noun) else _article(noun)
    return f"{whole}{article}{noun}" + (f" {spread}" if spread else _in_unit(field)) + extra


def _in_unit(field: Field) -> str:
    unit = unit_label(field)
    return f" in{unit}" if unit else ""


def _plural(noun: str) -> bool:
    return noun.endswith("s") and not noun.endswith(("ss", "us"))


def _article(noun: str) -> str:
    return "an " if noun[:1] in "aeio" or noun.startswith("f ") else "a "


def _or_default(field: Field) -> str:
    if field.required:
        return ""
    if field.default is None or isinstance(field.default, BaseModel | tuple | list):
        return ", or delete the line"
    return f", or delete the line for the default {default_text(field.default)}"


def default_text(value: Any) -> str:
    """A default as YAML: `0.3333`, `true`, `odd_sized`."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def missing_remedy(field: Field | None, parent: str, required: tuple[Field, ...]) -> str:
    """What to add for the missing `field` of the block at `parent`."""
    if field is None:
        return "add it"
    where = f" under {parent}" if parent else ""
    about = field.description[:1].lower() + field.description[1:]
    if field.models:
        names = ", ".join(child.name for child in required)
        return f"add the block `{field.name}:`{where} with at least {names or 'one field'}" + (
            f" ({about})" if about else ""
        )
    if field.name == "format" and len(field.choices) == 1:
        return f"write `format: {field.choices[0]}` as the first line"
    notes = ", ".join(note for note in (about, range_phrase(field)) if note)
    value = one_of(field.choices) if field.choices else "..."
    return f"add `{field.name}: {value}`{where}" + (f" ({notes})" if notes else "")
