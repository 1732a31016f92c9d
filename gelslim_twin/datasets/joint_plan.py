"""One plan for all samples of a data set, made from the hardest of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from functools import reduce
from typing import TYPE_CHECKING

from gelslim_twin.effects.effect import Bound
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Choice, Plan
from gelslim_twin.planning.planner import application_order
from gelslim_twin.planning.question import question
from gelslim_twin.scene.draw import corner
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.scene_task import planned

if TYPE_CHECKING:
    from gelslim_twin.effects.circumstances import SensorFigures
    from ifem_export.compliance.columns import SurfaceCompliance


def hardest(loaded: LoadedScene) -> list[LoadedScene]:
    """The hardest sample of every tool on every path: all ranges at their farther end.

    Where sizes are drawn, there is one with the largest and one with the smallest tool.
    """
    vary = loaded.scene.vary
    sizes = (False, True) if vary.size_factor is not None else (False,)
    return [
        loaded.with_drawn(corner(loaded.scene, tool, motion, small))
        for tool in range(len(loaded.tools))
        for motion in range(len(vary.motions or (0,)))
        for small in sizes
    ]


def plan_of_all(
    scenes: Sequence[LoadedScene],
    figures: SensorFigures,
    compliance: Callable[[], SurfaceCompliance] | None,
) -> Plan:
    """The plan that includes what any of the scenes needs, as finely as any of them needs it.

    Args:
        scenes: At least one, from `hardest`.
        figures: Figures of the sensor.
        compliance: As for `planned`.

    Raises:
        InputError: As `planned`.
    """
    return joined([planned(one, question(one, figures), compliance) for one in scenes])


def joined(plans: Sequence[Plan]) -> Plan:
    """One plan for several scenes that observe the same.

    Sizes and errors are the largest of all, so that `over_tolerance` is that of the worst scene.
    """
    first = plans[0]
    choices = tuple(
        _joined_choice([plan.choice(one.effect) for plan in plans]) for one in first.choices
    )
    kept = {choice.effect for choice in choices if choice.included}
    return replace(
        first,
        choices=choices,
        order=application_order([e for e in EFFECTS if e.name in kept]),
        poses=max(plan.poses for plan in plans),
        probe_ms=sum(plan.probe_ms for plan in plans),
    )


def _joined_choice(choices: Sequence[Choice]) -> Choice:
    included = [choice for choice in choices if choice.included]
    size = _largest([choice.size for choice in choices])
    if not included:
        worst = max(choices, key=lambda choice: _sum(choice.error))
        return replace(worst, size=size, error=_largest([choice.error for choice in choices]))
    finest = min(included, key=lambda choice: (_sum(choice.error), -choice.predicted_ms))
    return replace(finest, size=size)


def _sum(bound: Bound) -> float:
    return float(sum(astuple(bound)))


def _largest(bounds: Sequence[Bound]) -> Bound:
    return reduce(Bound.at_least, bounds)
