"""Names in the order people count: frame2 before frame10."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"(\d+)")


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Return a key that sorts runs of digits by value and the rest by letter, case aside.

    Ties of value (01 and 1) and of case are broken by the text itself.
    """
    parts: list[tuple[int, int, str]] = []
    for part in _NUMBER.split(name):
        if part.isdecimal():
            parts.append((0, int(part), ""))
        elif part:
            parts.append((1, 0, part.casefold()))
    return (*parts, (-1, 0, name))
