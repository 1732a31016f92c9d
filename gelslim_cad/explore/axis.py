"""What varies: a spec field and its values, from text such as `camera.f_number=2,2.9,4`."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from gelslim_cad.explore.error import ExploreError
from gelslim_cad.spec import Spec
from yaml_model.fields import Field, field_table

Value = float | int | str | None
MOST_VALUES = 100_000
ON_STEP = 1e-9
FORMS = "give PATH=FIRST:LAST:STEP or PATH=A,B,C"


@dataclass(frozen=True)
class Axis:
    """A spec field by its dotted path and the values it takes, as given."""

    path: str
    values: tuple[Value, ...]

    @property
    def numeric(self) -> bool:
        """Whether every value is a number, so that designs along it are derived in one batch."""
        return all(isinstance(v, int | float) for v in self.values)


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
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
    last = name.rsplit(".", 1)[-1]
    close += [p for p in known if p.rsplit(".", 1)[-1] == last and p not in close][:3]
    hint = f"did you mean {' or '.join(close)}?" if close else "`gelslim schema` lists all fields"
    raise ExploreError(f"--vary {text}: the spec has no field {name}; {hint}")


def _leaf(field: Field) -> bool:
    return not any(issubclass(kind, BaseModel) for kind in field.types) and "[]" not in field.path


def _variable(field: Field, text: str) -> Field:
    if list in field.types or field.path in ("format", "name"):
        raise ExploreError(f"--vary {text}: {field.path} is not a field that can vary")
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
    if not ({int, float} & set(field.types)):
        if str in field.types:
            return word
        choices = ", ".join(map(str, field.choices))
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
    """A value as the table writes it."""
    return "none" if value is None else value if isinstance(value, str) else f"{value:g}"
