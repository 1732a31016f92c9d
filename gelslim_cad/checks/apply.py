"""Apply every rule to a design, or to many at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.checks import guide, making, mechanics, optics, structure  # noqa: F401
from gelslim_cad.checks.rule import RULES, Check, Finding, Rule, Status
from gelslim_cad.dimensions import Dimensions


def check(d: Dimensions) -> tuple[Check, ...]:
    """All rules on one design, in the order of definition."""
    return tuple(_check(entry, d) for entry in RULES.values())


def check_batch(d: Dimensions) -> Mapping[str, NDArray[np.bool_]]:
    """For each rule, where (n,) it fails, for the n designs of a batch."""
    failed = {}
    for entry in RULES.values():
        found = _find(entry, d)
        missed = _missed(found)
        failed[entry.id] = np.asarray(missed & (not found.advisory))
    return failed


def _find(entry: Rule, d: Dimensions) -> Finding:
    return entry.judge(*(d.argument(p)[1] for p in entry.inputs))


def _missed(found: Finding) -> Any:
    value, limit = np.asarray(found.value), np.asarray(found.limit)
    # Written so that a NaN misses.
    return ~(value >= limit) if found.least else ~(value <= limit)


def _check(entry: Rule, d: Dimensions) -> Check:
    found = _find(entry, d)
    value, limit = _number(found.value), _number(found.limit)
    missed = bool(np.all(_missed(found)))
    shown = limit
    status: Status = "pass"
    if missed:
        status = "warn" if found.advisory else "fail"
    elif found.caution is not None:
        caution = _number(found.caution)
        if (value < caution) if found.least else (value > caution):
            status, shown = "warn", caution
    margin = value - shown if found.least else shown - value
    words = "at least" if found.least else "at most"
    reason = f"{value:.4g} {entry.unit}".rstrip() + f", should be {words} {shown:.4g}: {entry.why}"
    if found.reason and missed:
        reason = f"{found.reason}; {entry.why}"
    good = status == "pass"
    unlimited = not np.isfinite(shown)
    return Check(
        id=entry.id,
        title=entry.title,
        value=value,
        limit=None if unlimited else shown,
        unit=entry.unit,
        margin=None if unlimited else margin,
        status=status,
        reason=entry.why if good else reason,
        parameter=entry.parameter,
        advice="" if good else entry.advice,
    )


def _number(value: Any) -> float:
    return float(np.reshape(np.asarray(value, dtype=float), -1)[0])
