"""One record for every ladder: what each rung errs and what it takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

ErrorUnit = Literal["relative", "px", "um", "N", "mm", "share", "grey values"]
TimeUnit = Literal["ms", "s"]
Kind = Literal["ladder", "problems", "omissions"]
"""`ladder`: all rungs answer one question. `problems`: each series is a problem of its own.
`omissions`: each rung is an effect; error and time are what leaving it out costs and saves."""


@dataclass(frozen=True)
class RungRecord:
    """One way to do it. `count` is a number of operations or things that no machine changes."""

    label: str
    error: float
    time: float
    series: str = ""
    is_paper: bool = False
    is_ours: bool = False
    count: float | None = None

    def beats(self, other: RungRecord) -> bool:
        """At least as good in both and better in one."""
        no_worse = self.error <= other.error and self.time <= other.time
        return no_worse and (self.error < other.error or self.time < other.time)


@dataclass(frozen=True)
class LadderRecord:
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
    rungs: tuple[RungRecord, ...]
    header: Mapping[str, Any] = field(default_factory=dict)
    count_label: str = ""
    kind: Kind = "ladder"

    def __post_init__(self) -> None:
        labels = [r.label for r in self.rungs]
        if not labels or len(set(labels)) < len(labels):
            raise ValueError(f"ladder {self.name}: rungs must be named once each: {labels}")
        for rung in self.rungs:
            if not (rung.error >= 0 and rung.time >= 0):
                raise ValueError(f"ladder {self.name}, {rung.label}: error and time must be >= 0")

    @property
    def series(self) -> tuple[str, ...]:
        """Names of the series, in order."""
        return tuple(dict.fromkeys(r.series for r in self.rungs))

    @property
    def fronts(self) -> tuple[tuple[RungRecord, ...], ...]:
        """Rungs that no other beats in both, quickest first: of each problem, or of all."""
        if self.kind == "omissions":
            return ()
        groups = self.series if self.kind == "problems" else ("",)
        fronts = []
        for name in groups:
            rungs = [r for r in self.rungs if self.kind != "problems" or r.series == name]
            kept = [r for r in rungs if not any(other.beats(r) for other in rungs)]
            fronts.append(tuple(sorted(kept, key=lambda r: (r.time, r.error))))
        return tuple(fronts)

    @property
    def ours(self) -> tuple[RungRecord, ...]:
        """What the project does unless told otherwise."""
        return tuple(r for r in self.rungs if r.is_ours)

    @property
    def papers(self) -> tuple[RungRecord, ...]:
        """What the paper does."""
        return tuple(r for r in self.rungs if r.is_paper)

    def rivals(self, rung: RungRecord) -> tuple[RungRecord, ...]:
        """Rungs that answer the same question as one: of its problem, or all."""
        same = self.kind == "problems"
        return tuple(r for r in self.rungs if not same or r.series == rung.series)

    def to_record(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self) | {"rungs": [asdict(r) for r in self.rungs]}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> LadderRecord:
        """From plain data; raises TypeError or KeyError where it is malformed."""
        rungs = tuple(RungRecord(**r) for r in record["rungs"])
        return cls(**{**record, "rungs": rungs})


def records_of(ladders: Sequence[LadderRecord]) -> list[dict[str, Any]]:
    """Records of several ladders; raises ValueError where two have one name."""
    names = [ladder.name for ladder in ladders]
    if len(set(names)) < len(names):
        raise ValueError(f"two ladders have one name: {names}")
    return [ladder.to_record() for ladder in ladders]
