"""Budgets are read from words, and anything else is refused with what was meant."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from gelslim_core.budget.budget import (
    Budget,
    BudgetError,
    parse_share,
    parse_time_ms,
    shown_share,
    shown_time,
)


@pytest.mark.parametrize(
    ("text", "share"),
    [("3%", 0.03), (" 3 % ", 0.03), ("0.03", 0.03), ("100%", 1.0), ("1", 1.0), ("527%", 5.27)],
)
def test_shares_are_read(text: str, share: float) -> None:
    assert parse_share(text) == pytest.approx(share)


@pytest.mark.parametrize("text", ["", "%", "3 %%", "much", "0", "-1%", "nan", "inf", "1001%"])
def test_other_shares_are_refused(text: str) -> None:
    with pytest.raises(BudgetError):
        parse_share(text)


def test_a_share_above_one_asks_for_per_cent() -> None:
    with pytest.raises(BudgetError, match="3%"):
        parse_share("3")


@pytest.mark.parametrize(
    ("text", "ms"),
    [("5ms", 5.0), ("5", 5.0), ("2s", 2000.0), ("0.5 s", 500.0), ("1min", 6e4), ("1e-3s", 1.0),
     ("250us", 0.25), ("250µs", 0.25), (".5", 0.5)],
)  # fmt: skip
def test_times_are_read(text: str, ms: float) -> None:
    assert parse_time_ms(text) == pytest.approx(ms)


@pytest.mark.parametrize("text", ["", "s", "5h", "-2s", "0", "nan", "inf", "5 ms s", "1e400s"])
def test_other_times_are_refused(text: str) -> None:
    with pytest.raises(BudgetError):
        parse_time_ms(text)


def test_parse_takes_both_or_none() -> None:
    assert Budget.parse("3%", "2s") == Budget(0.03, 2000.0)
    assert Budget.parse() == Budget()
    assert Budget().unlimited
    assert not Budget(time_ms=1.0).unlimited


@pytest.mark.parametrize("value", [0.0, -0.1, math.nan, math.inf])
def test_limits_must_be_positive_and_finite(value: float) -> None:
    with pytest.raises(BudgetError, match=f"{value:g}"):
        Budget(error=value)
    with pytest.raises(BudgetError, match=f"{value:g}"):
        Budget(time_ms=value)


def test_a_researchers_budget() -> None:
    assert Budget(error=0.03, time="2s") == Budget(0.03, 2000.0)
    assert Budget(error=np.float32(0.5), time_ms=np.int64(3)).allows(0.5, 3.0)
    assert replace(Budget(time="2s"), error=0.1) == Budget(0.1, 2000.0)


def test_values_of_the_wrong_type_are_refused() -> None:
    with pytest.raises(BudgetError, match="error '3%'"):
        Budget(error="3%")  # type: ignore[arg-type]
    with pytest.raises(BudgetError, match="time_ms '5ms'"):
        Budget(time_ms="5ms")  # type: ignore[arg-type]
    with pytest.raises(BudgetError, match="time 2:"):
        Budget(time=2)  # type: ignore[arg-type]
    with pytest.raises(BudgetError, match="error True"):
        Budget(error=True)
    with pytest.raises(BudgetError, match="time_ms"):
        Budget(time_ms=5.0, time="5ms")


def test_limits_are_kept_exactly() -> None:
    budget = Budget(0.03, 5.0)
    assert budget.allows(0.03, 5.0)
    assert not budget.allows(math.nextafter(0.03, 1), 5.0)
    assert not budget.allows(0.03, math.nextafter(5.0, 9))
    assert Budget().allows(1e9, 1e9)


def test_shares_and_times_are_shown_with_three_digits() -> None:
    assert [shown_share(x) for x in (0.03, 0.010633, 5.2793)] == ["3 %", "1.06 %", "528 %"]
    assert [shown_time(x) for x in (0.0403, 5.0, 1234.0)] == ["0.0403 ms", "5 ms", "1.23 s"]
