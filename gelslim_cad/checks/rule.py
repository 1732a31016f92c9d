"""Design rules: pure functions of named spec fields and dimensions, as the dimensions are."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from gelslim_cad.checks.rule_ids import RuleId
from gelslim_cad.dimensions.dimensions import PATHS
from gelslim_cad.dimensions.registry import REGISTRY, unit_of
from gelslim_core.html_table import table_html

Status = Literal["pass", "warn", "fail"]
Sense = Literal["max", "min"]


@dataclass(frozen=True)
class Check:
    """A design rule applied to a design.

    Attributes:
        id: Name of the rule, such as `finger.thickness_mm`.
        title: What the rule demands.
        value: Value of the design, in `unit`.
        limit: Limit of the rule, in `unit`.
        unit: Unit of value, limit and margin.
        margin: Distance of the value from its limit; negative where the rule is broken.
        status: `pass`, `warn` or `fail`.
        reason: Why the rule exists, or what breaks it.
        parameter: Path of the spec field to change.
        advice: How to change it.
        sense: Whether the limit is the largest (`max`) or the smallest (`min`) legal value; empty
            where the sign of the margin tells.
        group: Heading under which the rule is listed.
    """

    id: str
    title: str
    value: float
    limit: float | None
    unit: str
    margin: float | None
    status: Status
    reason: str
    parameter: str
    advice: str = ""
    sense: Sense | Literal[""] = ""
    group: str = ""


class Checks(tuple[Check, ...]):
    """All rules on one design, group by group in the order of definition."""

    def of(self, rule_id: RuleId) -> Check:
        """The result of one rule."""
        return next(c for c in self if c.id == rule_id)

    def _repr_html_(self) -> str:
        """A table for notebooks: each rule with its value, limit and status."""
        rows = ((c.id, c.title, _shown(c.value), _shown(c.limit), c.unit, c.status) for c in self)
        return table_html(("rule", "title", "value", "limit", "unit", "status"), rows)


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


@dataclass(frozen=True)
class Finding:
    """What a rule finds; every field a number or an array (n,) over designs.

    The rule holds where `value` <= `limit` (or >= for a `least` rule), within `tolerance`.
    Where it does not, it fails; where it holds but `value` passes `caution`, or the rule only
    advises, it warns. `reason` says more of a single design that does not pass.
    """

    value: Any
    limit: Any
    least: bool = False
    caution: Any = None
    advisory: bool = False
    tolerance: Any = 0.0
    reason: Callable[[], str] | None = None


@dataclass(frozen=True)
class Rule:
    """A registered rule."""

    id: RuleId
    title: str
    parameter: str
    why: str
    advice: str
    unit: str
    inputs: tuple[str, ...]
    judge: Callable[..., Finding]
    of_markers: bool = False
    """Whether the rule is about the markers or the forces, and so left out without markers."""

    @property
    def group(self) -> str:
        """Title of the group of rules it belongs to."""
        return GROUPS.get(self.judge.__module__.rpartition(".")[2], OTHER)


GROUPS = {
    "optics": "Camera and view",
    "guide": "Light guide and LEDs",
    "structure": "Walls, fits and screws",
    "electronics": "LED boards",
    "thread": "Threads",
    "mount": "Mount and cable",
    "gripper": "Gripper",
    "making": "Printing, casting and marking",
    "mechanics": "Gel, mesh and envelope",
}
"""Titles of the groups by the module that defines their rules, in the order they are shown."""
OTHER = "Other"
"""Title of the last group: rules defined elsewhere, as by a user's program."""

RULES: dict[RuleId, Rule] = {}
"""All rules by id, in the order of definition."""


def rule(
    rule_id: RuleId,
    *,
    title: str,
    parameter: str,
    why: str,
    advice: str,
    unit: str | None = None,
    of_markers: bool = False,
) -> Callable[[Callable[..., Finding]], Callable[..., Finding]]:
    """Register a rule.

    Args:
        rule_id: Its name, such as `finger.thickness_mm`.
        title: What it demands.
        parameter: The spec path to change where it does not hold.
        why: Why it exists.
        advice: How to change the parameter.
        unit: Unit of value and limit; by default the suffix of its name.
        of_markers: Whether it is left out without markers.

    Returns:
        A decorator for the function that judges; its parameters name spec fields and dimensions.

    Raises:
        ValueError: The rule is defined twice, or names what does not exist.
    """

    def register(judge: Callable[..., Finding]) -> Callable[..., Finding]:
        if rule_id in RULES:
            raise ValueError(f"rule {rule_id} is defined twice")
        inputs = tuple(inspect.signature(judge).parameters)
        unknown = [name for name in inputs if name not in REGISTRY and name not in PATHS]
        if unknown:
            raise ValueError(
                f"rule {rule_id} needs {', '.join(unknown)}, which is neither a dimension nor a "
                "spec field"
            )
        if parameter not in PATHS.values():
            raise ValueError(f"rule {rule_id} names {parameter}, which is no spec field")
        shown = unit_of(rule_id) if unit is None else unit
        RULES[rule_id] = Rule(
            rule_id, title, parameter, why, advice, shown, inputs, judge, of_markers
        )
        return judge

    return register
