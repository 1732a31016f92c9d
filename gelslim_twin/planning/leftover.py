"""What effects leave of their shares of the tolerance, given to those that save time by it.

Equal shares are safe and wasteful, because most effects err by much less than their share. Where
their combined error allows it, an effect takes a cheaper rung or is left out after all, the
largest saving of time first. An effect that takes hardly any time is left out last, since what is
not needed is not kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from gelslim_twin.planning.plan import Choice, summed_error

LEAST_SAVING = 0.01
"""Smallest saving, over the time of the plan, for which an effect takes a cheaper rung."""
ROUNDING = 1 + 1e-12


def with_leftover_spent(
    decided: Mapping[str, Choice],
    cheaper: Mapping[str, Sequence[Choice]],
    allowed: Mapping[str, float],
) -> dict[str, Choice]:
    """Choices in which no single further saving keeps the tolerance.

    Args:
        decided: A choice by effect, with errors within the tolerance or not.
        cheaper: By effect, the other choices about it; effects that have none may be absent.
        allowed: By observable, the largest combined error of all `decided` effects.

    Returns:
        The choices, of which some are replaced by one of `cheaper` that takes less time. No
        combined error is above what is allowed, unless it was so before.
    """
    found = dict(decided)
    while True:
        whole_ms = sum(choice.predicted_ms for choice in found.values())
        best, best_ms = None, 0.0
        for name, others in cheaper.items():
            now = found[name]
            for other in others:
                saved_ms = now.predicted_ms - other.predicted_ms
                least_ms = LEAST_SAVING * whole_ms if other.included else 0.0
                if saved_ms > max(best_ms, least_ms) and _fits({**found, name: other}, allowed):
                    best, best_ms = other, saved_ms
        if best is None:
            return found
        shares = tuple((o, max(share, best.error.of(o))) for o, share in best.shares)
        found[best.effect] = replace(best, shares=shares)


def _fits(choices: Mapping[str, Choice], allowed: Mapping[str, float]) -> bool:
    # What was chosen to fill the tolerance may exceed it by rounding.
    return all(summed_error(choices.values(), o) <= most * ROUNDING for o, most in allowed.items())
