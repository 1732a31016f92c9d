"""Looking up the values of spec fields and dimensions by their dotted names, with their types."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, overload

from gelslim_cad.geometry.names import (
    BoolName,
    DimensionName,
    FloatName,
    FloatOrTextName,
    FloatsName,
    IntName,
    Name,
    OptionalFloatName,
    OptionalIntName,
    OptionalTextName,
    TextName,
)


class NamedValues(ABC):
    """Values by dotted name: `d["design.gel.length_mm"]`.

    A type checker knows all names and the types of their values, and refuses a name that no
    spec field or dimension has.
    """

    @abstractmethod
    def value(self, name: str) -> Any:
        """The value under a name that is known at run time only; KeyError where there is none."""

    @overload
    def __getitem__(self, name: DimensionName | FloatName, /) -> float: ...
    @overload
    def __getitem__(self, name: IntName, /) -> int: ...
    @overload
    def __getitem__(self, name: BoolName, /) -> bool: ...
    @overload
    def __getitem__(self, name: TextName, /) -> str: ...
    @overload
    def __getitem__(self, name: FloatsName, /) -> tuple[float, ...]: ...
    @overload
    def __getitem__(self, name: OptionalFloatName, /) -> float | None: ...
    @overload
    def __getitem__(self, name: OptionalIntName, /) -> int | None: ...
    @overload
    def __getitem__(self, name: OptionalTextName, /) -> str | None: ...
    @overload
    def __getitem__(self, name: FloatOrTextName, /) -> float | str: ...
    @overload
    def __getitem__(self, name: Name, /) -> Any: ...
    def __getitem__(self, name: str, /) -> Any:
        return self.value(name)


Lookup = NamedValues | Mapping[str, Any]
"""Derived dimensions, or a plain mapping with the names that a function needs."""
