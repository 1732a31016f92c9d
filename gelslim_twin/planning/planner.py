"""The planner: which effects a scene needs, found by going back from what it observes."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from gelslim_core.errors import GelslimError
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import GIVEN, Bound, Effect, Rung, unit_of
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.leftover import ROUNDING, with_leftover_spent
from gelslim_twin.planning.order import ordered
from gelslim_twin.planning.plan import Choice, Plan, summed_error


class PlanError(GelslimError, ValueError):
    """A scene cannot be planned.

    Attributes:
        effect: The effect that must not be switched off; empty where there is none.
        message: What is wrong.
        remedy: What to change.
    """

    def __init__(self, effect: str, message: str, remedy: str) -> None:
        super().__init__(f"{message}; {remedy}")
        self.effect = effect
        self.message = message
        self.remedy = remedy


@dataclass(frozen=True)
class Question:
    """Input of the planner: observables, tolerances in N and px, and the circumstances."""

    name: str
    observe: tuple[str, ...]
    force_n: float
    image_px: float
    circumstances: Circumstances
    left_out: frozenset[str] = frozenset()
    """Effects that are left out together, each of which has its part of their common size."""
    _kept: dict[str, tuple[Bound, tuple[Rung, ...]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    """Bounds and ladders by effect, since the planner needs them in every iteration."""
    _plans: list[Plan] = field(default_factory=list, init=False, repr=False, compare=False)
    """The plan with all effects, once it was made."""

    def weighed(self, effect: Effect) -> tuple[Bound, tuple[Rung, ...]]:
        """The size of an effect (zero where its parameters do nothing) and its ladder."""
        if effect.name not in self._kept:
            c = self.circumstances
            bound = effect.size(c)
            bound = Bound() if effect.is_null(c, bound) else bound
            self._kept[effect.name] = bound, tuple(effect.ladder(c))
        return self._kept[effect.name]

    def tolerance(self, observable: str) -> float:
        """Of one observable, in its unit."""
        return self.force_n if unit_of(observable) == "n" else self.image_px

    def use(self, effect: Effect) -> str:
        """`auto`, `on` or `off`."""
        return self.circumstances.parameters[effect.name].use

    def with_together(self) -> Question | None:
        """The question with the effects left out that a probe left out together, if any."""
        found = self.circumstances.probed
        if found is None or not found.together:
            return None
        one = replace(found, sizes={**found.sizes, **found.together}, together={})
        here = replace(self.circumstances, probed=one)
        return replace(self, circumstances=here, left_out=frozenset(found.together))


def make_plan(question: Question, effects: Sequence[Effect] = EFFECTS) -> Plan:
    """Decide for each effect whether it is simulated, and choose its cheapest sufficient rung.

    For each observable the tolerance is shared evenly among the effects that can use it up. An
    effect left out contributes its bound, a simulated one the error of its rung, and neither may
    exceed a share, so that the errors combined (`effect.combined`) keep the tolerance. What is left
    of the tolerance then goes to the effects that save most time by it. Exceptions are effects that
    the scene switches off and effects whose best rung errs more; `Plan.over_tolerance` lists them.

    Effects that a probe left out together are left out where that keeps the tolerance and takes no
    longer than deciding about each of them.

    Raises:
        PlanError: The only provider of something needed is switched off.
    """
    if effects is not EFFECTS:
        return _made(question, effects)
    if not question._plans:
        question._plans.append(_made(question, effects))
    return question._plans[0]


def _made(question: Question, effects: Sequence[Effect]) -> Plan:
    one_by_one, jointly = _plan(question, effects), question.with_together()
    if jointly is None:
        return one_by_one
    together = _plan(jointly, effects)
    over = _exceeded(question, together) - _exceeded(question, one_by_one)
    return one_by_one if over or together.predicted_ms > one_by_one.predicted_ms else together


def are_left_out(question: Question, effects: Sequence[Effect] = EFFECTS) -> bool:
    """Whether the effects that a probe left out together may be left out within the tolerance.

    Whether that saves time is decided by `make_plan`. Raises as that.
    """
    jointly = question.with_together()
    return jointly is not None and not _exceeded(jointly, _plan(jointly, effects))


def with_effects(
    question: Question, plan: Plan, names: Collection[str], effects: Sequence[Effect] = EFFECTS
) -> Plan:
    """A plan with effects that it leaves out, by their cheapest sufficient rungs."""
    choices = {c.effect: c for c in plan.choices}
    for effect in effects:
        if effect.name in names:
            shares, ladder = dict(choices[effect.name].shares), question.weighed(effect)[1]
            choices[effect.name] = _choice(question, effect, "drawn by a probe", shares, ladder)
    order = ordered([e for e in effects if choices[e.name].included])
    return replace(plan, choices=tuple(choices.values()), order=tuple(e.name for e in order))


def _exceeded(question: Question, plan: Plan) -> set[str]:
    """Observables whose tolerance is exceeded by effects that the scene does not switch off."""
    parameters = question.circumstances.parameters
    counted = [c for c in plan.choices if parameters[c.effect].use != "off"]
    return {
        o for o in question.observe if summed_error(counted, o) > question.tolerance(o) * ROUNDING
    }


def _plan(question: Question, effects: Sequence[Effect]) -> Plan:
    decided: dict[str, Choice] = {}
    needed = frozenset(question.observe)
    while True:
        needed = _closure(question, effects, needed, decided)
        relevant = [e for e in effects if needed & {*e.provides, *e.refines}]
        shares = _shares(question, relevant)
        equal = {e.name: _decide(question, e, e in relevant, shares) for e in effects}
        decided = _with_leftover_spent(question, relevant, shares, equal)
        wanted = needed.union(*(e.needs for e in effects if decided[e.name].included)) - GIVEN
        if wanted == needed:
            break
        needed = wanted
    order, c = ordered([e for e in effects if decided[e.name].included]), question.circumstances
    return Plan(
        question.name,
        question.observe,
        question.force_n,
        question.image_px,
        tuple(decided[e.name] for e in effects),
        tuple(e.name for e in order),
        c.motion.poses,
        0.0 if c.probed is None else c.probed.milliseconds,
    )


def _closure(
    question: Question,
    effects: Sequence[Effect],
    needed: frozenset[str],
    decided: dict[str, Choice],
) -> frozenset[str]:
    """`needed` and everything that its providers need, directly or indirectly."""
    todo, found = sorted(needed), set(needed)
    while todo:
        datum = todo.pop()
        provider = _provider(question, effects, datum)
        new = set(provider.needs) - GIVEN - found
        found |= new
        todo += sorted(new)
    return frozenset(found)


def _provider(question: Question, effects: Sequence[Effect], datum: str) -> Effect:
    able = [e for e in effects if datum in e.provides]
    left = [e for e in able if question.use(e) != "off"]
    if left:
        return left[0]
    if not able:
        raise PlanError("", f"no effect provides {datum}", "observe something else")
    name, seen = able[0].name, ", ".join(question.observe)
    raise PlanError(
        name,
        f"switched off, but it alone provides the {datum} that observing {seen} needs",
        f"write `{name}: auto`, or observe less",
    )


def _shares(question: Question, relevant: Sequence[Effect]) -> dict[str, float]:
    """Per observable, the equal share of each of the effects that can use up some tolerance.

    What effects that are left out together cost is taken off before.
    """
    lost = [question.weighed(e)[0] for e in relevant if e.name in question.left_out]
    others = [e for e in relevant if e.name not in question.left_out]
    found = {}
    for o in question.observe:
        able = [e.is_scattered for e in others if _may_cost(question, e, o)]
        gone = math.hypot(*(size.of(o) for size in lost))
        found[o] = _equal_share(question.tolerance(o), gone, len(able) - sum(able), sum(able))
    return found


def _equal_share(tolerance: float, gone: float, steady: int, scattered: int) -> float:
    """The share s of each effect where as many shares use up the tolerance.

    `gone` is what scattered effects use up already: (steady s)² + scattered s² + gone² is the
    square of the tolerance (`combined`).
    """
    if gone >= tolerance:
        return 0.0
    left = tolerance if gone == 0 else math.sqrt((tolerance - gone) * (tolerance + gone))
    return left / math.sqrt(max(1, steady**2 + scattered))


def _may_cost(question: Question, effect: Effect, observable: str) -> bool:
    """Whether an effect may cause an error, by being left out or by an inexact rung.

    An effect that must be simulated and has exact rungs only causes none.
    """
    size, ladder = question.weighed(effect)
    lost = size.of(observable)
    if lost <= 0:
        return False
    if not effect.provides and lost <= question.tolerance(observable):
        return True
    return any(r.error.of(observable) > 0 for r in ladder)


def _decide(question: Question, effect: Effect, relevant: bool, shares: dict[str, float]) -> Choice:
    c, use = question.circumstances, question.use(effect)
    size, ladder = question.weighed(effect)
    if not relevant:
        return _choice(question, effect, "not observed", {})
    if use == "off":
        return _choice(question, effect, "switched off", shares)
    if use == "on":
        return _choice(question, effect, "switched on", shares, ladder)
    if effect.provides:
        made = ", ".join(effect.provides)
        return _choice(question, effect, f"provides {made}", shares, ladder)
    if effect.is_null(c, size):
        return _choice(question, effect, "parameters nil", shares)
    if effect.name in question.left_out:
        own = {o: size.of(o) for o in shares}
        return _choice(question, effect, "small with others", own)
    if all(size.of(observable) <= share for observable, share in shares.items()):
        return _choice(question, effect, "below its share", shares)
    worst = max(shares, key=lambda o: _excess(size.of(o), shares[o]))
    return _choice(question, effect, f"matters to {worst}", shares, ladder)


def _with_leftover_spent(
    question: Question,
    relevant: Sequence[Effect],
    shares: dict[str, float],
    decided: dict[str, Choice],
) -> dict[str, Choice]:
    """The decisions with what is left of the tolerance spent on savings of time."""
    others, counted = {}, dict(decided)
    allowed = {o: question.tolerance(o) for o in question.observe}
    for effect in relevant:
        choice, use = decided[effect.name], question.use(effect)
        if use == "off":
            # What a scene switches off may err by more than all others together.
            within = choice.error.at_most(Bound.by_observable(shares))
            counted[effect.name] = replace(choice, error=within)
        has_room = use == "auto" and choice.saved_ms > 0 and effect.name not in question.left_out
        if not (choice.included or has_room):
            continue
        _, ladder = question.weighed(effect)
        why = choice.why if choice.included else "saves more elsewhere"
        others[effect.name] = [_choice(question, effect, why, shares, (r,)) for r in ladder]
        if use == "auto" and not effect.provides:
            absent = _choice(question, effect, "within what others leave", shares)
            others[effect.name].append(absent)
    # What is probed follows from a plan by bounds, in which each effect has its own share.
    is_known = question.circumstances.probed is not None
    found = with_leftover_spent(counted, others, allowed, exchanges=is_known)
    return {name: found[name] if name in others else choice for name, choice in decided.items()}


def _excess(error: float, share: float) -> float:
    return error / share if share > 0 else (float("inf") if error > 0 else 0.0)


def _choice(
    question: Question,
    effect: Effect,
    why: str,
    shares: dict[str, float],
    ladder: Sequence[Rung] | None = None,
) -> Choice:
    """Simulate an effect by a rung of `ladder`, or leave it out where there is no ladder."""
    size, every = question.weighed(effect)
    known: dict[str, Any] = {
        "effect": effect.name,
        "why": why,
        "size": size,
        "shares": tuple(shares.items()),
        "probed": effect.was_probed(question.circumstances),
        "formula": effect.formula,
        "is_scattered": effect.is_scattered,
    }
    if ladder is None:
        saved_ms = _rung(every, shares).milliseconds if size != Bound() else 0.0
        return Choice(**known, included=False, error=size, saved_ms=saved_ms)
    rung = _rung(ladder, shares)
    return Choice(
        **known,
        included=True,
        error=rung.error,
        rung=rung.name,
        rung_parameters=tuple(sorted(rung.parameters.items())),
        predicted_ms=rung.milliseconds,
        implementation=rung.implementation or effect.implementation,
    )


def _rung(ladder: Sequence[Rung], shares: dict[str, float]) -> Rung:
    """The cheapest rung within the shares, or else the one that exceeds them least."""
    if len(ladder) == 1:
        return ladder[0]
    errors = [
        max((_excess(r.error.of(o), s) for o, s in shares.items()), default=0.0) for r in ladder
    ]
    able = [k for k, error in enumerate(errors) if error <= 1.0]
    if able:
        return ladder[min(able, key=lambda k: ladder[k].milliseconds)]
    totals = [sum(r.error.of(o) for o in shares) for r in ladder]
    return ladder[min(range(len(ladder)), key=lambda k: (errors[k], totals[k]))]
