"""A budget: how much a result may err, and how long it may take."""

from __future__ import annotations

import math
import re
from dataclasses import InitVar, dataclass
from numbers import Real

from gelslim_core.budget.errors import BudgetError

MOST_ERROR = 10.0
"""A result that errs by more than ten times itself is no result."""
TIME_UNITS_MS = {"": 1.0, "us": 1e-3, "µs": 1e-3, "ms": 1.0, "s": 1e3, "min": 6e4}
_TIME = re.compile(r"([-+0-9.eE]+?)\s*([a-zµ]*)")


@dataclass(frozen=True)
class Budget:
    """Limits on error and time; None is no limit.

    `Budget(error=0.03, time="2s")` reads the time from words, `parse` both.

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
        if self.error is not None and not 0 < _number("error", self.error) <= MOST_ERROR:
            raise BudgetError(
                f"error {self.error:g}: must be a share above 0 and at most {MOST_ERROR:g}, "
                "as 3% or 0.03"
            )
        if self.time_ms is not None and not 0 < _number("time_ms", self.time_ms) < math.inf:
            raise BudgetError(f"time {self.time_ms:g} ms: must be above 0, as 5ms or 2s")

    @classmethod
    def parse(cls, error: str | None = None, time: str | None = None) -> Budget:
        """From words: `3%` or `0.03`, and `5ms`, `2s`, `1min` or a bare number of ms.

        Raises BudgetError for anything else.
        """
        return cls(
            None if error is None else parse_share(error),
            None if time is None else parse_time_ms(time),
        )

    @property
    def unlimited(self) -> bool:
        """Whether it asks for nothing."""
        return self.error is None and self.time_ms is None

    def allows(self, error: float, time_ms: float) -> bool:
        """Whether an error and a time are within it."""
        return self.allows_error(error) and self.allows_time(time_ms)

    def allows_error(self, error: float) -> bool:
        """Whether an error is within it."""
        return self.error is None or error <= self.error

    def allows_time(self, time_ms: float) -> bool:
        """Whether a time is within it."""
        return self.time_ms is None or time_ms <= self.time_ms


def parse_share(text: str) -> float:
    """`3%` or `0.03` as 0.03; more than 1 only in per cent. Raises BudgetError."""
    bare = text.strip()
    number = bare.removesuffix("%")
    most, size = (MOST_ERROR, 100) if number != bare else (1.0, 1)
    try:
        value = float(number) / size
    except ValueError:
        value = math.nan
    if not 0 < value <= most:
        meant = f"; for {number} per cent write {number}%" if most < value <= 100 * most else ""
        raise BudgetError(
            f"error {text!r}: must be above 0, in per cent as 3% or a share as 0.03{meant}"
        )
    return value


def parse_time_ms(text: str) -> float:
    """`5ms`, `2s`, `1min` or a bare number of milliseconds, in ms. Raises BudgetError."""
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
    """A share in per cent, three digits that count."""
    return f"{100 * share:.3g} %"


def shown_time(time_ms: float) -> str:
    """A time in the unit that reads best, three digits that count."""
    if time_ms >= 1000:
        return f"{time_ms / 1000:.3g} s"
    return f"{time_ms:.3g} ms"


def _number(name: str, value: object) -> float:
    """The value if it is a number; words and yes or no are refused with BudgetError."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise BudgetError(f"{name} {value!r}: must be a number; Budget.parse reads words")
    return float(value)
