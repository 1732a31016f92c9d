"""What effects leave of their shares of the tolerance, given to those that save time by it.

Equal shares are safe and wasteful, because most effects err by much less than their share. Where
their combined error allows it, an effect takes a cheaper rung or is left out after all, the
largest saving of time first. An effect that takes hardly any time is left out last, since what is
not needed is not kept. Then two effects exchange tolerance: one is simulated more finely, so that
another may err by more and saves more time than that takes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from gelslim_twin.planning.plan import Choice, summed_error

LEAST_SAVING = 0.01
"""Smallest saving, over the time of the plan, for which an effect takes a cheaper rung."""
ROUNDING = 1 + 1e-12
NEARLY = 1 + 1e-9


def with_leftover_spent(
    decided: Mapping[str, Choice],
    others: Mapping[str, Sequence[Choice]],
    allowed: Mapping[str, float],
    exchanges: bool = True,
) -> dict[str, Choice]:
    """Choices in which no further saving and no exchange of two keeps the tolerance.

    Args:
        decided: A choice by effect, with errors within the tolerance or not.
        others: By effect, the other choices about it; effects that have none may be absent.
        allowed: By observable, the largest combined error of all `decided` effects.
        exchanges: Whether effects may exchange tolerance, and not only take what is left.

    Returns:
        The choices, of which some are replaced by one of `others`, so that all together take less
        time. No combined error is above what is allowed, unless it was so before.
    """
    found = dict(decided)
    while changed := (
        _saving(found, others, allowed) or (exchanges and _exchange(found, others, allowed)) or ()
    ):
        for choice in changed:
            shares = tuple((o, max(share, choice.error.of(o))) for o, share in choice.shares)
            found[choice.effect] = replace(choice, shares=shares)
    return found


def _whole_ms(found: Mapping[str, Choice]) -> float:
    return sum(choice.predicted_ms for choice in found.values())


def _saving(
    found: Mapping[str, Choice],
    others: Mapping[str, Sequence[Choice]],
    allowed: Mapping[str, float],
) -> tuple[Choice, ...]:
    """The choice that saves most time; empty where none keeps the tolerance."""
    whole_ms, best_ms = _whole_ms(found), 0.0
    best: tuple[Choice, ...] = ()
    sums = {o: _sums(found.values(), o) for o in allowed}
    for name, choices in others.items():
        for other in choices:
            saved_ms = found[name].predicted_ms - other.predicted_ms
            least_ms = LEAST_SAVING * whole_ms if other.included else 0.0
            if (
                saved_ms > max(best_ms, least_ms)
                and _may_fit(sums, found, (other,), allowed)
                and _fits({**found, name: other}, allowed)
            ):
                best, best_ms = (other,), saved_ms
    return best


def _exchange(
    found: Mapping[str, Choice],
    others: Mapping[str, Sequence[Choice]],
    allowed: Mapping[str, float],
) -> tuple[Choice, ...]:
    """A dearer choice and a cheaper one that save most time together; empty where none do."""
    by_ms = sorted(
        ((c.predicted_ms - found[name].predicted_ms, c) for name in others for c in others[name]),
        key=lambda pair: pair[0],
    )
    cheaper = [(-ms, choice) for ms, choice in by_ms if ms < 0]
    dearer = [(ms, choice) for ms, choice in by_ms if ms > 0]
    best: tuple[Choice, ...] = ()
    best_ms = LEAST_SAVING * _whole_ms(found)
    sums = {o: _sums(found.values(), o) for o in allowed}
    for saved_ms, cheap in cheaper:
        for more_ms, dear in dearer:
            if saved_ms - more_ms <= best_ms:
                break
            pair = (dear, cheap)
            if dear.effect != cheap.effect and _may_fit(sums, found, pair, allowed):
                changed = {**found, dear.effect: dear, cheap.effect: cheap}
                if _fits(changed, allowed):
                    best, best_ms = pair, saved_ms - more_ms
                    break
    return best


def _fits(choices: Mapping[str, Choice], allowed: Mapping[str, float]) -> bool:
    # What was chosen to fill the tolerance may exceed it by rounding.
    return all(summed_error(choices.values(), o) <= most * ROUNDING for o, most in allowed.items())


def _sums(choices: Iterable[Choice], observable: str) -> tuple[float, float]:
    """The sum of steady errors, and that of the squares of scattered ones."""
    sums = [0.0, 0.0]
    for choice in choices:
        if choice.shares:
            sums[choice.is_scattered] += _counted(choice, observable)
    return sums[0], sums[1]


def _counted(choice: Choice, observable: str) -> float:
    error = choice.error.of(observable)
    return error * error if choice.is_scattered else error


def _may_fit(
    sums: Mapping[str, tuple[float, float]],
    found: Mapping[str, Choice],
    changed: Sequence[Choice],
    allowed: Mapping[str, float],
) -> bool:
    """Whether choices fit but for rounding, from the sums before: there are many pairs."""
    for o, most in allowed.items():
        now = [*sums[o]]
        for choice in changed:
            now[choice.is_scattered] += _counted(choice, o) - _counted(found[choice.effect], o)
        if now[0] > most * NEARLY or now[0] ** 2 + now[1] > (most * NEARLY) ** 2:
            return False
    return True
