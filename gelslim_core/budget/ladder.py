"""Rungs to choose from, and the choice a budget makes among them.

An error alone picks the rung of least work that keeps it: work is counted, so every machine picks
the same one, however busy it is. A time picks the most accurate rung that keeps it, and depends on
the machine, as it must. With both, the rung of least work that keeps both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gelslim_core.budget.budget import Budget, shown_share, shown_time
from gelslim_core.budget.errors import BudgetError
from gelslim_core.budget.rung import Rung


@dataclass(frozen=True)
class Wording:
    """How a ladder is spoken of."""

    rung: str = "rung"
    """What a rung is, such as `operator`."""
    error: str = "error"
    """Which error it has, such as `field error`."""
    per: str = ""
    """What its time is for, such as `per frame`."""
    remedy: str = ""
    """What makes smaller errors possible, such as `use more layers`."""


@dataclass(frozen=True)
class Choice:
    """The rung chosen, and what its user should know about it."""

    rung: Rung
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ladder:
    """Rungs; the order given decides between rungs of equal work. Raises BudgetError if empty."""

    rungs: tuple[Rung, ...]
    wording: Wording = Wording()

    def __post_init__(self) -> None:
        if not self.rungs:
            raise BudgetError(f"a ladder without a single {self.wording.rung} has nothing to offer")

    @property
    def by_work(self) -> tuple[Rung, ...]:
        """Least work first."""
        return tuple(sorted(self.rungs, key=lambda rung: rung.work))

    def choose(self, budget: Budget) -> Choice:
        """The rung for a budget; one without limits picks the most accurate.

        Raises BudgetError where no rung keeps it, naming the nearest on both sides.
        """
        able = [r for r in self.by_work if budget.allows(r.error, r.time_ms)]
        if not able:
            raise BudgetError(self._refusal(budget))
        rung = able[0] if budget.error is not None else min(able, key=lambda r: r.error)
        return Choice(rung, self._remarks(budget, rung))

    def nearest(self, budget: Budget) -> tuple[Rung, Rung]:
        """For a budget that no rung keeps, the nearest on the side of time and that of error.

        The first keeps the time and errs as little as it can, or is the quickest of all where none
        keeps it; the second keeps the error in as little time as it can, or is the most accurate.
        """
        in_time = [r for r in self.by_work if budget.allows_time(r.time_ms)]
        in_error = [r for r in self.by_work if budget.allows_error(r.error)]
        quick = min(in_time, key=lambda r: r.error) if in_time else self._quickest(self.by_work)
        good = self._quickest(in_error) if in_error else min(self.by_work, key=lambda r: r.error)
        return quick, good

    def timed(self, times_ms: Mapping[str, float]) -> Ladder:
        """The same rungs with other times, by name; rungs that are not named keep theirs."""
        return replace(
            self,
            rungs=tuple(replace(r, time_ms=times_ms.get(r.name, r.time_ms)) for r in self.rungs),
        )

    @staticmethod
    def _quickest(rungs: tuple[Rung, ...] | list[Rung]) -> Rung:
        return min(rungs, key=lambda r: r.time_ms)

    def _refusal(self, budget: Budget) -> str:
        w = self.wording
        wanted = []
        if budget.error is not None:
            wanted.append(f"{w.error} of {shown_share(budget.error)}")
        if budget.time_ms is not None:
            wanted.append(f"{shown_time(budget.time_ms)} {w.per}".rstrip())
        quick, good = self.nearest(budget)
        told = f"no {w.rung} keeps the budget, {' in '.join(wanted)}; the nearest: "
        if quick == good:
            told += str(good)
        else:
            told += f"{quick} on the side of time, {good} on the side of error"
        if w.remedy and not budget.allows_error(good.error):
            told += f"; {w.remedy}"
        return told

    def _remarks(self, budget: Budget, rung: Rung) -> tuple[str, ...]:
        """What lies outside the range that was measured."""
        w, known = self.wording, [r for r in self.rungs if r.measured]
        if not known:
            return ()
        errors, times = [r.error for r in known], [r.time_ms for r in known]
        if not rung.measured:
            return (
                f"{rung.name} is outside the calibrated range ({_span(errors, shown_share)}): "
                f"its {w.error} and time are extrapolated",
            )
        outside = []
        if budget.error is not None and budget.error > max(errors):
            outside.append(
                f"{w.error} of {shown_share(budget.error)} is looser than the calibrated range, "
                f"{_span(errors, shown_share)}"
            )
        if budget.time_ms is not None and budget.error is None and budget.time_ms > max(times):
            outside.append(
                f"{shown_time(budget.time_ms)} {w.per}".rstrip()
                + f" is longer than the calibrated range, {_span(times, shown_time)}"
            )
        return tuple(outside)


def _span(values: Sequence[float], shown: Callable[[float], str]) -> str:
    return f"{shown(min(values))} to {shown(max(values))}"
