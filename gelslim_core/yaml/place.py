"""Where a complaint of pydantic points in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gelslim_core.yaml.nodes import (
    ListNode,
    MappingNode,
    Node,
    PathPart,
    entry_position,
    join_path,
)
from gelslim_core.yaml.source import Position


@dataclass(frozen=True)
class Place:
    """Where a complaint points: the nodes its location names, without labels of unions."""

    parts: tuple[PathPart, ...]
    node: Node
    position: Position
    labels: tuple[PathPart, ...]
    """Parts of the location that name no node."""
    depth: int
    """Parts before the first label."""

    @property
    def path(self) -> str:
        """Dotted."""
        return join_path(self.parts)


@dataclass(frozen=True)
class Complaint:
    """One error of pydantic and its place."""

    kind: str
    detail: dict[str, Any]
    text: str
    place: Place


def locate(root: MappingNode, location: Sequence[PathPart]) -> Place:
    """Follow `location` from `root` as far as nodes exist; what matches no node is a label."""
    parts: list[PathPart] = []
    labels: list[PathPart] = []
    depth: int | None = None
    node: Node = root
    position = root.position
    for part in location:
        if isinstance(node, MappingNode) and isinstance(part, str) and part in node.entries:
            entry = node.entries[part]
            node, position = entry.node, entry_position(entry)
        elif isinstance(node, ListNode) and isinstance(part, int) and part < len(node.items):
            node = node.items[part]
            position = node.position
        else:
            depth = len(parts) if depth is None else depth
            labels.append(part)
            continue
        parts.append(part)
    return Place(
        tuple(parts), node, position, tuple(labels), len(parts) if depth is None else depth
    )
