"""Designs for the tests of rules: the smallest shipped finger, changed by path or dimension."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from shipped_fingers import varied

from gelslim_cad.checks import Check, check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

DESIGNS = Path(__file__).parents[2] / "designs"


@cache
def shipped(name: str) -> Spec:
    return read_spec(DESIGNS / f"{name}.yaml").spec


def overruled(d: Dimensions, values: dict[str, Any]) -> Dimensions:
    """`d` with dimensions or spec values put in by hand, nothing derived again."""
    assert set(values) <= set(d.values) | set(d.given), values
    dimensions = {n: v for n, v in values.items() if n in d.values}
    given = {n: v for n, v in values.items() if n in d.given}
    return replace(d, values={**d.values, **dimensions}, given={**d.given, **given})


@cache
def smallest() -> Dimensions:
    return derive(shipped("mini20"))


def judged(
    rule: str, changes: dict[str, Any] | None = None, values: dict[str, Any] | None = None
) -> Check:
    """One rule on mini20 with the spec changed, then values overruled."""
    d = derive(varied(shipped("mini20"), changes)) if changes else smallest()
    return next(c for c in check(overruled(d, values or {})) if c.id == rule)
