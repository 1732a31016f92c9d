"""Tolerances of a scene as rungs: the relative error of each plan and its time per pose.

Errors and work are those that the effects declare, so they are the same on every machine; the
paces measured on a machine only scale the times. Errors of forces are relative to the force of
the deepest contact, errors in the picture to the depth of that contact in pixels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gelslim_core.budget.budget import Budget, BudgetError, shown_share
from gelslim_core.budget.ladder import Choice, Ladder, Rung, Wording
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import unit_of
from gelslim_twin.planning.plan import Plan, summed_error
from gelslim_twin.planning.planner import Question, make_plan

LEVELS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5)
FINER = (1e-9, 1e-4, 2e-4, 5e-4)
"""Used only where an error is given; at the first level every effect takes its finest rung."""
FITTED_RADII = (0.7, 3.0)
"""Ratios of contact radius to gel thickness for which the estimate of the force was fitted."""
GEL, LARGE_STRAIN, PICTURE = "gel", "large strain", "picture"
WORDING = Wording(
    "tolerance", "error", "per pose", "no effect has a finer rung that would err less"
)


@dataclass(frozen=True)
class Tolerance:
    """Errors allowed in forces, N, and in what the camera sees, px."""

    force_n: float
    image_px: float


def scale(circumstances: Circumstances) -> Tolerance:
    """Force and depth that relative errors refer to.

    The force is that which a probe solved, or else the estimate itself, not the upper bound of it
    that the effects use. Raises BudgetError where nothing touches the gel.
    """
    force_n = circumstances.normal_n
    depth_px = circumstances.contact.depth_mm * circumstances.sensor.px_per_mm
    if not (force_n > 0 and depth_px > 0):
        raise BudgetError(
            "error as a share: nothing touches the gel in this scene, so there is nothing to err "
            "by; give a tolerance in N and px in the scene"
        )
    return Tolerance(force_n, depth_px)


def tolerance_at(question: Question, error: float) -> Tolerance:
    """The tolerance of a relative error."""
    whole = scale(question.circumstances)
    return Tolerance(error * whole.force_n, error * whole.image_px)


def tolerance_ladder(
    question: Question, error: float | None = None, paces: Mapping[str, float] | None = None
) -> tuple[Ladder, dict[str, Tolerance]]:
    """Rungs at the default tolerances and at `error`, and the tolerance of each by name.

    `paces` are ratios of measured to declared times, by group (`pace_group`).
    Raises BudgetError where nothing touches the gel, PlanError as `make_plan`.
    """
    tolerances, rungs = dict[str, Tolerance](), []
    for level in sorted({*LEVELS, *((*FINER, error) if error is not None else ())}):
        allowed = tolerance_at(question, level)
        plan = make_plan(replace(question, force_n=allowed.force_n, image_px=allowed.image_px))
        name = f"tolerance of {shown_share(level)}"
        tolerances[name] = allowed
        rungs.append(
            Rung(name, plan_error(question, plan), plan_ms(plan, paces or {}), plan.predicted_ms)
        )
    return Ladder(tuple(rungs), WORDING), tolerances


def choose_tolerance(
    question: Question, budget: Budget, paces: Mapping[str, float] | None = None
) -> tuple[Choice, Tolerance]:
    """The tolerance that keeps a budget of relative error and time per pose.

    Effects that the scene switches off are not counted as errors.
    Raises BudgetError where no plan keeps the budget.
    """
    ladder, tolerances = tolerance_ladder(question, budget.error, paces)
    choice = ladder.choose(budget)
    remarks = (*choice.remarks, *_outside(question.circumstances))
    return replace(choice, remarks=remarks), tolerances[choice.rung.name]


def plan_error(question: Question, plan: Plan) -> float:
    """Largest relative error of anything observed, effects switched off by the scene left out."""
    whole = scale(question.circumstances)
    size = {"n": whole.force_n, "px": whole.image_px}
    counted = [c for c in plan.choices if dict(c.shares) and not _switched_off(question, c.effect)]
    return max(summed_error(counted, o) / size[unit_of(o)] for o in question.observe)


def plan_ms(plan: Plan, paces: Mapping[str, float]) -> float:
    """Time of a pose in ms with the paces of a machine."""
    return sum(c.predicted_ms * paces.get(pace_group(c.effect), 1.0) for c in plan.included)


def pace_group(effect: str) -> str:
    """Which part of a simulation an effect's time is measured with."""
    if effect == "nonlinearity":
        return LARGE_STRAIN
    return GEL if effect in ("normal_contact", "friction", "skin", "relaxation") else PICTURE


def _switched_off(question: Question, effect: str) -> bool:
    return question.circumstances.parameters[effect].use == "off"


def _outside(circumstances: Circumstances) -> tuple[str, ...]:
    if circumstances.probed is not None:
        return ()
    low, high = FITTED_RADII
    ratio = circumstances.contact.radius_mm / circumstances.sensor.thickness_mm
    if low <= ratio <= high:
        return ()
    return (
        f"the contact's radius is {ratio:.2g} times the gel's thickness, outside the calibrated "
        f"range {low:g} to {high:g} of the estimate of its force",
    )
