"""A budget for a contact scene: the tolerance that it comes to, from the plans it could have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gelslim_twin.scene.reader import LoadedScene

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
