"""The designs to explore: every combination of the values of some spec fields.

A field and its values come from text such as `camera.f_number=2,2.9,4`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from gelslim_cad.spec import Spec
from gelslim_cad.spec.camera_library import own_fields
from gelslim_cad.spec.reader import suggestion
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.fields import Field, field_table

Value = float | int | str | None
MOST_VALUES = 100_000
MOST_TOLD = 4
ON_STEP = 1e-9
FORMS = "give PATH=FIRST:LAST:STEP or PATH=A,B,C"
FIXED = ("format", "name")
YES_NO = {"true": True, "false": False}
CHUNK = 500
"""Designs per chunk; the same for every engine, so that batches and hence values are too."""
MOST_DESIGNS = 5_000_000


@dataclass(frozen=True)
class Axis:
    """A spec field by its dotted path and the values it takes, as given."""

    path: str
    values: tuple[Value, ...]

    @property
    def numeric(self) -> bool:
        """Whether every value is a number, so that designs along it are derived in one batch."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)


def parse_axis(text: str) -> Axis:
    """`PATH=16:50:1` (both ends in, where the step meets the last) or `PATH=2,2.9,4`.

    The `design.` before a path may be left out. `none` leaves an optional field out. Raises
    ExploreError for an unknown path, an unreadable or repeated value, an empty range.
    """
    name, sign, listed = text.partition("=")
    if not sign or not listed.strip():
        raise ExploreError(f"--vary {text}: no values; {FORMS}")
    field = _field(name.strip(), text)
    if ":" in listed:
        values: tuple[Value, ...] = _range(listed, text, field)
    else:
        values = tuple(_value(v.strip(), text, field) for v in listed.split(","))
    if len(set(values)) < len(values):
        raise ExploreError(f"--vary {text}: a value is given twice; leave one out")
    return Axis(field.path, values)


def _field(name: str, text: str) -> Field:
    known = {f.path: f for f in field_table(Spec) if _leaf(f)}
    for path in (name, f"design.{name}"):
        if path in known:
            return _variable(known[path], text)
    inside = [p for p in known if p.startswith((f"{name}.", f"design.{name}."))]
    if inside:
        listed = ", ".join(inside[:MOST_TOLD]) + (", ..." if len(inside) > MOST_TOLD else "")
        raise ExploreError(f"--vary {text}: {name} is a block; vary one of its fields: {listed}")
    hint = suggestion(name, known, "`gelslim schema` lists all fields")
    raise ExploreError(f"--vary {text}: the spec has no field {name}; {hint}")


def _leaf(field: Field) -> bool:
    return not any(issubclass(kind, BaseModel) for kind in field.types) and "[]" not in field.path


def _variable(field: Field, text: str) -> Field:
    why = "is a list" if list in field.types else "names the spec" if field.path in FIXED else ""
    if why:
        raise ExploreError(
            f"--vary {text}: {field.path} {why} and not a field that can vary; write a spec for "
            "each and compare them with `gelslim diff`"
        )
    return field


def _range(listed: str, text: str, field: Field) -> tuple[Value, ...]:
    pieces = listed.split(":")
    if len(pieces) != 3:
        raise ExploreError(f"--vary {text}: a range has three numbers; {FORMS}")
    first, last, step = (_number(p.strip(), text) for p in pieces)
    if step == 0 or (last - first) / step < 0:
        raise ExploreError(f"--vary {text}: the step does not lead from first to last")
    count = math.floor((last - first) / step + ON_STEP) + 1
    if count > MOST_VALUES:
        raise ExploreError(f"--vary {text}: {count} values, at most {MOST_VALUES} per field")
    return tuple(_typed(float(f"{first + k * step:.12g}"), text, field) for k in range(count))


def _value(word: str, text: str, field: Field) -> Value:
    if word in field.choices:
        return word
    if word == "none" and field.nullable:
        return None
    if bool in field.types and word.lower() in YES_NO:
        return YES_NO[word.lower()]
    if not ({int, float} & set(field.types)):
        if str in field.types:
            return word
        choices = ", ".join([*map(str, field.choices), *(YES_NO if bool in field.types else ())])
        raise ExploreError(f"--vary {text}: {word!r} must be one of {choices}")
    return _typed(_number(word, text), text, field)


def _typed(value: float, text: str, field: Field) -> Value:
    if float in field.types:
        return value
    if value != round(value):
        raise ExploreError(f"--vary {text}: {field.path} takes whole numbers, not {value:g}")
    return round(value)


