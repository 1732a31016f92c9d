"""The errors of pydantic as problems: field, line, value, limit, and what to write instead."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel

from gelslim_core.yaml.base import Unsupported
from gelslim_core.yaml.document import (
    CORRECT_VALUE,
    Document,
    Path,
    PathPart,
    RefusedScalarError,
    join_path,
    resolve,
)
from gelslim_core.yaml.errors import FieldError, Problem, shown
from gelslim_core.yaml.fields import (
    UNITS,
    Field,
    Shape,
    Unit,
    children,
    field_at,
    range_text,
    unit_label,
)
from gelslim_core.yaml.source import Position
from gelslim_core.yaml.suggest import one_of, suggest_choice, suggest_key

_KINDS = {
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    str: "text",
    list: "a list",
}
_SIGNS = {
    "greater_than": ("gt", ">"),
    "greater_than_equal": ("ge", ">="),
    "less_than": ("lt", "<"),
    "less_than_equal": ("le", "<="),
}
_RULES = ("value_error", "assertion_error")
_TRUTH_WORDS = {
    **dict.fromkeys(("yes", "y", "on", "true", "1"), "true"),
    **dict.fromkeys(("no", "n", "off", "false", "0"), "false"),
}
_QUANTITY = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµμ°%]+)\Z")
_SYMBOLS = {"µm": "um", "μm": "um", "°": "deg", "%": "percent", "degree": "deg", "degrees": "deg"}


@dataclass(frozen=True)
class Complaint:
    """One error of pydantic and the value that it is about."""

    kind: str
    detail: Mapping[str, Any]
    text: str
    path: Path
    """The value, as far as the location of the error exists in the file."""
    labels: Path
    """Parts of the location that name no value: missing fields and members of unions."""
    depth: int
    """Length of the path before the first label."""

    @property
    def is_rule(self) -> bool:
        """Whether a validator of ours raised it, which runs only where all else fits."""
        return self.kind in _RULES


def settle_unions(complaints: list[Complaint]) -> list[Complaint]:
    """`complaints` with those about one value of a union reduced to the member that was meant.

    Pydantic reports every member. The one was meant whose fields are at fault rather than its
    type; of several such the one with fewest faults. For a plain value it is the one whose limits
    the value breaks, as its type was right.
    """
    groups: dict[Path, dict[PathPart, list[Complaint]]] = {}
    settled: list[Complaint] = []
    for complaint in complaints:
        labels = complaint.labels[:-1] if complaint.kind == "missing" else complaint.labels
        if labels:
            members = groups.setdefault(complaint.path[: complaint.depth], {})
            members.setdefault(labels[0], []).append(complaint)
        else:
            settled.append(complaint)
    for base, members in groups.items():
        settled += _meant_member(base, list(members.values()))
    return settled


def _meant_member(base: Path, members: list[list[Complaint]]) -> list[Complaint]:
    if len(members) == 1:
        return members[0]
    right_type = [
        member
        for member in members
        if all(len(c.path) > len(base) or c.kind == "missing" or c.is_rule for c in member)
    ]
    if right_type:
        return min(right_type, key=lambda m: (sum(c.kind == "literal_error" for c in m), len(m)))
    flat = [complaint for member in members for complaint in member]
    limits = [complaint for complaint in flat if complaint.kind in _SIGNS]
    literals = [complaint for complaint in flat if complaint.kind == "literal_error"]
    return (limits or literals or flat)[:1]


def value_remedy(shape: Shape | None, unit: Unit | None = None) -> str:
    """What to write instead of a bad value, with its range, its unit and its default."""
    if shape is None:
        return CORRECT_VALUE
    default = ""
    if isinstance(shape, Field) and not shape.required:
        default = ", or delete the line"
        if shape.default is not None and not isinstance(shape.default, BaseModel | tuple | list):
            default += f" for the default {_yaml(shape.default)}"
    if shape.models:
        names = [n for n, info in shape.models[0].model_fields.items() if info.is_required()]
        return "write its fields below it, indented" + (f": {', '.join(names)}" if names else "")
    if list in shape.types:
        return f"write a list in brackets, as in [1, 2]{default}"
    span = range_text(shape, unit)
    if not span and {int, float} & set(shape.types) and unit_label(unit):
        span = f"in{unit_label(unit)}"
    return f"give {_expected(shape)}" + (f" {span}" if span else "") + default


def _yaml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _expected(shape: Shape | None) -> str:
    """`a number`, `a whole number or auto`, `a, b or c`, `a block of fields`."""
    if shape is None:
        return "another kind of value"
    kinds = ["a block of fields" if k in shape.models else _KINDS.get(k, "") for k in shape.types]
    words = tuple(word for word in dict.fromkeys(kinds) if word) + shape.choices
    return one_of(words) if words else "another kind of value"


@dataclass(frozen=True)
class Translator:
    """Turns complaints about one document into problems."""

    document: Document
    model: type[BaseModel]

    def problem(self, complaint: Complaint) -> tuple[Problem, tuple[str, ...]]:
        """The problem, and the fields that its remedy suggests."""
        path = complaint.path
        refused = self._unsupported(complaint)
        if refused is not None:
            position = self.document.marks[path].key
            return self._at(path, f"{refused.what} is not supported", refused.remedy, position), ()
        if complaint.kind == "extra_forbidden":
            parent, key = join_path(path[:-1]), str(path[-1])
            remedy, fields = suggest_key(self.model, parent, key, self.document.value(path))
            return self._at(path, "unknown field", remedy, self.document.marks[path].key), fields
        if complaint.kind == "missing":
            return self._missing(complaint), ()
        if complaint.is_rule:
            return self._broken_rule(complaint), ()
        if complaint.kind == "union_tag_invalid":
            path, *_ = self.document.locate((*path, _tag(complaint)))
            tags = tuple(re.findall("'([^']*)'", str(complaint.detail.get("expected_tags", ""))))
            remedy = suggest_choice(self.document.value(path), tags)
            return self._at(path, f"must be {one_of(tags)}", remedy), ()
        shape, unit = self._shape(join_path(path))
        message, remedy = self._bad_value(complaint, shape, unit)
        return self._at(path, message, remedy), ()

    def _unsupported(self, complaint: Complaint) -> Unsupported | None:
        """What the author asks for, where it is known not to be supported."""
        ideas = getattr(self.model, "unsupported", ())
        if not ideas or complaint.kind == "missing" or complaint.is_rule:
            return None
        value = self.document.value(complaint.path)
        plain = "" if isinstance(value, Mapping) else str(value)
        asked = f"{join_path(complaint.path)}: {plain}".lower()
        return next((idea for idea in ideas if re.search(idea.pattern, asked)), None)

    def value_remedy(self, path: str) -> str:
        """What to write instead of the value at the dotted `path`."""
        return value_remedy(*self._shape(path))

    def _at(
        self, path: Path, message: str, remedy: str, position: Position | None = None
    ) -> Problem:
        mark, file = self.document.marks[path], self.document.source.path
        name, value = shown(join_path(path), 120), mark.raw or None
        if path in self.document.lent:
            message += f" (it is that of {self.document.lent[path]})"
        return Problem(file, *(position or mark.position), name, value, message, remedy)

    def _shape(self, path: str) -> tuple[Shape | None, Unit | None]:
        """What the value at the dotted `path` may be, and its unit."""
        is_item = path.endswith("]")
        field = field_at(self.model, path.rpartition("[")[0] if is_item else path)
        return (field.item if is_item and field else field), field.unit if field else None

    def _missing(self, complaint: Complaint) -> Problem:
        position = self.document.marks[complaint.path].position
        name, block = complaint.labels[-1], join_path(complaint.path)
        if isinstance(name, int):
            count = len(self.document.value(complaint.path))
            return self._at(complaint.path, f"has too few items ({count})", "add the others")
        path = f"{block}.{name}" if block else name
        field, where = field_at(self.model, path), f" under {block}" if block else ""
        remedy = f"add `{name}: ...`{where}"
        if field and field.models:
            required = [child.name for child in children(self.model, path) if child.required]
            names = ", ".join(required) or "one field"
            remedy = f"add the block `{name}:`{where} with at least {names}"
        elif field and name == "format" and len(field.choices) == 1:
            remedy = f"write `format: {field.choices[0]}` as the first line"
        elif field:
            value = one_of(field.choices) if field.choices else "..."
            notes = [note for note in (field.description, range_text(field, field.unit)) if note]
            remedy = f"add `{name}: {value}`{where}" + (f" ({', '.join(notes)})" if notes else "")
        return Problem(self.document.source.path, *position, path, None, "missing", remedy)

    def _broken_rule(self, complaint: Complaint) -> Problem:
        """What a validator refuses, on the line of the field that it blames."""
        error = complaint.detail.get("error")
        if not isinstance(error, FieldError):
            text = str(error) if error is not None else complaint.text
            return self._at(complaint.path, text, "correct the fields of this block")
        places = []
        for name in (error.field, *error.related):
            parts = [int(p) if p.isdigit() else p for p in re.split(r"[.\[\]]+", name) if p]
            path, labels, _ = self.document.locate((*complaint.path, *parts))
            if not labels:
                places.append(path)
        if places:
            # The line of a field that the file gives is more to the point than that of the field
            # that asks for what was lent.
            line = next((p for p in places if p not in self.document.lent), places[0])
            position = self.document.marks[line].position
            return self._at(places[0], error.message, error.remedy, position)
        position = self.document.marks[complaint.path].position
        name = ".".join(part for part in (join_path(complaint.path), error.field) if part)
        file = self.document.source.path
        return Problem(file, *position, name, None, error.message, error.remedy)

    def _bad_value(
        self, complaint: Complaint, shape: Shape | None, unit: Unit | None
    ) -> tuple[str, str]:
        """Message and remedy."""
        kind, detail, value = complaint.kind, complaint.detail, self.document.value(complaint.path)
        remedy = value_remedy(shape, unit)
        if kind in _SIGNS:
            name, sign = _SIGNS[kind]
            return f"must be {sign} {float(detail[name]):.12g}{unit_label(unit)}", remedy
        if kind == "union_tag_not_found":
            tag = _tag(complaint)
            models = shape.models if shape else ()
            tags = tuple(c for m in models for c in get_args(m.model_fields[tag].annotation))
            return f"has no {tag}", f"add `{tag}: {one_of(tags) if tags else '...'}`"
        is_plain = isinstance(value, str | int | float) and not isinstance(value, bool)
        if kind == "literal_error" and is_plain and shape is not None and shape.choices:
            choice = suggest_choice(value, shape.choices)
            if choice.startswith("did") or not {int, float} & set(shape.types):
                return f"must be {_expected(shape)}", choice
        if kind in ("too_short", "too_long"):
            return _wrong_count("items", detail, detail.get("actual_length"))
        if kind in ("string_too_short", "string_too_long"):
            return _wrong_count("characters", detail, len(str(value)))
        if kind == "string_pattern_mismatch":
            legal = re.sub(r"[^A-Za-z0-9_.-]+", "_", str(value)).strip("_.-")[:60]
            fits = legal and re.search(str(detail["pattern"]), legal)
            cure = f"for example {legal}" if fits else "use letters, digits, _ and - only"
            return f"must match {detail['pattern']}", cure
        if kind == "literal_error" or kind.endswith(("_type", "_from_float", "_parsing")):
            return self._wrong_type(complaint, shape, unit)
        return shown(complaint.text, 200), remedy

    def _wrong_type(
        self, complaint: Complaint, shape: Shape | None, unit: Unit | None
    ) -> tuple[str, str]:
        value, raw = self.document.value(complaint.path), self.document.marks[complaint.path].raw
        expected, types = _expected(shape), shape.types if shape else ()
        if value is None:
            return f"is empty, must be {expected}", value_remedy(shape, unit)
        found = "a block of fields" if isinstance(value, dict) else _KINDS[type(value)]
        is_number = found.endswith("number") and bool({int, float} & set(types))
        remedy = None
        if isinstance(value, str) and {int, float} & set(types):
            remedy = _number_meant(value, unit)
        elif bool in types and str(value).lower() in _TRUTH_WORDS:
            remedy = f"write {_TRUTH_WORDS[str(value).lower()]}"
        elif types == (list,) and raw is not None:
            remedy = f"write it in brackets: [{raw}]"
        elif str in types and raw is not None:
            remedy = f'put it in quotes: "{raw}"'
        elif isinstance(value, float) and value.is_integer() and int in types:
            remedy = f"write {int(value)}"
        message = f"must be {expected}" + ("" if is_number else f", not {found}")
        return message, remedy or value_remedy(shape, unit)


def _tag(complaint: Complaint) -> str:
    """The field that tells the kind of a block."""
    return str(complaint.detail["discriminator"]).strip("'")


def _wrong_count(noun: str, detail: Mapping[str, Any], count: int | None) -> tuple[str, str]:
    given = "" if count is None else f", it is {count}"
    if (most := detail.get("max_length")) is not None:
        return f"the number of {noun} must be at most {most}{given}", "shorten it"
    return f"the number of {noun} must be at least {detail['min_length']}{given}", "add some"


def _number_meant(text: str, unit: Unit | None) -> str | None:
    """What to write instead of a number in the wrong form; None where that is not clear."""
    word = text.strip()[:80]
    if _is_number(word):
        return f"remove the quotes: {shown(word)}"
    if _is_number(bare := re.sub(r"[_ ']", "", word)):
        return f"write {bare}"
    if re.fullmatch(r"[-+]?[0-9]+,[0-9]{1,6}", word):
        return f"use a decimal point: {word.replace(',', '.')}"
    found = _QUANTITY.match(word)
    if not found or not _is_number(found.group(1)):
        return None
    digits, symbol = found.group(1), found.group(2).lower()
    if unit is None or not unit.label:
        return f"write {digits} without the unit"
    given = UNITS.get(_SYMBOLS.get(symbol, symbol))
    if given == unit:
        return f"write {digits}; the unit is in the name"
    number = given.convert(float(digits), unit) if given else None
    return f"write a plain number in {unit.label}" if number is None else f"write {number:g}"


def _is_number(text: str) -> bool:
    try:
        value = resolve(text) if text else None
    except RefusedScalarError:
        return False
    return isinstance(value, int | float) and not isinstance(value, bool)
