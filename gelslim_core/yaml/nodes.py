"""The tree of a YAML file: values, mappings and lists that know where they stand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gelslim_core.yaml.scalars import ScalarValue
from gelslim_core.yaml.source import Position


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value; `refused` means a problem was recorded and `value` is meaningless."""

    position: Position
    value: ScalarValue
    raw: str
    """As written, with quotes, escaped and shortened for a message."""
    refused: bool = False


@dataclass(frozen=True, slots=True)
class Entry:
    """A key of a mapping and what it holds."""

    key_position: Position
    node: Node


@dataclass(frozen=True, slots=True)
class MappingNode:
    """A mapping, in file order."""

    position: Position
    entries: dict[str, Entry]


@dataclass(frozen=True, slots=True)
class ListNode:
    """A list."""

    position: Position
    items: list[Node]


Node = Scalar | MappingNode | ListNode

PathPart = str | int


def join_path(parts: tuple[PathPart, ...]) -> str:
    """`("a", "b", 0, "c")` as `a.b[0].c`."""
    text = ""
    for part in parts:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{part}" if text else part
    return text


def plain(node: Node) -> Any:
    """The tree as dicts, lists and values."""
    if isinstance(node, MappingNode):
        return {key: plain(entry.node) for key, entry in node.entries.items()}
    if isinstance(node, ListNode):
        return [plain(item) for item in node.items]
    return node.value


def positions(node: Node, prefix: tuple[PathPart, ...] = ()) -> Iterator[tuple[str, Position]]:
    """Every field below `node` with its place: its value's, or its key's where it is a block."""
    if isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            path = (*prefix, key)
            yield join_path(path), entry_position(entry)
            yield from positions(entry.node, path)
    elif isinstance(node, ListNode):
        for index, item in enumerate(node.items):
            path = (*prefix, index)
            yield join_path(path), item.position
            yield from positions(item, path)


def entry_position(entry: Entry) -> Position:
    """Where a message about this field should point."""
    return entry.node.position if isinstance(entry.node, Scalar) else entry.key_position
