"""Apply every rule to a design, or to many at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.checks import (  # noqa: F401  (registers)
    electronics,
    gripper,
    guide,
    making,
    mechanics,
    mount,
    optics,
    structure,
    thread,
)
from gelslim_cad.checks.rule import GROUPS, OTHER, RULES, Check, Checks, Finding, Rule, Status
from gelslim_cad.checks.rule_ids import RuleId
from gelslim_cad.dimensions import Dimensions, DimensionsBatch
from gelslim_cad.dimensions.dimensions import Derived


def check(d: Dimensions) -> Checks:
    """Apply every design rule to one design.

    Args:
        d: Dimensions of the design.

    Returns:
        One result for each rule, group by group in the order of definition; without markers
        those on markers, mesh and forces are left out.
    """
    order = [*GROUPS.values(), OTHER]
    ordered = sorted(_applied(d), key=lambda entry: order.index(entry.group))
    return Checks(_check(entry, d) for entry in ordered)


def margins_batch(d: DimensionsBatch) -> Mapping[RuleId, NDArray[np.float64]]:
    """For each rule its margin (n,) as a part of its limit; below 0 exactly where it fails.

    Limits below 1 in the rule's unit count as 1; infinite where a design has no limit, minus
    infinity where a value is not a number.
    """
    count = len(d)
    margins = {}
    for entry in _applied(d):
        found = _find(entry, d)
        value, limit = np.asarray(found.value, dtype=float), np.asarray(found.limit, dtype=float)
        with np.errstate(invalid="ignore"):
            room = (value - limit if found.least else limit - value) / np.maximum(
                np.abs(limit), 1.0
            )
        room = np.where(np.isinf(limit), np.inf, room)
        failed = _missed(found) & (not found.advisory)
        least = np.finfo(float).tiny
        kept = np.where(np.isnan(room), 0.0, np.maximum(room, 0.0))
        missed = np.where(np.isnan(room), -np.inf, np.minimum(room, -least))
        margins[entry.id] = np.broadcast_to(np.where(failed, missed, kept).ravel(), (count,))
    return margins


def _applied(d: Derived) -> tuple[Rule, ...]:
    """The rules that are about this kind of finger."""
    marked = d.given["design.markers.pattern"] != "none"
    return tuple(entry for entry in RULES.values() if marked or not entry.of_markers)


def _find(entry: Rule, d: Derived) -> Finding:
    return entry.judge(*(d.argument(p)[1] for p in entry.inputs))


def _missed(found: Finding) -> Any:
    return _passed(found, found.limit)


def _passed(found: Finding, limit: Any) -> Any:
    """Where the value is beyond `limit` by more than the tolerance; NaN always is."""
    value, limit = np.asarray(found.value), np.asarray(limit)
    if found.least:
        return ~(value >= limit - found.tolerance)
    return ~(value <= limit + found.tolerance)


def _check(entry: Rule, d: Dimensions) -> Check:
    found = _find(entry, d)
    value, limit = _number(found.value), _number(found.limit)
    missed = bool(np.all(_missed(found)))
    shown = limit
    status: Status = "pass"
    if missed:
        status = "warn" if found.advisory else "fail"
    elif found.caution is not None and bool(np.all(_passed(found, found.caution))):
        status, shown = "warn", _number(found.caution)
    good = status == "pass"
    unlimited = not np.isfinite(shown)
    margin = value - shown if found.least else shown - value
    # Within the tolerance a value is at its limit, not beyond it.
    margin = max(margin, 0.0) if good else margin
    words = "at least" if found.least else "at most"
    reason = f"{value:.4g} {entry.unit}".rstrip() + f", should be {words} {shown:.4g}: {entry.why}"
    if found.reason is not None and not good:
        reason = f"{found.reason()}; {entry.why}"
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
        sense="min" if found.least else "max",
        group=entry.group,
    )


def _number(value: Any) -> float:
    return float(np.reshape(np.asarray(value, dtype=float), -1)[0])
