"""One plan for all samples of a data set, made from the hardest of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from functools import reduce
from statistics import median
from typing import TYPE_CHECKING, Any

from gelslim_twin.effects.effect import Bound, combined, unit_of
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.order import application_order
from gelslim_twin.planning.plan import Choice, Plan
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


def missed(
    plan: Plan, scenes: Sequence[LoadedScene], figures: SensorFigures
) -> dict[str, dict[str, Any]]:
    """Where the effects of a plan may miss its tolerance, by observable.

    An effect that is left out counts with its bound in each scene, one that is simulated with the
    error of its rung.

    Args:
        plan: The plan of all scenes.
        scenes: Some samples as they are drawn.
        figures: Figures of the sensor.

    Returns:
        For each observable that is missed in a scene: the `tolerance`, in how many of the scenes it
        is missed, the `median` and the `largest` error, and the effects that err most.
    """
    kept = {choice.effect for choice in plan.included}
    errors: dict[str, list[dict[str, float]]] = {name: [] for name in plan.observe}
    for scene in scenes:
        circumstances = question(scene, figures).circumstances
        for observable in plan.observe:
            errors[observable].append(
                {
                    effect.name: (
                        plan.choice(effect.name).error
                        if effect.name in kept
                        else effect.bound(circumstances)
                    ).of(observable)
                    for effect in EFFECTS
                    if dict(plan.choice(effect.name).shares)
                }
            )
    found: dict[str, dict[str, Any]] = {}
    for observable, by_scene in errors.items():
        allowed = plan.force_n if unit_of(observable) == "n" else plan.image_px
        sums = [
            combined((error, plan.choice(name).is_scattered) for name, error in values.items())
            for values in by_scene
        ]
        if not sums or max(sums) <= allowed * (1 + 1e-12):
            continue
        worst = by_scene[sums.index(max(sums))]
        found[observable] = {
            "tolerance": allowed,
            "samples_judged": len(sums),
            "samples_over": sum(value > allowed for value in sums),
            "median": median(sums),
            "largest": max(sums),
            "effects": sorted((n for n, v in worst.items() if v > 0), key=lambda n: -worst[n])[:2],
        }
    return found


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
