"""What varies: a spec field and its values, from text such as `camera.f_number=2,2.9,4`."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from gelslim_cad.spec import Spec
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.fields import Field, field_table

Value = float | int | str | None
MOST_VALUES = 100_000
MOST_TOLD = 4
ON_STEP = 1e-9
FORMS = "give PATH=FIRST:LAST:STEP or PATH=A,B,C"
FIXED = ("format", "name")
YES_NO = {"true": True, "false": False}


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
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
    last = name.rsplit(".", 1)[-1]
    close += [p for p in known if p.rsplit(".", 1)[-1] == last and p not in close][:3]
    hint = f"did you mean {' or '.join(close)}?" if close else "`gelslim schema` lists all fields"
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
