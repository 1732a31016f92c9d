"""The choice among measured surface operators, on made-up ladders."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gelslim_core.budget.budget import Budget, BudgetError
from ifem_export.errors import IfemError
from ifem_export.operators.operator_ladder import (
    CONTACTS,
    ContactError,
    MeasuredRung,
    OperatorLadder,
    chosen_rung,
)


def rung(
    name: str, error: float, n_bytes: int, edge: float | None = None, resultant: float = 0.0012344
) -> MeasuredRung:
    gains = (12.3456, 1.0)
    return MeasuredRung(
        "pcg", {name: 1}, error, 0.1234567, resultant, *gains, 2.5, n_bytes, edge
    )  # fmt: skip


def made(*rungs: MeasuredRung) -> OperatorLadder:
    return OperatorLadder(rungs, "made up", 4, "bbar", 0.3)


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ((0.2, 0.03, 0.01), "b"),
        ((0.2, 0.031, 0.01), "c"),
        ((0.2, 0.109, 0.1), "b"),
        ((0.2, 0.111, 0.1), "c"),
        ((0.02, 0.01, 0.001), "a"),
    ],
)
def test_the_default_has_the_least_work_among_small_errors(
    errors: tuple[float, ...], expected: str
) -> None:
    names = zip("abc", errors, (10, 20, 30), strict=True)
    rungs = [rung(*entry) for entry in names]
    assert made(*rungs[::-1]).balanced().label == f"pcg ({expected} 1)"


def test_a_budget_is_about_the_resultant_too() -> None:
    """A rung whose field is right and whose resultant is not is no small error."""
    rungs = (rung("a", 0.02, 10, resultant=0.2), rung("b", 0.025, 20), rung("c", 0.01, 30))
    ladder = made(*rungs)
    assert ladder.rungs[0].error == 0.2
    assert ladder.balanced().label == "pcg (b 1)"
    assert ladder.choose(Budget(0.03)).rung.name == "pcg (b 1)"
    assert ladder.choose(Budget(0.3)).rung.name == "pcg (a 1)"


def test_a_budget_is_about_the_worst_motion() -> None:
    """A rung that is right for smooth motions and wrong at the edge or under a punch is refused."""
    punch = {name: ContactError(0.02, 0.01) for name in CONTACTS}
    rungs = (
        replace(rung("a", 0.02, 10, 0.15), contacts=punch),
        replace(rung("b", 0.02, 20, 0.04), contacts=punch | {"sharp_punch": ContactError(0.2, 0)}),
        replace(rung("c", 0.02, 30, 0.04), contacts=punch | {"edge": ContactError(0.03, 0.1)}),
        replace(rung("d", 0.02, 40, 0.04), contacts=punch),
    )
    ladder = made(*rungs)
    assert [r.error for r in rungs] == [0.15, 0.2, 0.1, 0.04]
    assert rungs[2].errors["edge"] == rungs[2].worst_resultant == 0.1
    for error, name in ((0.2, "a"), (0.15, "a"), (0.14, "c"), (0.09, "d"), (0.04, "d")):
        choice = ladder.choose(Budget(error))
        assert choice.rung.name == f"pcg ({name} 1)"
        assert choice.remarks == ()
    with pytest.raises(BudgetError) as caught:
        ladder.choose(Budget(0.03))
    assert "4 % under a contact at the edge and 2 % for smooth motions" in str(caught.value)
    with pytest.raises(BudgetError) as caught:
        ladder.choose(Budget(0.01))
    assert "smooth motions" not in str(caught.value)


def test_a_ladder_without_contacts_is_chosen_from_and_told() -> None:
    old = made(rung("a", 0.02, 10, 0.15), rung("b", 0.02, 20, 0.04))
    choice = old.choose(Budget(0.05))
    assert choice.rung.name == "pcg (b 1)"
    assert len(choice.remarks) == 1
    assert made(rung("a", 0.02, 10)).choose(Budget(0.05)).rung.name == "pcg (a 1)"


def test_a_budget_chooses_and_a_name_finds() -> None:
    ladder = made(rung("a", 0.2, 10), rung("b", 0.01, 20))
    assert chosen_rung(None, "pcg (a 1)") is None
    assert chosen_rung(ladder, "pcg (c 1)") is None
    assert chosen_rung(ladder, "pcg (a 1)") == ladder.rungs[0]
    assert chosen_rung(ladder, "pcg (a 1)", Budget()) == ladder.rungs[0]
    assert chosen_rung(ladder, "pcg (a 1)", Budget(0.02)) == ladder.rungs[1]
    with pytest.raises(IfemError) as caught:
        chosen_rung(None, "pcg (a 1)", Budget(0.02))
    assert caught.value.field == "ladder"


def test_an_untimed_ladder_is_rounded() -> None:
    found = made(rung("a", 0.12345678, 10)).untimed().rungs[0]
    assert (found.error_field, found.error_operator, found.error_edge) == (0.123457, 0.123457, None)
    assert (found.noise_node_n_per_mm, found.milliseconds) == (12.35, None)
    again = made(rung("a", 0.1, 10), rung("b", 0.1, 20)).timed({"pcg (b 1)": 9.0})
    assert [r.time_ms for r in again.rungs] == [2.5, 9.0]
