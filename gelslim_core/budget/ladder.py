"""Ladders of rungs with known error and cost, and the choice of a rung for a budget.

A limit on the error picks the rung of least work that keeps it. Work is counted, not timed, so that
every machine picks the same rung. A limit on the time picks the most accurate rung that keeps it;
this choice depends on the machine. With both limits, the rung of least work that keeps both is
picked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from gelslim_core.budget.budget import Budget, BudgetError, shown_share, shown_time


@dataclass(frozen=True)
class Rung:
    """One way to compute a result, with its error and its cost.

    Attributes:
        name: Name of the rung.
        error: Relative error.
        time_ms: Time in milliseconds; NaN where it was not measured.
        work: Counted cost, which orders the rungs of a ladder: bytes read, rays, or predicted
            operations. It is the same on every machine and in every run.
        measured: Whether error and time were measured; False where they are extrapolated.
    """

    name: str
    error: float
    time_ms: float
    work: float
    measured: bool = True

    @property
    def timed(self) -> bool:
        """Whether its time was measured."""
        return not math.isnan(self.time_ms)

    def __str__(self) -> str:
        time = f", {shown_time(self.time_ms)}" if self.timed else ""
        return f"{self.name} ({shown_share(self.error)}{time})"


@dataclass(frozen=True)
class Wording:
    """The terms that the messages about a ladder use.

    Attributes:
        rung: What a rung is, such as `operator`.
        error: Which error a rung has, such as `field error`.
        per: What its time is measured for, such as `per frame`.
        remedy: What makes smaller errors possible, such as `use more layers`.
        bench: The command that measures the times on this machine.
    """

    rung: str = "rung"
    error: str = "error"
    per: str = ""
    remedy: str = ""
    bench: str = "gelslim bench"


@dataclass(frozen=True)
class Choice:
    """The rung that was chosen.

    Attributes:
        rung: The rung.
        remarks: Where the budget or the rung lies outside the range that was measured.
    """

    rung: Rung
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ladder:
    """The rungs of one approximation.

    Attributes:
        rungs: At least one rung; between rungs of equal work the first one is preferred.
        wording: The terms that messages use.

    Raises:
        BudgetError: There is no rung.
    """

    rungs: tuple[Rung, ...]
    wording: Wording = Wording()

    def __post_init__(self) -> None:
        if not self.rungs:
            raise BudgetError(f"a ladder needs at least one {self.wording.rung}")

    @property
    def by_work(self) -> tuple[Rung, ...]:
        """The rungs, least work first."""
        return tuple(sorted(self.rungs, key=lambda rung: rung.work))

    def choose(self, budget: Budget) -> Choice:
        """Choose the rung for a budget.

        Args:
            budget: The limits; without any the most accurate rung is chosen.

        Returns:
            The rung with remarks.

        Raises:
            BudgetError: No rung keeps the budget; the message names the nearest rungs. Or the
                budget limits the time, and the times were not measured.
        """
        if budget.time_ms is not None and not all(r.timed for r in self.rungs):
            raise BudgetError(
                f"the time of each {self.wording.rung} was not measured yet; "
                f"`{self.wording.bench}` measures it on this machine"
            )
        allowed = [r for r in self.by_work if budget.allows(r.error, r.time_ms)]
        if not allowed:
            raise BudgetError(self._refusal(budget))
        rung = allowed[0] if budget.error is not None else min(allowed, key=lambda r: r.error)
        return Choice(rung, self._remarks(budget, rung))

    def nearest(self, budget: Budget) -> tuple[Rung, Rung]:
        """The two rungs nearest to a budget that no rung keeps.

        Returns:
            The most accurate rung that keeps the limit on time (the fastest rung where none does),
            and the fastest rung that keeps the limit on error (the most accurate where none does).
        """
        in_time = [r for r in self.by_work if budget.allows_time(r.time_ms)]
        in_error = [r for r in self.by_work if budget.allows_error(r.error)]
        fast = min(in_time, key=lambda r: r.error) if in_time else self._fastest(self.by_work)
        accurate = self._fastest(in_error or [min(self.by_work, key=lambda r: r.error)])
        return fast, accurate

    def timed(self, times_ms: Mapping[str, float]) -> Ladder:
        """The ladder with other times in ms, by name of the rung; other rungs keep theirs."""
        return replace(
            self,
            rungs=tuple(replace(r, time_ms=times_ms.get(r.name, r.time_ms)) for r in self.rungs),
        )

    @staticmethod
    def _fastest(rungs: tuple[Rung, ...] | list[Rung]) -> Rung:
        return min(rungs, key=lambda r: r.time_ms if r.timed else r.work)

    def _refusal(self, budget: Budget) -> str:
        w = self.wording
        wanted = []
        if budget.error is not None:
            wanted.append(f"{w.error} of {shown_share(budget.error)}")
        if budget.time_ms is not None:
            wanted.append(f"{shown_time(budget.time_ms)} {w.per}".rstrip())
        fast, accurate = self.nearest(budget)
        nearest = str(fast)
        if fast != accurate:
            nearest = f"{fast} in time, {accurate} in error"
        message = f"no {w.rung} keeps the budget, {' in '.join(wanted)}; the nearest: {nearest}"
        if w.remedy and not budget.allows_error(accurate.error):
            message += f"; {w.remedy}"
        return message

    def _remarks(self, budget: Budget, rung: Rung) -> tuple[str, ...]:
        """Where the budget or the rung lies outside the range that was measured."""
        w, measured = self.wording, [r for r in self.rungs if r.measured]
        if not measured:
            return ()
        errors, times = [r.error for r in measured], [r.time_ms for r in measured]
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
