"""A budget: limits on the error of a result and on the time that it takes."""

from __future__ import annotations

import math
import re
from dataclasses import InitVar, dataclass
from numbers import Real

from gelslim_core.errors import GelslimError

MAX_ERROR = 10.0
"""Largest relative error that may be asked for."""
TIME_UNITS_MS = {"": 1.0, "us": 1e-3, "µs": 1e-3, "ms": 1.0, "s": 1e3, "min": 6e4}
_TIME = re.compile(r"([-+0-9.eE]+?)\s*([a-zµ]*)")


class BudgetError(GelslimError, ValueError):
    """A budget cannot be read, or no rung of a ladder keeps it.

    Attributes:
        exit_status: 2, as for all input that cannot be used.
        kind: `bad input`.
    """


@dataclass(frozen=True)
class Budget:
    """Limits on error and time; None is no limit.

    `Budget(error=0.03, time="2s")` reads the time from text with a unit, `parse` reads both.

    Attributes:
        error: Relative error, 0.03 for 3 %.
        time_ms: Time in milliseconds of what the ladder times.

    Raises:
        BudgetError: A limit is not a finite number above 0, or the error is above 10.
    """

    error: float | None = None
    time_ms: float | None = None
    time: InitVar[str | None] = None

    def __post_init__(self, time: str | None) -> None:
        if time is not None:
            if self.time_ms is not None:
                raise BudgetError("give time or time_ms, not both")
            object.__setattr__(self, "time_ms", parse_time_ms(time))
        if self.error is not None and not 0 < _number("error", self.error) <= MAX_ERROR:
            raise BudgetError(
                f"error {self.error:g}: must be above 0 and at most {MAX_ERROR:g}, as 3% or 0.03"
            )
        if self.time_ms is not None and not 0 < _number("time_ms", self.time_ms) < math.inf:
            raise BudgetError(f"time {self.time_ms:g} ms: must be above 0, as 5ms or 2s")

    @classmethod
    def parse(cls, error: str | None = None, time: str | None = None) -> Budget:
        """Read a budget from text.

        Args:
            error: `3%` or `0.03`; None for no limit.
            time: `5ms`, `2s`, `1min` or a number of milliseconds; None for no limit.

        Returns:
            The budget.

        Raises:
            BudgetError: The text is none of these.
        """
        return cls(
            None if error is None else parse_share(error),
            None if time is None else parse_time_ms(time),
        )

    @property
    def unlimited(self) -> bool:
        """Whether it has no limit."""
        return self.error is None and self.time_ms is None

    def allows(self, error: float, time_ms: float) -> bool:
        """Whether a relative error and a time in ms are within the budget."""
        return self.allows_error(error) and self.allows_time(time_ms)

    def allows_error(self, error: float) -> bool:
        """Whether a relative error is within the budget."""
        return self.error is None or error <= self.error

    def allows_time(self, time_ms: float) -> bool:
        """Whether a time in ms is within the budget."""
        return self.time_ms is None or time_ms <= self.time_ms


def parse_share(text: str) -> float:
    """`3%` or `0.03` as 0.03; values above 1 only in per cent. Raises BudgetError."""
    stripped = text.strip()
    number = stripped.removesuffix("%")
    limit, divisor = (MAX_ERROR, 100) if number != stripped else (1.0, 1)
    try:
        value = float(number) / divisor
    except ValueError:
        value = math.nan
    if not 0 < value <= limit:
        meant = f"; for {number} per cent write {number}%" if limit < value <= 100 * limit else ""
        raise BudgetError(
            f"error {text!r}: must be above 0, in per cent as 3% or a number as 0.03{meant}"
        )
    return value


def parse_time_ms(text: str) -> float:
    """`5ms`, `2s`, `1min` or a number of milliseconds as milliseconds. Raises BudgetError."""
    if not isinstance(text, str):
        raise BudgetError(f"time {text!r}: give its unit, as '5ms' or '2s', or use time_ms")
    found = _TIME.fullmatch(text.strip())
    unit = found.group(2) if found else "?"
    try:
        value = float(found.group(1)) * TIME_UNITS_MS[unit] if found else math.nan
    except (KeyError, ValueError):
        value = math.nan
    if not 0 < value < math.inf:
        raise BudgetError(f"time {text!r}: must be above 0, as 5ms, 2s or a number of milliseconds")
    return value


def shown_share(share: float) -> str:
    """A relative error in per cent, with three significant digits."""
    return f"{100 * share:.3g} %"


def shown_time(time_ms: float) -> str:
    """A time in seconds or milliseconds, with three significant digits."""
    if time_ms >= 1000:
        return f"{time_ms / 1000:.3g} s"
    return f"{time_ms:.3g} ms"


def _number(name: str, value: object) -> float:
    """`value` as a float; BudgetError where it is not a number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise BudgetError(f"{name} {value!r}: must be a number; Budget.parse reads text")
    return float(value)
