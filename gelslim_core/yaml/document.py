"""YAML text as plain values with their positions; dangerous constructs are refused.

Only what a model needs is read: one document of mappings, lists and plain values. Anchors, aliases,
merge keys, tags, duplicate keys and keys that are not names become problems. The depth and the
number of values are bounded while parsing, so that a hostile file costs no more than an honest one.

Plain scalars follow the core schema of YAML 1.2 (section 10.3.2). YAML 1.1 reads `no` as false,
`010` as eight and `1:20` as eighty; version 1.2 reads text, ten and text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from gelslim_core.yaml.errors import InputError, Problem, listed, shown
from gelslim_core.yaml.source import Position, Source, refusal

MAX_DEPTH = 24
MAX_NODES = 20_000
CORRECT_VALUE = "correct the value"
"""Remedy for a number out of range, where the limits of its field are not known."""

PathPart = str | int
Path = tuple[PathPart, ...]

_SYNTAX_REMEDIES = (
    ("'\\t'", "replace the tab by spaces"),
    ("cannot start any token", "put the value in quotes"),
    ("mapping values are not allowed", "put the value in quotes or correct the indentation"),
    ("could not find expected ':'", "write `name: value` with a space after the colon"),
    ("unexpected end of stream", "close the quote"),
    ("expected ',' or ']'", "close the bracket with ]"),
    ("expected ',' or '}'", "close the brace with }"),
    ("expected <block end>", "indent all fields of a block equally"),
    ("escape", "use single quotes, or write \\\\ for a backslash"),
    ("expected the node content", "complete the value"),
    ("undefined tag handle", "delete it"),
    ("duplicate", "delete the anchors"),
)
_UNCLOSED = ("end of stream", "stream end", "expected ','", "could not find expected ':'")
MAX_INT = 2**53
"""Whole numbers beyond this lose digits as a double."""

ScalarValue = str | int | float | bool | None

_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGERS = {
    10: re.compile(r"([-+]?[0-9]+)\Z"),
    8: re.compile(r"0o([0-7]+)\Z"),
    16: re.compile(r"0x([0-9a-fA-F]+)\Z"),
}
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)\Z|\.(nan|NaN|NAN)\Z")


class Mark(NamedTuple):
    """Where one value stands in the file."""

    position: Position
    """Of a plain value; of the key, where the value is a block or a list."""
    key: Position
    """Of the key; of the value itself in a list."""
    raw: str | None
    """A plain value as written, shortened for a message; None for a block or a list."""


@dataclass
class Document:
    """The mapping that a YAML file holds."""

    source: Source
    data: dict[str, Any] = field(default_factory=dict)
    marks: dict[Path, Mark] = field(default_factory=dict)
    """Of every value, by its path from the top, in file order."""
    problems: list[Problem] = field(default_factory=list)
    """Values that were refused; `data` holds None in their place, or nothing for a refused key."""
    lent: dict[Path, str] = field(default_factory=dict)
    """Where values come from that do not stand in the file."""

    def lend(self, path: Path, value: ScalarValue, origin: str, because: Path) -> None:
        """Set a plain value from `origin` that the file asks for by the value at `because`."""
        self.value(path[:-1])[path[-1]] = value
        self.marks[path] = self.marks[because]._replace(raw=shown(str(value)))
        self.lent[path] = origin

    def locate(self, location: Sequence[PathPart]) -> tuple[Path, Path, int]:
        """Follow `location` from the top as far as values exist.

        Returns the path that was found, the parts that name no value, and the length of the path
        before the first of those.
        """
        path: Path = ()
        labels: Path = ()
        depth = None
        value: Any = self.data
        for part in location:
            by_name = isinstance(value, dict) and part in value
            by_index = isinstance(value, list) and isinstance(part, int) and part < len(value)
            if by_name or by_index:
                value = value[part]
                path = (*path, part)
            else:
                depth = len(path) if depth is None else depth
                labels = (*labels, part)
        return path, labels, len(path) if depth is None else depth

    def value(self, path: Path) -> Any:
        """The value at a path that exists."""
        value: Any = self.data
        for part in path:
            value = value[part]
        return value


def join_path(parts: Path) -> str:
    """`("a", "b", 0, "c")` as `a.b[0].c`."""
    text = ""
    for part in parts:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def parse_document(source: Source, starting_point: str) -> Document:
    """The one document in `source`, with the problems of what it holds that is refused.

    `starting_point` is the remedy for a file that holds nothing. Raises `InputError` where no
    mapping can be read: syntax errors, an empty file, several documents, a list at the top,
    nesting beyond `MAX_DEPTH`, more than `MAX_NODES` values.
    """
    parser = _Parser(source)
    try:
        root = parser.parse()
    except InputError:
        raise
    except Exception as error:
        # On hostile input the YAML parser raises other errors than its own as well.
        raise listed((*parser.document.problems, _syntax_error(source, error, parser.last))) from (
            None
        )
    mark = parser.document.marks.get(())
    if mark is None or (mark.raw == "" and not parser.document.problems):
        raise refusal(source.path, "is empty", starting_point)
    if not isinstance(root, dict):
        kind = "a list" if isinstance(root, list) else "a single value"
        message = f"the top level is {kind}, must be `name: value` lines"
        raise refusal(source.path, message, starting_point, mark.position)
    parser.document.data = root
    return parser.document


class _Parser:
    """Builds a document from the events of the YAML parser."""

    def __init__(self, source: Source) -> None:
        from ruamel.yaml import YAML

        self.document = Document(source)
        self.events = YAML(typ="safe", pure=True).parse(source.text)
        self.nodes = 0
        self.last = Position(1, 1)

    def parse(self) -> Any:
        """The value at the top; None without one."""
        root, documents = None, 0
        for event in self.events:
            name = type(event).__name__
            if name == "DocumentStartEvent":
                documents += 1
                self._check_document(event, documents)
            elif not name.startswith(("Stream", "Document")):
                root = self._value(event, (), None)
        return root

    def _refuse(self, position: Position, message: str, remedy: str) -> InputError:
        return refusal(self.document.source.path, message, remedy, position)

    def _problem(
        self, position: Position, path: Path, value: str | None, message: str, remedy: str
    ) -> None:
        name, file = shown(join_path(path), 120), self.document.source.path
        self.document.problems.append(Problem(file, *position, name, value, message, remedy))

    def _check_document(self, event: Any, documents: int) -> None:
        position = _position(event.start_mark)
        if documents > 1:
            remedy = "keep one document per file: delete this `---` and what follows"
            raise self._refuse(position, "holds a second document", remedy)
        if event.version is not None and tuple(event.version) != (1, 2):
            asked = ".".join(map(str, event.version))
            message = f"asks for YAML {asked}, this program reads YAML 1.2"
            raise self._refuse(Position(1, 1), message, "delete the %YAML line")

    def _begin(self, event: Any, path: Path) -> Position:
        """Count the value that begins with `event`; refuse its anchor and its tag."""
        self.last = position = _position(event.start_mark)
        self.nodes += 1
        if self.nodes > MAX_NODES:
            message = f"holds more than {MAX_NODES} values, the limit for such a file"
            raise self._refuse(position, message, "check that this is the right file")
        if type(event).__name__ == "AliasEvent":
            return position
        if event.anchor is not None:
            name = f"&{shown(event.anchor)}"
            self._problem(position, path, name, "anchors are not read", "delete it")
        if event.ctag is not None:
            tag = shown(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
            self._problem(position, path, tag, "tags are not read", "delete it")
        return position

    def _value(self, event: Any, path: Path, key: Position | None) -> Any:
        position = self._begin(event, path)
        name = type(event).__name__
        if name in ("AliasEvent", "ScalarEvent"):
            raw, value, fault = _scalar(event)
            # The parser places an empty value at the next token, often lines below its key.
            position = key if key is not None and raw == "" else position
            if fault is not None:
                self._problem(position, path, raw, *fault)
            return self._marked(path, Mark(position, key or position, raw), value)
        if len(path) >= MAX_DEPTH:
            raise self._refuse(position, f"nested deeper than {MAX_DEPTH} levels", "flatten it")
        self._marked(path, Mark(key or position, key or position, None), None)
        return self._list(path) if name == "SequenceStartEvent" else self._mapping(path)

    def _marked(self, path: Path, mark: Mark, value: Any) -> Any:
        # Of a key that is given twice the first one counts.
        self.document.marks.setdefault(path, mark)
        return value

    def _list(self, path: Path) -> list[Any]:
        items: list[Any] = []
        while type(event := next(self.events)).__name__ != "SequenceEndEvent":
            items.append(self._value(event, (*path, len(items)), None))
        return items

    def _mapping(self, path: Path) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        while type(event := next(self.events)).__name__ != "MappingEndEvent":
            position = _position(event.start_mark)
            key, is_good = self._key(event, path)
            below = (*path, key)
            if is_good and key in entries:
                first = self.document.marks[below].key.line
                message = f"given twice, first on line {first} and again on line {position.line}"
                self._problem(position, below, None, message, "delete one of the two lines")
                is_good = False
            value = self._value(next(self.events), below, position)
            if is_good:
                entries[key] = value
        return entries

    def _key(self, event: Any, path: Path) -> tuple[str, bool]:
        """The key that begins with `event`, and whether it may be one."""
        name = type(event).__name__
        position, key, raw = _position(event.start_mark), None, None
        if name in ("MappingStartEvent", "SequenceStartEvent"):
            self._value(event, (*path, "?"), None)
        else:
            self._begin(event, path)
            raw, key, _ = _scalar(event)
        if not isinstance(key, str):
            self._problem(position, path, raw, "a key must be a name", "write `name: value`")
            return raw or "?", False
        if raw == "<<":
            self._problem(position, path, raw, "merge keys are not read", "write the fields out")
            return raw, False
        return key, True


def _scalar(event: Any) -> tuple[str, Any, tuple[str, str] | None]:
    """A plain value as written, its value, and why it is refused with the remedy, if it is."""
    if type(event).__name__ == "AliasEvent":
        return f"*{shown(event.anchor)}", None, ("aliases are not read", "write the value out")
    is_plain = event.style in (None, "")
    quote = "" if is_plain else "'" if event.style == "'" else '"'
    raw = f"{quote}{shown(event.value)}{quote}"
    try:
        value = resolve(event.value) if is_plain else event.value
        if isinstance(value, str) and any("\ud800" <= c <= "\udfff" for c in value):
            raise RefusedScalarError("holds half a character (a lone surrogate)")
    except RefusedScalarError as error:
        return raw, None, (str(error), CORRECT_VALUE)
    return raw, value, None


def _position(mark: Any) -> Position:
    return Position(mark.line + 1, mark.column + 1)


def _syntax_error(source: Source, error: Exception, last: Position) -> Problem:
    """The complaint of the YAML parser as a problem with a line and a remedy.

    A quote or bracket that is never closed is reported on the line that opens it. A complaint
    without a line is reported on `last`, the place where parsing had arrived.
    """
    reason = str(getattr(error, "problem", None) or "").strip()
    mark: Any = getattr(error, "problem_mark", None)
    opened: Any = getattr(error, "context_mark", None)
    if opened is not None and (mark is None or any(sign in reason for sign in _UNCLOSED)):
        mark = opened
    message = f"is not valid YAML: {shown(reason, 120)}" if reason else "is not valid YAML"
    remedy = next((cure for sign, cure in _SYNTAX_REMEDIES if sign in reason), "correct the syntax")
    position = last if mark is None else _position(mark)
    lines = source.text.splitlines()
    text = lines[position.line - 1].strip() if position.line <= len(lines) else ""
    value = f"`{shown(text)}`" if text else None
    return Problem(source.path, *position, "", value, message, remedy)


class RefusedScalarError(ValueError):
    """A scalar that YAML allows and no field accepts; the text says what it must be."""


def resolve(text: str) -> ScalarValue:
    """The value of the plain (unquoted) scalar `text`.

    Raises `RefusedScalarError` for NaN, infinities and numbers beyond the range of a double or,
    for whole numbers, beyond `MAX_INT`.
    """
    if text in _WORDS:
        return _WORDS[text]
    for base, integer in _INTEGERS.items():
        if found := integer.match(text):
            return _bounded_int(found.group(1), base)
    if _NOT_FINITE.match(text):
        raise RefusedScalarError("must be a finite number")
    if not _FLOAT.match(text):
        return text
    value = float(text)
    if not math.isfinite(value):
        raise RefusedScalarError("must be a finite number, at most about 1.8e308")
    return value


def _bounded_int(digits: str, base: int) -> int:
    # Python refuses to convert very long digit strings, so their length is checked first.
    value = int(digits, base) if len(digits.lstrip("+-0")) < 40 and len(digits) < 400 else None
    if value is None or abs(value) > MAX_INT:
        raise RefusedScalarError("is too large a whole number, the limit is 2^53")
    return value
