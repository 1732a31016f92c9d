"""Anything that finds values by dotted name: derived dimensions, or a plain mapping."""

from __future__ import annotations

from typing import Any, Protocol


class Lookup(Protocol):
    """`d["design.gel.length_mm"]`; raises KeyError for a name it lacks."""

    def __getitem__(self, name: str, /) -> Any:
        """Value of a spec field or dimension."""
