"""`gelslim simulate`: frames of a contact scene with their true forces."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from gelslim.cli.answer import print_json, progress_bar, say
from gelslim.cli.budget import PoseTime, SceneError, budgeted_scene
from gelslim.cli.commands.trial.dataset import report
from gelslim.cli.commands.trial.plan import SceneFile
from gelslim.cli.options import AsJson, out_folder


def simulate(
    scene: SceneFile,
    out: Annotated[Path | None, out_folder("out/NAME")] = None,
    count: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of samples of the data set that `vary` describes, as `dataset` does.",
        ),
    ] = None,
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=1, help="Number of processes.")] = 1,
    scheduler: Annotated[
        str, typer.Option(help="Dask scheduler in place of processes, such as tcp://host:8786.")
    ] = "",
    error: SceneError = None,
    within: PoseTime = None,
    overwrite: Annotated[
        bool, typer.Option("--force", help="Replace another simulation in the folder.")
    ] = False,
    as_json: AsJson = False,
) -> int:
    """Simulate a contact scene.

    Writes the frames, the true motion of the surface, the true forces, the plan, and a ledger of
    times and residuals. Only the effects that the tolerance of the scene needs are simulated. An
    interrupted run continues where it stopped. With --count, the command makes a data set as
    `gelslim dataset --frames all` does.
    """
    from gelslim.contacts import simulate as simulated
    from gelslim_twin.scene.reader import read_scene

    loaded = budgeted_scene(read_scene(scene), error, within)
    folder = out or Path("out") / loaded.scene.name
    started = time.monotonic()
    with progress_bar(quiet=as_json) as tell:
        answer = simulated(
            loaded,
            folder,
            count=count,
            jobs=jobs,
            scheduler=scheduler,
            overwrite=overwrite,
            progress=tell,
        )
    seconds = time.monotonic() - started
    if count is not None:
        report(answer, seconds, as_json)
        return 0
    answer["seconds_in_all"] = seconds
    if as_json:
        print_json(answer)
    else:
        _report(folder, answer)
    return 0


def _report(folder: Path, answer: dict[str, Any]) -> None:
    say(
        f"Scene: {answer['poses_solved']} poses solved, {answer['frames_drawn']} "
        f"frames drawn, {answer['frames_kept']} kept from before, "
        f"{answer['seconds_in_all']:.1f} s."
    )
    worst = answer["solver_worst"]
    if worst:
        say(
            f"Worst of any pose: residual {worst['residual']:.1e}, penetration "
            f"{1000 * worst['penetration_mm']:.2g} µm."
        )
    drawn = any((folder / "frames").glob("*.png"))
    names = ["truth.csv", "truth.npz", "plan.json", "ledger.json", *(["frames/"] if drawn else [])]
    print(f"In {folder}/: {', '.join(names)}.")
    if drawn and _is_linear(folder / "plan.json"):
        say(
            "The pictures are linear in the light, because the scene does not need the response of "
            "the camera: run `gelslim force` with --gamma 1 on them, or draw it with "
            "`exposure: {use: on, gamma: 1.8}`."
        )


def _is_linear(plan: Path) -> bool:
    """Whether a plan draws no response of the camera; dots tell nothing of it, light does."""
    return plan.exists() and "exposure" not in json.loads(plan.read_text("utf-8"))["order"]
