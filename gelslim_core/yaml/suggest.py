"""What the author of a misspelt or misplaced key most likely meant."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from difflib import SequenceMatcher, get_close_matches
from typing import Any

from pydantic import BaseModel

from gelslim_core.yaml.errors import shown
from gelslim_core.yaml.fields import Field, children, field_table, pattern
from gelslim_core.yaml.units import converted, split_unit

_CLOSE = 0.72
_CLOSE_ELSEWHERE = 0.85
_NAMED = 3
"""Candidates named in one message."""


@dataclass(frozen=True)
class Suggestion:
    """A remedy, and the paths of the fields it names."""

    remedy: str
    paths: tuple[str, ...] = ()


def _snake(name: str) -> str:
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name.strip())
    return re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")


def _nearest(key: str, fields: tuple[Field, ...], cutoff: float) -> list[Field]:
    def score(field: Field) -> float:
        whole = SequenceMatcher(None, key, field.name).ratio()
        stem, unit = split_unit(field.name)
        # A key without its unit is compared with the name without its unit.
        if unit is not None and split_unit(key)[1] is None:
            return max(whole, SequenceMatcher(None, key, stem).ratio())
        return whole

    scored = sorted(((-score(field), i) for i, field in enumerate(fields)))
    return [fields[i] for negative, i in scored if -negative >= cutoff]


def _same_stem(key: str, fields: tuple[Field, ...]) -> list[Field]:
    stem = split_unit(key)[0]
    return [field for field in fields if stem in (split_unit(field.name)[0], field.name)]


def _elsewhere(
    model: type[BaseModel], parent: str, siblings: tuple[Field, ...]
) -> tuple[Field, ...]:
    """All other fields, those in or near the block of the key first."""
    own = {field.path for field in siblings}

    def distance(field: Field) -> int:
        here, there = parent.split(".") if parent else [], field.path.split(".")[:-1]
        common = 0
        for a, b in zip(here, there, strict=False):
            if a != b:
                break
            common += 1
        return len(here) + len(there) - 2 * common

    others = [field for field in field_table(model) if field.path not in own]
    return tuple(sorted(others, key=distance))


def _distinct(fields: tuple[Field, ...]) -> tuple[Field, ...]:
    """Each path once: the members of a union may have fields of the same name."""
    return tuple({field.path: field for field in reversed(fields)}.values())[::-1]


def suggest_key(model: type[BaseModel], parent: str, key: str, value: Any) -> Suggestion:
    """What to write instead of the unknown `key` in the block at `parent`.

    In order: the same name in other spelling or with another unit, the exact name in another
    block, a similar name here, a similar name elsewhere; failing all, the fields of the block.
    """
    name = _snake(key[:80])
    siblings = _distinct(children(model, parent))
    others = _elsewhere(model, parent, siblings)
    dotted = tuple(field for field in others if field.path == key)
    if dotted:
        nested = ": ".join(key.split("."))
        return Suggestion(f"nest it, one level per line: {nested}: ...", (key,))
    found = (
        [field for field in siblings if field.name == name]
        or _same_stem(name, siblings)
        or [field for field in others if field.name == name]
        or _nearest(name, siblings, _CLOSE)
        or _same_stem(name, others)
        or _nearest(name, others, _CLOSE_ELSEWHERE)
    )
    if not found:
        names = ", ".join(field.name for field in siblings)
        block = f"{parent} has the fields" if parent else "the fields are"
        return Suggestion(f"{block} {names}" if names else "delete it")
    found = found[:_NAMED] if _exact(name, found) or len(found) == 1 else found[:1]
    found = [replace(field, path=_beside(field.path, parent)) for field in found]
    named = " or ".join(_named(field, name, value) for field in found)
    return Suggestion(f"did you mean {named}?", tuple(field.path for field in found))


def _beside(path: str, parent: str) -> str:
    """`path` with the indices of `parent` where it lies below it."""
    general = pattern(parent)
    return parent + path[len(general) :] if path.startswith(f"{general}.") else path


def _exact(name: str, found: list[Field]) -> bool:
    stem = split_unit(name)[0]
    return all(stem in (split_unit(field.name)[0], field.name) for field in found)


def _named(field: Field, key: str, value: Any) -> str:
    unit = split_unit(key)[1]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return field.path
    number = converted(value, unit, field.unit)
    if number is not None:
        return f"{field.path}: {number:g}"
    if unit is None and field.unit is not None and field.unit.label:
        return f"{field.path} (in {field.unit.label})"
    return field.path


def suggest_choice(value: Any, choices: tuple[Any, ...]) -> str:
    """The remedy for a value that is none of `choices`: the closest one, or all of them."""
    close = closest(str(value), [str(choice) for choice in choices])
    return f"did you mean {close}?" if close else f"write {one_of(choices)}"


def closest(text: str, names: list[str]) -> str | None:
    """The one of `names` most like `text`, None where none is much like it."""
    wanted = _plain(text[:80])
    by_plain = {_plain(name): name for name in reversed(names)}
    found = get_close_matches(wanted, by_plain, n=1, cutoff=0.6)
    if found:
        return by_plain[found[0]]
    starts = [name for key, name in by_plain.items() if wanted and key.startswith(wanted)]
    return starts[0] if len(starts) == 1 else None


def _plain(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "", text.lower())


def one_of(choices: tuple[Any, ...]) -> str:
    """`a, b or c`."""
    names = [shown(_yaml(choice)) for choice in choices]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _yaml(choice: Any) -> str:
    return {True: "true", False: "false"}[choice] if isinstance(choice, bool) else str(choice)
