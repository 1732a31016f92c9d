"""A budget for a contact scene: the tolerance that it comes to, from the plans it could have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gelslim_twin.effects.circumstances import SensorFigures
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
    from gelslim.scene_sensor import sensor_figures
    from gelslim_twin.scene.question import question
    from gelslim_twin.tolerance_ladder import choose_tolerance

    budget = budget_of(error, time)
    if budget.unlimited:
        return loaded
    figures = sensor_figures(loaded)
    paces = machine_paces(figures)
    choice, allowed = choose_tolerance(question(loaded, figures), budget, paces)
    note_choice(choice, budget, bool(paces), "gelslim bench SPEC")
    return loaded.with_tolerance(allowed.force_n, allowed.image_px)


def twin_key(figures: SensorFigures) -> str:
    """Names a sensor's simulation among the times of a machine: by what its cost depends on."""
    import hashlib

    parts = (figures.surface_nodes, figures.layers, figures.markers, figures.frame_px)
    return f"twin-{hashlib.sha256(repr(parts).encode()).hexdigest()[:32]}"


def machine_paces(figures: SensorFigures) -> Mapping[str, float]:
    """This machine's times over the declared ones by group of effects; empty if not measured."""
    from gelslim_core.budget.machine_times import read_times

    return read_times(twin_key(figures))