def _number(word: str, text: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ExploreError(f"--vary {text}: {word!r} is no number; {FORMS}")
    return value


def shown(value: Any) -> str:
    """A value in the form that the table shows."""
    if isinstance(value, bool):
        return str(value).lower()
    return "none" if value is None else value if isinstance(value, str) else f"{value:g}"


class ExploreError(GelslimError, ValueError):
    """The request cannot be explored; the message names the reason and the remedy."""


@dataclass(frozen=True)
class Space:
    """A spec and the axes that vary; designs are numbered with the last axis fastest."""

    spec: Spec
    axes: tuple[Axis, ...]

    @classmethod
    def of(cls, spec: Spec, axes: Sequence[Axis]) -> Space:
        """The space; raises ExploreError where there is no axis, one twice, or too many designs."""
        paths = [a.path for a in axes]
        if not paths:
            raise ExploreError("nothing varies; give at least one --vary PATH=FIRST:LAST:STEP")
        twice = sorted({p for p in paths if paths.count(p) > 1})
        if twice:
            raise ExploreError(f"--vary gives {twice[0]} twice; join its values")
        space = cls(spec, tuple(axes))
        if space.count > MOST_DESIGNS:
            raise ExploreError(
                f"{space.count} designs are more than {MOST_DESIGNS}; use larger steps"
            )
        return space

    @property
    def count(self) -> int:
        """Number of designs."""
        return math.prod(len(a.values) for a in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values per axis."""
        return tuple(len(a.values) for a in self.axes)

    def chunks(self) -> Iterator[tuple[int, int]]:
        """First design and one past the last, chunk by chunk."""
        for start in range(0, self.count, CHUNK):
            yield start, min(start + CHUNK, self.count)

    def rows(self, start: int, stop: int) -> list[tuple[Value, ...]]:
        """Values of the axes of the designs from `start` to before `stop`."""
        return [self.row(k) for k in range(start, stop)]

    def row(self, index: int) -> tuple[Value, ...]:
        """Values of the axes of one design."""
        values: list[Value] = []
        for axis in reversed(self.axes):
            index, k = divmod(index, len(axis.values))
            values.append(axis.values[k])
        return tuple(reversed(values))


EXCHANGING = {"camera.model", "camera.mode", "camera.orientation"}


def changed(spec: Spec, overrides: Mapping[str, Any]) -> Spec:
    """The spec with fields replaced by dotted path; raises ValidationError where it is illegal.

    Another camera of the library, mode or orientation brings its own fields along; those that the
    spec itself gives stay.
    """
    content = spec.model_dump()
    exchanged = not EXCHANGING.isdisjoint(overrides)
    if exchanged and overrides.get("camera.model", spec.camera.model) is not None:
        content["camera"] = own_fields(content["camera"])
    for path, value in overrides.items():
        *blocks, last = path.split(".")
        inner = content
        for name in blocks:
            inner = inner[name]
        inner[last] = value
    return Spec.model_validate(content)


def illegal(spec: Spec, overrides: Mapping[str, Any]) -> str:
    """Why the spec would not accept the values; empty where it does."""
    try:
        changed(spec, overrides)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(p) for p in first["loc"] if not str(p).startswith("function-"))
        words = str(first["msg"]).removeprefix("Value error, ")
        return f"{place}: {words}" if place else words
    return ""


def grouped(
    axes: Sequence[Axis], rows: Sequence[tuple[Value, ...]]
) -> Iterator[tuple[dict[str, Value], dict[str, list[float | int]], list[int]]]:
    """Groups of rows that share all values that are not numbers.

    Yields those values, the numbers of the group as columns, and the rows' places.
    """
    words = [k for k, a in enumerate(axes) if not a.numeric]
    numbers = [k for k, a in enumerate(axes) if a.numeric]

    def key(place: int) -> tuple[str, ...]:
        return tuple(repr(rows[place][k]) for k in words)

    for _, found in itertools.groupby(sorted(range(len(rows)), key=key), key):
        places = list(found)
        fixed = {axes[k].path: rows[places[0]][k] for k in words}
        columns: dict[str, list[float | int]] = {
            axes[k].path: [rows[p][k] for p in places]  # type: ignore[misc]
            for k in numbers
        }
        yield fixed, columns, places
