"""The report's design rules: a bar of value against limit, the reason, what to change."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Literal

from gelslim_cad.report.data import ReportData
from gelslim_cad.report.markup import anchor, coordinate, text, with_unit

if TYPE_CHECKING:
    from gelslim_cad.checks.rule import Check, Status

MARKS: dict[Status, str] = {"pass": "✓", "warn": "!", "fail": "✕"}
ORDER: dict[Status, int] = {"fail": 0, "warn": 1, "pass": 2}
WIDTH = 240.0
LIMIT_AT = 0.62
LEAST_MARGIN = 1e-5
"""Relative to the larger of value and limit, which are written with four digits."""


def rules(rows: tuple[Check, ...]) -> str:
    """List the rules, failures first, then warnings, then the rest, each in the given order."""
    if not rows:
        return '<p class="card empty">No design rules were checked.</p>'
    ordered = sorted(rows, key=lambda row: ORDER[row.status])
    body = "".join(_rule(row) for row in ordered)
    return (
        '<div class="tools" role="radiogroup" aria-label="Which rules">'
        '<label><input type="radio" name="rule-status" value="all" checked> all</label>'
        '<label><input type="radio" name="rule-status" value="open"> only warnings and failures'
        f'</label></div><div class="card rules">{body}</div>'
    )


def verdict(data: ReportData) -> tuple[Status, str]:
    """Summarise the rules as a status and a phrase."""
    counts = data.counts
    total = sum(counts.values())
    if not total:
        return "warn", "rules not checked"
    if counts["fail"]:
        return "fail", f"{counts['fail']} of {total} rules fail"
    if counts["warn"]:
        return "warn", f"passes, {_many(counts['warn'], 'warning')}"
    return "pass", f"passes all {total} rules" if total > 1 else "passes the one rule"


def pill(status: Status, phrase: str) -> str:
    """Draw a status as a coloured label with a mark, so that it is also legible without colour."""
    mark = f'<span aria-hidden="true">{MARKS[status]}</span>'
    return f'<span class="pill {status}">{mark}{text(phrase)}</span>'


def sense_of(row: Check) -> Literal["max", "min", ""]:
    """Whether the limit is the largest or smallest legal value: given, or by the margin's sign."""
    if row.sense:
        return row.sense
    value, limit = _real(row.value), _real(row.limit)
    if value is None or limit is None:
        return ""
    holds = row.margin >= 0 if row.margin is not None else row.status != "fail"
    if value == limit:
        return "max"
    return "max" if (value < limit) == holds else "min"


def _rule(row: Check) -> str:
    reason = ". ".join(filter(None, (row.reason, row.advice)))
    change = ""
    if row.parameter:
        change = f'<p class="change">Change: <code>{text(row.parameter)}</code></p>'
    return (
        f'<article class="rule {row.status}" id="{anchor("rule", row.id)}" '
        f'data-status="{row.status}"><div class="verdict">'
        f'<span class="mark" role="img" aria-label="{row.status}">{MARKS[row.status]}</span>'
        f"<div><h3>{text(row.title)}</h3><code>{text(row.id)}</code></div></div>"
        f'<div class="gauge">{_gauge(row)}</div>'
        f'<div class="why"><p>{text(_sentences(reason))}</p>{change}</div></article>'
    )


def _gauge(row: Check) -> str:
    sense = sense_of(row)
    sign = {"max": "≤ ", "min": "≥ ", "": ""}[sense]
    margin = ""
    if row.margin is not None:
        margin = f"margin {with_unit(_shown_margin(row), row.unit, 3)}"
    if isinstance(row.limit, bool | str):
        sign = "wanted: "
    limit = "" if row.limit is None else f"{sign}{with_unit(row.limit, row.unit, 4)}"
    value = "" if row.value is None else f"<strong>{with_unit(row.value, row.unit, 4)}</strong>"
    return (
        f'<div class="numbers"><span>{value}</span><span class="soft">{limit}</span></div>'
        f'{_bar(row, sense)}<div class="soft">{margin}</div>'
    )


def _bar(row: Check, sense: Literal["max", "min", ""]) -> str:
    value, limit = _real(row.value), _real(row.limit)
    if value is None or limit is None or not sense:
        return ""
    zero, at_value, at_limit = bar_positions(value, limit)
    left, width = min(zero, at_value), max(abs(at_value - zero), 1.5)
    bad_left, bad_width = (at_limit, WIDTH - at_limit) if sense == "max" else (0.0, at_limit)
    return (
        f'<svg viewBox="0 0 {WIDTH:g} 16" preserveAspectRatio="none" aria-hidden="true">'
        f'<rect class="track" y="3" width="{WIDTH:g}" height="10"/>'
        f'<rect class="illegal" x="{coordinate(bad_left)}" y="3" width="{coordinate(bad_width)}" '
        f'height="10"/><rect class="fill" x="{coordinate(left)}" y="5" '
        f'width="{coordinate(width)}" height="6"/>'
        f'<line class="limit" x1="{coordinate(at_limit)}" x2="{coordinate(at_limit)}" y1="0" '
        'y2="16"/></svg>'
    )


def bar_positions(value: float, limit: float) -> tuple[float, float, float]:
    """Positions of zero, value and limit on a bar of `WIDTH`.

    For a positive limit and a value that is not negative the bar starts at zero, the limit sits
    at `LIMIT_AT` and a value far beyond it is cut at the end; otherwise the bar spans all three.
    """
    if limit > 0 and value >= 0:
        share = min(value / limit * LIMIT_AT, 1.0)
        return 0.0, share * WIDTH, LIMIT_AT * WIDTH
    low, high = min(0.0, value, limit), max(0.0, value, limit)
    span = (high - low) or 1.0
    low, span = low - 0.15 * span, 1.3 * span
    zero, at_value, at_limit = ((x - low) / span * WIDTH for x in (0.0, value, limit))
    return zero, at_value, at_limit


def _real(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def _shown_margin(row: Check) -> float:
    """The margin, or 0 where it is smaller than value and limit show: 3e-7 mm is solver noise."""
    assert row.margin is not None
    scale = max((abs(x) for x in (_real(row.value), _real(row.limit)) if x is not None), default=0)
    return 0.0 if abs(row.margin) < LEAST_MARGIN * scale else row.margin


def _sentences(reason: str) -> str:
    """Start every sentence of a reason with a capital letter."""
    return re.sub(r"(^|[.!?] )([a-z])", lambda hit: hit[1] + hit[2].upper(), reason)


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
