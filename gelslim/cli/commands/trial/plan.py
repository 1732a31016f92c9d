"""`gelslim plan`: which effects a scene needs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, say, table
from gelslim.cli.budget import PoseTime, SceneError, budgeted_scene
from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from gelslim_twin.planning.plan import Plan

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="The scene's YAML file.")]


def plan(
    scene: SceneFile,
    error: SceneError = None,
    within: PoseTime = None,
    as_json: AsJson = False,
) -> int:
    """Print which physical effects a contact scene needs.

    For each effect it says whether it is included and why, the error of leaving it out and whether
    a probe or a bound found it, the chosen rung, and the milliseconds per pose that it takes or
    that leaving it out saves. A few poses of a long run are solved for that; nothing is written.
    """
    from gelslim.contacts import plan as planned
    from gelslim_twin.scene.reader import read_scene

    made = planned(budgeted_scene(read_scene(scene), error, within))
    if as_json:
        print(made.to_json(), end="")
    else:
        print_plan(made)
    return 0


def print_plan(made: Plan) -> None:
    """Print a table of the effects, and which of them exceed the tolerance."""
    from gelslim_twin.effects.effect import unit_of
    from gelslim_twin.planning.plan import TITLES

    rows = table(padding=(0, 2, 0, 0))
    for title in TITLES[:-1]:
        rows.add_column(title, no_wrap=True)
    rows.add_column(TITLES[-1])
    for choice in made.choices:
        rows.add_row(*choice.cells(), style=None if choice.included else "dim")
    console().print(rows)
    print(f"{made.scene}: {made.time_text()}.")
    for observable, error in made.over_tolerance:
        unit = "N" if unit_of(observable) == "n" else "px"
        spoilt = [c.effect for c in made.choices if observable in c.over_share]
        say(
            f"The {observable} may err by {error:.3g} {unit}, more than the tolerance: "
            f"{', '.join(spoilt)}. Switch it on or raise the tolerance.",
            style="bold red",
        )
