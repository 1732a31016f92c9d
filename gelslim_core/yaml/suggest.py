"""What the author of a misspelt or misplaced name most likely meant."""

from __future__ import annotations

import re
from difflib import get_close_matches
from itertools import takewhile
from typing import Any

from pydantic import BaseModel

from gelslim_core.yaml.errors import shown
from gelslim_core.yaml.fields import (
    Field,
    children,
    field_table,
    split_unit,
    unit_label,
    without_indices,
)

_SIMILAR = 0.72
_SIMILAR_ELSEWHERE = 0.85
_MOST_NAMED = 3


def suggest_key(
    model: type[BaseModel], parent: str, key: str, value: Any
) -> tuple[str, tuple[str, ...]]:
    """What to write instead of an unknown key in the block at `parent`, and the fields named.

    In this order: the same name in other spelling or with another unit, the same name in another
    block, a similar name here, a similar name elsewhere; failing all, the fields of the block.
    """
    name = _snake_case(key[:80])
    siblings = _distinct(children(model, parent))
    others = _others(model, parent, siblings)
    if any(field.path == key for field in others):
        nested = ": ".join(key.split("."))
        return f"nest it, one level per line: {nested}: ...", (key,)
    found = (
        [field for field in siblings if field.name == name]
        or _same_stem(name, siblings)
        or [field for field in others if field.name == name]
        or _similar(name, siblings, _SIMILAR)
        or _same_stem(name, others)
        or _similar(name, others, _SIMILAR_ELSEWHERE)
    )[:_MOST_NAMED]
    if not found:
        names = ", ".join(field.name for field in siblings)
        block = f"{parent} has the fields" if parent else "the fields are"
        return (f"{block} {names}" if names else "delete it"), ()
    paths = tuple(_with_indices(field.path, parent) for field in found)
    named = [path + _in_unit(field, name, value) for path, field in zip(paths, found, strict=True)]
    return f"did you mean {' or '.join(named)}?", paths


def suggest_choice(value: Any, choices: tuple[Any, ...]) -> str:
    """The remedy for a value that is none of `choices`: the closest one, or all of them."""
    close = closest(str(value), [str(choice) for choice in choices])
    return f"did you mean {close}?" if close else f"write {one_of(choices)}"


def closest(text: str, names: list[str]) -> str | None:
    """The one of `names` most similar to `text`, None where none is similar."""
    wanted = _letters(text[:80])
    by_letters = {_letters(name): name for name in reversed(names)}
    found = get_close_matches(wanted, by_letters, n=1, cutoff=0.6)
    found = found or [key for key in by_letters if wanted and key.startswith(wanted)]
    return by_letters[found[0]] if len(found) == 1 else None


def one_of(choices: tuple[Any, ...]) -> str:
    """`a, b or c`."""
    names = [
        shown(str(choice).lower() if isinstance(choice, bool) else str(choice))
        for choice in choices
    ]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _snake_case(name: str) -> str:
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name.strip())
    return re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")


def _letters(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "", text.lower())


def _same_stem(name: str, fields: tuple[Field, ...]) -> list[Field]:
    stem = split_unit(name)[0]
    return [field for field in fields if stem in (split_unit(field.name)[0], field.name)]


def _similar(name: str, fields: tuple[Field, ...], cutoff: float) -> list[Field]:
    by_name: dict[str, Field] = {}
    for field in reversed(fields):
        # A key without a unit is compared with the names without their units, too.
        if split_unit(name)[1] is None:
            by_name[split_unit(field.name)[0]] = field
        by_name[field.name] = field
    return [by_name[close] for close in get_close_matches(name, by_name, n=1, cutoff=cutoff)]


def _distinct(fields: tuple[Field, ...]) -> tuple[Field, ...]:
    """Each path once: the members of a union may have fields of the same name."""
    return tuple({field.path: field for field in reversed(fields)}.values())[::-1]


def _others(model: type[BaseModel], parent: str, siblings: tuple[Field, ...]) -> tuple[Field, ...]:
    """All fields that are not `siblings`, those in or near the block at `parent` first."""
    own = {field.path for field in siblings}
    others = [field for field in field_table(model) if field.path not in own]
    here = parent.split(".")

    def shared(field: Field) -> int:
        pairs = zip(here, field.path.split("."), strict=False)
        return len(list(takewhile(lambda pair: pair[0] == pair[1], pairs)))

    return tuple(sorted(others, key=shared, reverse=True))


def _with_indices(path: str, parent: str) -> str:
    """`path` with the indices of `parent` where it lies below it."""
    general = without_indices(parent)
    return parent + path[len(general) :] if path.startswith(f"{general}.") else path


def _in_unit(field: Field, name: str, value: Any) -> str:
    """The number of an unknown key in the unit of `field`, or that unit."""
    unit = split_unit(name)[1]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    if unit is None:
        return f" (in{unit_label(field.unit)})" if unit_label(field.unit) else ""
    number = unit.convert(value, field.unit)
    return "" if number is None else f": {number:g}"
