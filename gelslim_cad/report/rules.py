"""The report's design rules: a bar of value against limit, the reason, what to change."""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import TYPE_CHECKING

from gelslim_cad.report.markup import anchor, coordinate, text, with_unit

if TYPE_CHECKING:
    from gelslim_cad.checks.rule import Check, Sense, Status

MARKS: dict[Status, str] = {"pass": "✓", "warn": "!", "fail": "✕"}
ORDER: dict[Status, int] = {"fail": 0, "warn": 1, "pass": 2}
WIDTH = 240.0
LIMIT_AT = 0.62
LEAST_MARGIN = 1e-5
"""Relative to the larger of value and limit, which are written with four digits."""


def rules(rows: tuple[Check, ...]) -> str:
    """List the rules, failures first, then warnings, then the rest, each in the given order."""
    ordered = sorted(rows, key=lambda row: ORDER[row.status])
    body = "".join(_rule(row) for row in ordered)
    return (
        '<div class="tools" role="radiogroup" aria-label="Which rules">'
        '<label><input type="radio" name="rule-status" value="all" checked> all</label>'
        '<label><input type="radio" name="rule-status" value="open"> only warnings and failures'
        f'</label></div><div class="card rules">{body}</div>'
    )


def verdict(rows: tuple[Check, ...]) -> tuple[Status, str]:
    """Summarise the rules as a status and a phrase."""
    counts = Counter(row.status for row in rows)
    if counts["fail"]:
        return "fail", f"{counts['fail']} of {len(rows)} rules fail"
    if counts["warn"]:
        return "warn", f"passes, {counts['warn']} warning{'s' if counts['warn'] > 1 else ''}"
    return "pass", f"passes all {len(rows)} rules"


def pill(status: Status, phrase: str) -> str:
    """Draw a status as a coloured label with a mark, so that it is also legible without colour."""
    mark = f'<span aria-hidden="true">{MARKS[status]}</span>'
    return f'<span class="pill {status}">{mark}{text(phrase)}</span>'


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
    # A rule that leaves its sense open has a largest value.
    sense: Sense = row.sense or "max"
    margin = limit = ""
    if row.margin is not None:
        margin = f"margin {with_unit(_shown_margin(row), row.unit, 3)}"
    if row.limit is not None:
        sign = "≤ " if sense == "max" else "≥ "
        limit = f"{sign}{with_unit(row.limit, row.unit, 4)}"
    return (
        f'<div class="numbers"><span><strong>{with_unit(row.value, row.unit, 4)}</strong></span>'
        f'<span class="soft">{limit}</span></div>'
        f'{_bar(row, sense)}<div class="soft">{margin}</div>'
    )


def _bar(row: Check, sense: Sense) -> str:
    if row.limit is None or not math.isfinite(row.value):
        return ""
    zero, at_value, at_limit = bar_positions(row.value, row.limit)
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


def _shown_margin(row: Check) -> float:
    """The margin, or 0 where it is smaller than value and limit show: 3e-7 mm is solver noise."""
    assert row.margin is not None
    assert row.limit is not None
    scale = max(abs(row.value), abs(row.limit))
    return 0.0 if abs(row.margin) < LEAST_MARGIN * scale else row.margin


def _sentences(reason: str) -> str:
    """Start every sentence of a reason with a capital letter."""
    return re.sub(r"(^|[.!?] )([a-z])", lambda hit: hit[1] + hit[2].upper(), reason)
