"""One record for every ladder: what each rung errs and what it takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

ErrorUnit = Literal["relative", "px", "um", "N", "mm", "share", "grey values"]
TimeUnit = Literal["ms", "s"]


@dataclass(frozen=True)
class Rung:
    """One way to do it. `count` is a number of operations or things that no machine changes."""

    label: str
    error: float
    time: float
    series: str = ""
    is_paper: bool = False
    is_ours: bool = False
    count: float | None = None

    def beats(self, other: Rung) -> bool:
        """At least as good in both and better in one."""
        no_worse = self.error <= other.error and self.time <= other.time
        return no_worse and (self.error < other.error or self.time < other.time)


@dataclass(frozen=True)
class Ladder:
    """Rungs of one question. `header` is that of the file they were measured in.

    `paper` says what the paper does, or that it does nothing of the kind; `reference` what errors
    are against. Raises ValueError without rungs, for negative values and two labels alike.
    """

    name: str
    title: str
    question: str
    paper: str
    reference: str
    error_label: str
    error_unit: ErrorUnit
    time_label: str
    time_unit: TimeUnit
    source: str
    rungs: tuple[Rung, ...]
    header: Mapping[str, Any] = field(default_factory=dict)
    count_label: str = ""
    shown: tuple[str, ...] = ()
    """Labels of the rungs in the page's table; all where empty."""

    def __post_init__(self) -> None:
        labels = [r.label for r in self.rungs]
        if not labels or len(set(labels)) < len(labels):
            raise ValueError(f"ladder {self.name}: rungs must be named once each: {labels}")
        for rung in self.rungs:
            if not (rung.error >= 0 and rung.time >= 0):
                raise ValueError(f"ladder {self.name}, {rung.label}: error and time must be >= 0")
        if strange := set(self.shown) - set(labels):
            raise ValueError(f"ladder {self.name}: no rung is called {sorted(strange)}")

    @property
    def front(self) -> tuple[Rung, ...]:
        """Rungs that no other beats in both, quickest first."""
        kept = [r for r in self.rungs if not any(other.beats(r) for other in self.rungs)]
        return tuple(sorted(kept, key=lambda r: (r.time, r.error)))

    @property
    def ours(self) -> Rung | None:
        """What the project does unless told otherwise."""
        return next((r for r in self.rungs if r.is_ours), None)

    @property
    def papers(self) -> Rung | None:
        """What the paper does."""
        return next((r for r in self.rungs if r.is_paper), None)

    def to_record(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self) | {"rungs": [asdict(r) for r in self.rungs], "shown": [*self.shown]}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Ladder:
        """From plain data; raises TypeError or KeyError where it is malformed."""
        rungs = tuple(Rung(**r) for r in record["rungs"])
        return cls(**{**record, "rungs": rungs, "shown": tuple(record["shown"])})


def joined(ladders: Sequence[Ladder]) -> list[dict[str, Any]]:
    """Records of several ladders; raises ValueError where two have one name."""
    names = [ladder.name for ladder in ladders]
    if len(set(names)) < len(names):
        raise ValueError(f"two ladders have one name: {names}")
    return [ladder.to_record() for ladder in ladders]
