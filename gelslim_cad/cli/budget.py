"""The options `--error` and `--time` that several commands take, and this machine's times."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from accuracy_budget.budget import Budget
    from accuracy_budget.ladder import Choice
    from ifem_export.bundle import Bundle

FieldError = Annotated[
    str | None,
    typer.Option("--error", help="Error of the force field that is allowed, as 3% or 0.03."),
]
FrameTime = Annotated[
    str | None,
    typer.Option(
        "--time",
        "--time-ms",
        help="Time that the operator may take per frame, as 2ms or 1s; a bare number is ms.",
    ),
]


def budget_of(error: str | None, time: str | None) -> Budget:
    """The budget of both options. Raises CommandError for words that are no error or time."""
    from accuracy_budget.budget import Budget
    from accuracy_budget.errors import BudgetError
    from gelslim_cad.cli.failure import CommandError

    try:
        return Budget.parse(error, time)
    except BudgetError as wrong:
        raise CommandError(f"--{wrong}") from wrong


def on_this_machine(bundle: Bundle) -> Bundle:
    """The bundle with its ladder's times as `gelslim bench` measured them here, if it did.

    Errors and operators stay as they are: only a budget of time can see the difference.
    """
    from dataclasses import replace

    from accuracy_budget.machine_times import read_times

    if bundle.ladder is None:
        return bundle
    return replace(bundle, ladder=bundle.ladder.timed(read_times(bundle.times_key)))


def note_choice(choice: Choice, budget: Budget, times_key: str, bench: str) -> None:
    """Say on standard error what lies outside the calibration of the rung chosen.

    `bench` is the command that would measure the times of `times_key` on this machine.
    """
    from accuracy_budget.machine_times import read_times

    remarks = list(choice.remarks)
    if budget.time_ms is not None and not read_times(times_key):
        remarks.append(f"times are not this machine's; `{bench}` measures them here")
    for remark in remarks:
        print(f"gelslim: {remark}", file=sys.stderr)
