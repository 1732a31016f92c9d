"""The options `--error` and `--time` that several commands take, and this machine's times."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gelslim_core.budget.budget import Budget
    from gelslim_core.budget.ladder import Choice
    from gelslim_twin.scene.reader import LoadedScene
    from ifem_export.bundle.bundle import Bundle


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
    from gelslim.cli.failure import CommandError
    from gelslim_core.budget.budget import Budget, BudgetError

    try:
        return Budget.parse(error, time)
    except BudgetError as wrong:
        raise CommandError(f"--{wrong}") from wrong


def on_this_machine(bundle: Bundle) -> Bundle:
    """The bundle with its ladder's times as `gelslim bench` measured them here, if it did.

    Errors and operators stay as they are: only a budget of time can see the difference.
    """
    from dataclasses import replace

    from gelslim_core.budget.machine_times import read_times

    if bundle.ladder is None:
        return bundle
    return replace(bundle, ladder=bundle.ladder.timed(read_times(bundle.times_key)))


def note_choice(choice: Choice, budget: Budget, calibrated: bool, bench: str) -> None:
    """Say on standard error what lies outside the calibration of the rung chosen.

    `calibrated` tells whether the times were measured on this machine; else `bench` is the command
    that does.
    """
    remarks = list(choice.remarks)
    if budget.time_ms is not None and not calibrated:
        remarks.append(f"times are not this machine's; `{bench}` measures them here")
    for remark in remarks:
        print(f"gelslim: {remark}", file=sys.stderr)


def keep_times(ladder_key: str, times_ms: Mapping[str, float]) -> None:
    """Keep times of this machine for the next command; where they cannot be kept, go on."""
    from gelslim_core.budget.machine_times import write_times

    with suppress(OSError):
        write_times(ladder_key, times_ms)


SceneError = Annotated[
    str | None,
    typer.Option(
        "--error",
        help="Error allowed, as 3%: of the deepest contact's force and, in pictures, of its depth. "
        "Replaces the scene's tolerance.",
    ),
]
PoseTime = Annotated[
    str | None,
    typer.Option(
        "--time",
        "--time-ms",
        help="Time that a pose may take as planned, as 50ms or 1s; a bare number is ms.",
    ),
]


def budgeted_scene(loaded: LoadedScene, error: str | None, time: str | None) -> LoadedScene:
    """The scene with the tolerance that a budget asks for; as it is without one.

    Raises CommandError for words that are no budget, BudgetError where no plan keeps it.
    """
    from gelslim.cli.budget import budget_of, note_choice
    from gelslim.contacts import with_budget

    budget = budget_of(error, time)
    found, made = with_budget(loaded, budget)
    if made is not None:
        choice, calibrated = made
        note_choice(choice, budget, calibrated, "gelslim bench SPEC")
    return found
