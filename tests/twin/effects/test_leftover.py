"""What is left of a tolerance, and exchanges of it, against every combination of choices."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace

import pytest

from gelslim_twin.effects.effect import Bound
from gelslim_twin.planning.leftover import LEAST_SAVING, with_leftover_spent
from gelslim_twin.planning.plan import Choice, summed_error

Choices = dict[str, Choice]


def choice(effect: str, px: float, ms: float, scattered: bool = False) -> Choice:
    """One that errs by `px` in the picture and takes `ms`; without time it is left out."""
    error = Bound(image_px=px)
    shares = (("image", 0.0),)
    return Choice(effect, ms > 0, "", error, shares, error, predicted_ms=ms, is_scattered=scattered)


def whole_ms(found: Choices) -> float:
    return sum(c.predicted_ms for c in found.values())


def test_a_finer_contact_leaves_room_for_a_correction_less() -> None:
    contact = [choice("contact", 0.04, 1.5), choice("contact", 0.01, 2.1)]
    strain = [choice("strain", 0.05, 44.0), choice("strain", 0.08, 36.0)]
    decided = {"contact": contact[0], "strain": strain[0]}
    others = {"contact": contact, "strain": strain}
    found = with_leftover_spent(decided, others, {"image": 0.1})
    assert {c.effect: c.predicted_ms for c in found.values()} == {"contact": 2.1, "strain": 36.0}
    alone = with_leftover_spent(decided, others, {"image": 0.1}, exchanges=False)
    assert alone == decided


@pytest.mark.parametrize("seed", range(40))
def test_no_pair_of_choices_saves_more_and_the_tolerance_is_kept(seed: int) -> None:
    """Effects of both kinds with one to four rungs; some start above the tolerance."""
    r = random.Random(seed)
    others: dict[str, list[Choice]] = {}
    for k in range(5):
        name, scattered = f"effect {k}", r.random() < 0.5
        rungs = sorted((r.uniform(0, 0.05) for _ in range(r.randint(1, 4))), reverse=True)
        others[name] = [
            choice(name, px, r.uniform(0.5, 1.0) * (n + 1) ** 2, scattered)
            for n, px in enumerate(rungs)
        ]
        others[name].append(choice(name, r.uniform(0.02, 0.2), 0.0, scattered))
    decided = {name: r.choice(some[:-1]) for name, some in others.items()}
    before = summed_error(decided.values(), "image")
    allowed = r.uniform(0.9, 2.0) * before
    found = with_leftover_spent(decided, others, {"image": allowed})
    assert whole_ms(found) <= whole_ms(decided)
    if before <= allowed:
        assert summed_error(found.values(), "image") <= allowed * (1 + 1e-9)
    else:
        assert found == decided or summed_error(found.values(), "image") <= allowed * (1 + 1e-9)
    least_ms = LEAST_SAVING * whole_ms(found)
    for one, other in itertools.combinations(others, 2):
        for a, b in itertools.product(others[one], others[other]):
            changed = {**found, one: a, other: b}
            saved_ms = whole_ms(found) - whole_ms(changed)
            if saved_ms > least_ms * (1 + 1e-9):
                assert summed_error(changed.values(), "image") > allowed
    assert all(replace(found[n], shares=()) in [replace(c, shares=()) for c in others[n]]
               for n in others)  # fmt: skip
