"""The options `--error` and `--time` of several commands, and the times of this machine."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.failure import CommandError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gelslim_core.budget.budget import Budget
    from gelslim_core.budget.ladder import Choice
    from gelslim_twin.scene.reader import LoadedScene
    from ifem_export.bundle.bundle import Bundle


FieldError = Annotated[
    str | None,
    typer.Option("--error", help="Largest error of the forces of any contact, as 15% or 0.15."),
]
FrameTime = Annotated[
    str | None,
    typer.Option(
        "--time",
        "--time-ms",
        help="Largest time of the operator per frame, such as 2ms or 1s; a bare number is in ms.",
    ),
]


def budget_of(error: str | None, time: str | None) -> Budget:
    """Return the budget of both options. Raises CommandError if one of them cannot be read."""
    from gelslim_core.budget.budget import Budget, BudgetError

    try:
        return Budget.parse(error, time)
    except BudgetError as wrong:
        raise CommandError(f"--{wrong}") from wrong


def on_this_machine(bundle: Bundle) -> Bundle:
    """Return the bundle with the times that `gelslim bench` measured on this machine, if any.

    Errors and operators do not change, so only a budget of time can give another result.
    """
    from dataclasses import replace

    from gelslim_core.budget.machine_times import read_times

    if bundle.ladder is None:
        return bundle
    return replace(bundle, ladder=bundle.ladder.timed(read_times(bundle.times_key)))


def note_choice(choice: Choice, budget: Budget, calibrated: bool, bench: str) -> None:
    """Print on standard error what lies outside the measured range of the chosen rung.

    `calibrated` says whether the times were measured on this machine; if not, `bench` is the
    command that measures them.
    """
    remarks = list(choice.remarks)
    if budget.time_ms is not None and not calibrated:
        remarks.append(f"the times are not those of this machine; `{bench}` measures them")
    for remark in remarks:
        print(f"gelslim: {remark}", file=sys.stderr)


def keep_times(ladder_key: str, times_ms: Mapping[str, float]) -> None:
    """Keep times of this machine for the next command. Continue if they cannot be kept."""
    from gelslim_core.budget.machine_times import write_times

    with suppress(OSError):
        write_times(ladder_key, times_ms)


SceneError = Annotated[
    str | None,
    typer.Option(
        "--error",
        help="Largest error, such as 3%, of the force of the deepest contact and, in pictures, of "
        "its depth. It replaces the tolerance of the scene.",
    ),
]
PoseTime = Annotated[
    str | None,
    typer.Option(
        "--time",
        "--time-ms",
        help="Largest planned time of a pose, such as 50ms or 1s; a bare number is in ms.",
    ),
]


def budgeted_scene(loaded: LoadedScene, error: str | None, time: str | None) -> LoadedScene:
    """Return the scene with the tolerance of a budget, unchanged without one.

    Raises CommandError if an option cannot be read, BudgetError if no plan keeps the budget.
    """
    from gelslim.contacts import with_budget

    budget = budget_of(error, time)
    found, made = with_budget(loaded, budget)
    if made is not None:
        choice, calibrated = made
        note_choice(choice, budget, calibrated, "gelslim bench SPEC")
    return found
