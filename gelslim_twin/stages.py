"""The modules that a plan calls for: imported here and nowhere before."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

from gelslim_twin.plan import Plan


@dataclass(frozen=True)
class Stage:
    """An effect that is simulated: its module and the knobs of its rung."""

    effect: str
    module: ModuleType
    rung_parameters: dict[str, Any]


def load_stages(plan: Plan) -> tuple[Stage, ...]:
    """Import the implementations of the plan's effects, in the plan's order, and no others.

    Raises ImportError where a library for one of them is missing.
    """
    return tuple(
        Stage(c.effect, import_module(c.implementation), dict(c.rung_parameters))
        for c in plan.included
    )
