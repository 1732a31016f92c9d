"""The designs to explore: every combination of the axes' values over one spec."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from gelslim_cad.explore.axis import Axis, ExploreError, Value
from gelslim_cad.spec import Spec

CHUNK = 500
"""Designs per chunk; the same for every engine, so that batches and hence values are too."""
MOST_DESIGNS = 5_000_000


@dataclass(frozen=True)
class Space:
    """A spec and the axes that vary; designs are numbered with the last axis fastest."""

    spec: Spec
    axes: tuple[Axis, ...]

    @classmethod
    def of(cls, spec: Spec, axes: Sequence[Axis]) -> Space:
        """The space; raises ExploreError where there is no axis, one twice, or too many designs."""
        paths = [a.path for a in axes]
        if not paths:
            raise ExploreError("nothing varies; give at least one --vary PATH=FIRST:LAST:STEP")
        twice = sorted({p for p in paths if paths.count(p) > 1})
        if twice:
            raise ExploreError(f"--vary gives {twice[0]} twice; join its values")
        space = cls(spec, tuple(axes))
        if space.count > MOST_DESIGNS:
            raise ExploreError(
                f"{space.count} designs are more than {MOST_DESIGNS}; use larger steps"
            )
        return space

    @property
    def count(self) -> int:
        """Number of designs."""
        return math.prod(len(a.values) for a in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values per axis."""
        return tuple(len(a.values) for a in self.axes)

    def chunks(self) -> Iterator[tuple[int, int]]:
        """First design and one past the last, chunk by chunk."""
        for start in range(0, self.count, CHUNK):
            yield start, min(start + CHUNK, self.count)

    def rows(self, start: int, stop: int) -> list[tuple[Value, ...]]:
        """Values of the axes of the designs from `start` to before `stop`."""
        return [self.row(k) for k in range(start, stop)]

    def row(self, index: int) -> tuple[Value, ...]:
        """Values of the axes of one design."""
        values: list[Value] = []
        for axis in reversed(self.axes):
            index, k = divmod(index, len(axis.values))
            values.append(axis.values[k])
        return tuple(reversed(values))


def changed(spec: Spec, overrides: Mapping[str, Any]) -> Spec:
    """The spec with fields replaced by dotted path; raises ValidationError where it is illegal."""
    content = spec.model_dump()
    for path, value in overrides.items():
        *blocks, last = path.split(".")
        inner = content
        for name in blocks:
            inner = inner[name]
        inner[last] = value
    return Spec.model_validate(content)


def illegal(spec: Spec, overrides: Mapping[str, Any]) -> str:
    """Why the spec would not accept the values; empty where it does."""
    try:
        changed(spec, overrides)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(p) for p in first["loc"] if not str(p).startswith("function-"))
        words = str(first["msg"]).removeprefix("Value error, ")
        return f"{place}: {words}" if place else words
    return ""


def grouped(
    axes: Sequence[Axis], rows: Sequence[tuple[Value, ...]]
) -> Iterator[tuple[dict[str, Value], dict[str, list[float | int]], list[int]]]:
    """Groups of rows that share all values that are not numbers.

    Yields those values, the numbers of the group as columns, and the rows' places.
    """
    words = [k for k, a in enumerate(axes) if not a.numeric]
    numbers = [k for k, a in enumerate(axes) if a.numeric]

    def key(place: int) -> tuple[str, ...]:
        return tuple(repr(rows[place][k]) for k in words)

    for _, found in itertools.groupby(sorted(range(len(rows)), key=key), key):
        places = list(found)
        fixed = {axes[k].path: rows[places[0]][k] for k in words}
        columns: dict[str, list[float | int]] = {
            axes[k].path: [rows[p][k] for p in places]  # type: ignore[misc]
            for k in numbers
        }
        yield fixed, columns, places
