"""Two specs against each other: fields, dimensions and design rules; no CAD."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gelslim_cad.checks import Check, check
from gelslim_cad.compare.bundle_change import BundleChange, bundle_changes
from gelslim_cad.dimensions import Dimensions, definition, derive
from gelslim_cad.dimensions.registry import unit_of
from gelslim_cad.spec import Spec

SAME = 1e-9
"""Relative difference below which two numbers are the same: the fold's solver stops there."""


@dataclass(frozen=True)
class Change:
    """A value that differs; `meaning` says of a dimension what it is."""

    name: str
    unit: str
    before: Any
    after: Any
    meaning: str = ""

    @property
    def difference(self) -> float | None:
        """After less before; None where one is no number."""
        pair = (self.before, self.after)
        if any(isinstance(v, bool) or not isinstance(v, int | float) for v in pair):
            return None
        return float(self.after) - float(self.before)


@dataclass(frozen=True)
class RuleChange:
    """A design rule whose value, limit or status differs."""

    before: Check
    after: Check

    @property
    def id(self) -> str:
        """The rule."""
        return self.after.id

    @property
    def verdict(self) -> str:
        """Whether it breaks, is mended, or only moves."""
        order = ("pass", "warn", "fail")
        step = order.index(self.after.status) - order.index(self.before.status)
        return "moves" if step == 0 else "gets worse" if step > 0 else "gets better"


@dataclass(frozen=True)
class Comparison:
    """All that changes from one spec to another, short of its parts."""

    fields: tuple[Change, ...]
    dimensions: tuple[Change, ...]
    rules: tuple[RuleChange, ...]
    bundle: tuple[BundleChange, ...]

    @property
    def same(self) -> bool:
        """Whether nothing changes."""
        return not (self.fields or self.dimensions or self.rules or self.bundle)


def compare(first: Spec, second: Spec) -> Comparison:
    """What changes from the first spec to the second; a pure function of the two."""
    before, after = derive(first), derive(second)
    return Comparison(
        tuple(_fields(before, after)),
        tuple(_dimensions(before, after)),
        tuple(_rules(before, after)),
        bundle_changes(before, after),
    )


def differ(before: Any, after: Any) -> bool:
    """Whether two values differ by more than the solver's accuracy."""
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (before, after))
    if not numbers:
        return bool(before != after)
    if math.isnan(before) or math.isnan(after):
        return math.isnan(before) != math.isnan(after)
    return not math.isclose(before, after, rel_tol=SAME, abs_tol=SAME)


def _fields(before: Dimensions, after: Dimensions) -> Iterable[Change]:
    for path, value in before.given.items():
        if value != after.given[path]:
            yield Change(path, unit_of(path), value, after.given[path])


def _dimensions(before: Dimensions, after: Dimensions) -> Iterable[Change]:
    for name, value in before.values.items():
        if differ(value, after.values[name]):
            entry = definition(name)
            yield Change(name, entry.unit, value, after.values[name], entry.title.rstrip("."))


def _rules(before: Dimensions, after: Dimensions) -> Iterable[RuleChange]:
    for old, new in zip(check(before), check(after), strict=True):
        if old.status != new.status or differ(old.value, new.value) or differ(old.limit, new.limit):
            yield RuleChange(old, new)
