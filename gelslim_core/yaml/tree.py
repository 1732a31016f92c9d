"""YAML text parsed into nodes, with everything dangerous refused.

Only what a model needs is read: one document of mappings, lists and plain values. Anchors,
aliases, merge keys, tags, duplicate keys and keys that are not names are problems; depth and
node count are bounded while parsing, so that a hostile file costs no more than an honest one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from gelslim_core.yaml.errors import InputError, Problem, listed, shown
from gelslim_core.yaml.nodes import Entry, ListNode, MappingNode, Node, PathPart, Scalar, join_path
from gelslim_core.yaml.scalars import RefusedScalarError, resolve
from gelslim_core.yaml.source import Position, Source, refusal
from gelslim_core.yaml.syntax import syntax_error

MAX_DEPTH = 24
MAX_NODES = 20_000
NUMBER_REMEDY = "give a value within range"


@dataclass(slots=True)
class _Frame:
    """A collection under construction; `key` is the pending key of a mapping, None before it."""

    node: MappingNode | ListNode
    key: str | None = None
    key_position: Position | None = None
    skip: bool = False
    """The value of the pending key is parsed but dropped: its key was refused."""


@dataclass(slots=True)
class _Builder:
    source: Source
    problems: list[Problem] = field(default_factory=list)
    frames: list[_Frame] = field(default_factory=list)
    root: Node | None = None
    nodes: int = 0
    last: Position = field(default_factory=lambda: Position(1, 1))

    def problem(self, position: Position, value: str | None, message: str, remedy: str) -> None:
        path = shown(join_path(tuple(self.path())), 120)
        self.problems.append(Problem(self.source.path, *position, path, value, message, remedy))

    def path(self) -> Iterator[PathPart]:
        for frame in self.frames:
            if isinstance(frame.node, ListNode):
                yield len(frame.node.items)
            elif frame.key_position is not None:
                yield frame.key if frame.key is not None else "?"

    def awaits_key(self) -> bool:
        frame = self.frames[-1] if self.frames else None
        return (
            frame is not None
            and isinstance(frame.node, MappingNode)
            and (frame.key_position is None)
        )

    def open(self, node: MappingNode | ListNode) -> None:
        if len(self.frames) >= MAX_DEPTH:
            raise refusal(
                self.source.path,
                f"nested deeper than {MAX_DEPTH} levels",
                "flatten it",
                node.position,
            )
        self.frames.append(_Frame(node))

    def close(self) -> None:
        node = self.frames.pop().node
        if self.awaits_key():
            self._refuse_key(node.position, None, "a key must be a plain name, not a collection")
        else:
            self.add(node)

    def add(self, node: Node) -> None:
        if not self.frames:
            self.root = node
            return
        frame = self.frames[-1]
        if isinstance(frame.node, ListNode):
            frame.node.items.append(node)
            return
        if not frame.skip and frame.key is not None and frame.key_position is not None:
            frame.node.entries[frame.key] = Entry(frame.key_position, node)
        frame.key, frame.key_position, frame.skip = None, None, False

    def _refuse_key(
        self, position: Position, raw: str | None, message: str, remedy: str = "write `name: value`"
    ) -> None:
        self.problem(position, raw, message, remedy)
        frame = self.frames[-1]
        frame.key, frame.key_position, frame.skip = raw, position, True

    def key(self, scalar: Scalar, merge: bool) -> None:
        frame = self.frames[-1]
        assert isinstance(frame.node, MappingNode)
        if scalar.refused or not isinstance(scalar.value, str):
            self._refuse_key(scalar.position, scalar.raw, "a key must be a name")
        elif merge:
            self._refuse_key(
                scalar.position, scalar.raw, "merge keys are not read", "write the fields out"
            )
        elif scalar.value in frame.node.entries:
            first = frame.node.entries[scalar.value].key_position.line
            frame.key, frame.key_position, frame.skip = scalar.value, scalar.position, True
            self.problem(
                scalar.position,
                None,
                f"given twice, first on line {first} and again on line {scalar.position.line}",
                "delete one of the two lines",
            )
        else:
            frame.key, frame.key_position = scalar.value, scalar.position

    def value_position(self, event: Any, empty: bool) -> Position:
        # The parser places an empty value at the next token, often lines below its key.
        frame = self.frames[-1] if self.frames else None
        if empty and frame is not None and frame.key_position is not None:
            return frame.key_position
        return _mark(event.start_mark)

    def scalar(self, event: Any) -> Scalar:
        """The event's value; one that no field takes is a problem, its remedy left to the model."""
        is_plain = event.style in (None, "")
        position = self.value_position(event, is_plain and event.value == "")
        raw = _raw(event.value, event.style)
        try:
            value = resolve(event.value) if is_plain else event.value
            if isinstance(value, str) and any("\ud800" <= c <= "\udfff" for c in value):
                raise RefusedScalarError("holds half a character (a lone surrogate)")
        except RefusedScalarError as error:
            if not self.awaits_key():
                self.problem(position, raw, str(error), NUMBER_REMEDY)
            return Scalar(position, None, raw, refused=True)
        return Scalar(position, value, raw)


