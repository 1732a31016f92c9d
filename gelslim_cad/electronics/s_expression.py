"""S-expressions, the form of KiCad's files."""

from __future__ import annotations

from typing import Any
from uuid import NAMESPACE_URL, uuid5

from gelslim_cad.markers.gerber_file import PROJECT

INDENT = "  "


class Word(str):
    """A word that is written without quotation marks."""

    __slots__ = ()


Expression = tuple[Any, ...]
"""The name of a list and its items: numbers, texts, words and further lists."""
YES, NO = Word("yes"), Word("no")


def identifier(*names: str) -> str:
    """An identifier that follows from names, so that a file has the same bytes in every build."""
    return str(uuid5(NAMESPACE_URL, f"{PROJECT}#{'/'.join(names)}"))


def render(expression: Expression, depth: int = 0) -> str:
    """An expression as text, a line for each list that holds lists.

    Raises TypeError for an item of another type.
    """
    name, *items = expression
    parts = [f"({name}"]
    nested = any(isinstance(i, tuple) and any(isinstance(j, tuple) for j in i) for i in items)
    broken = nested or sum(isinstance(i, tuple) for i in items) > 4
    for item in items:
        if isinstance(item, tuple):
            text = render(item, depth + 1)
            parts.append(f"\n{INDENT * (depth + 1)}{text}" if broken else f" {text}")
        else:
            parts.append(f" {_atom(item)}")
    return "".join(parts) + (f"\n{INDENT * depth})" if broken else ")")


def _atom(item: Any) -> str:
    if isinstance(item, Word):
        return str(item)
    if isinstance(item, str):
        escaped = item.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        return f'"{escaped}"'
    if isinstance(item, bool) or not isinstance(item, int | float):
        raise TypeError(f"{item!r} has no form in an S-expression")
    if isinstance(item, int):
        return str(item)
    text = f"{item:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