def parse_tree(source: Source, start: str) -> tuple[MappingNode, tuple[Problem, ...]]:
    """The top-level mapping of the one document in `source`, and what it holds that is refused.

    `start` is the remedy for a file that holds nothing.
    A problem with `NUMBER_REMEDY` is one about which the field's limits could say more.
    Raises `InputError` where there is no such mapping: syntax errors, an empty file, several
    documents, a list at the top, nesting beyond `MAX_DEPTH`, more than `MAX_NODES` values.
    """
    builder = _Builder(source)
    try:
        _build(builder)
    except InputError:
        raise
    except Exception as error:
        # The parser meets hostile input here; some of it raises other errors than its own.
        raise listed((*builder.problems, syntax_error(source, error, builder.last))) from None
    root = builder.root
    if root is None or (isinstance(root, Scalar) and root.raw == "" and not builder.problems):
        raise refusal(source.path, "is empty", start)
    if not isinstance(root, MappingNode):
        kind = "a list" if isinstance(root, ListNode) else "a single value"
        raise refusal(
            source.path,
            f"the top level is {kind}, must be `name: value` lines",
            start,
            root.position,
        )
    return root, tuple(builder.problems)


def _build(builder: _Builder) -> None:
    from ruamel.yaml import YAML

    documents = 0
    for event in YAML(typ="safe", pure=True).parse(builder.source.text):
        kind = type(event).__name__
        if kind == "DocumentStartEvent":
            documents += 1
            _check_document(builder.source, event, documents)
        elif kind in ("MappingStartEvent", "SequenceStartEvent", "ScalarEvent", "AliasEvent"):
            _count(builder, event)
            _node(builder, kind, event)
        elif kind in ("MappingEndEvent", "SequenceEndEvent"):
            builder.close()


def _count(builder: _Builder, event: Any) -> None:
    builder.nodes += 1
    builder.last = _mark(event.start_mark)
    if builder.nodes > MAX_NODES:
        raise refusal(
            builder.source.path,
            f"holds more than {MAX_NODES} values, the limit for such a file",
            "check that this is the right file",
            builder.last,
        )


def _check_document(source: Source, event: Any, documents: int) -> None:
    position = _mark(event.start_mark)
    if documents > 1:
        raise refusal(
            source.path,
            "holds a second document",
            "keep one document per file: delete this `---` and what follows",
            position,
        )
    if event.version is not None and tuple(event.version) != (1, 2):
        version = ".".join(str(number) for number in event.version)
        raise refusal(
            source.path,
            f"asks for YAML {version}, this program reads YAML 1.2",
            "delete the %YAML line",
            Position(1, 1),
        )


def _node(builder: _Builder, kind: str, event: Any) -> None:
    position = _mark(event.start_mark)
    if kind == "AliasEvent":
        _alias(builder, event, position)
        return
    if event.anchor is not None:
        builder.problem(position, f"&{shown(event.anchor)}", "anchors are not read", "delete it")
    if event.ctag is not None:
        tag = shown(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
        builder.problem(position, tag, "tags are not read", "delete it")
    if kind == "MappingStartEvent":
        builder.open(MappingNode(position, {}))
    elif kind == "SequenceStartEvent":
        builder.open(ListNode(position, []))
    else:
        scalar = builder.scalar(event)
        if builder.awaits_key():
            builder.key(scalar, event.style is None and event.value == "<<")
        else:
            builder.add(scalar)


def _alias(builder: _Builder, event: Any, position: Position) -> None:
    raw = f"*{shown(event.anchor)}"
    refused = Scalar(position, None, raw, refused=True)
    if builder.awaits_key():
        builder.key(refused, merge=False)
    else:
        builder.problem(position, raw, "aliases are not read", "write the value out")
        builder.add(refused)


def _mark(mark: Any) -> Position:
    return Position(mark.line + 1, mark.column + 1)


def _raw(text: str, style: str | None) -> str:
    if style == "'":
        return f"'{shown(text)}'"
    return f'"{shown(text)}"' if style in ('"', "|", ">") else shown(text)
