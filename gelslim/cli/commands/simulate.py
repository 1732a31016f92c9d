"""`gelslim simulate`: a contact scene to frames with their true forces."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.commands.plan import SceneFile
from gelslim.cli.options import AsJson
from gelslim.cli.scene_budget import PoseTime, SceneError

if TYPE_CHECKING:
    from gelslim_twin.scene.reader import LoadedScene


def simulate(
    scene: SceneFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder; out/NAME if left out.")
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(min=1, max=100_000, help="Scenes of the data set that `vary` describes."),
    ] = None,
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=1, help="Processes.")] = 1,
    scheduler: Annotated[
        str, typer.Option(help="Dask scheduler, such as tcp://host:8786, in place of processes.")
    ] = "",
    error: SceneError = None,
    within: PoseTime = None,
    overwrite: Annotated[
        bool, typer.Option("--force", help="Replace another simulation in the folder.")
    ] = False,
    as_json: AsJson = False,
) -> int:
    """Simulate a contact scene.

    Writes frames, true surface motion and forces, the plan and a ledger of time and residuals.
    Simulates only the effects that the scene's tolerance calls for. An interrupted run goes on
    where it stopped. With --count, every scene is drawn anew from the scene's `vary` block, all
    with the tolerance that a budget gives the scene as it stands.
    """
    from gelslim.cli.answer import print_json
    from gelslim.cli.progress import progress_bar
    from gelslim.cli.scene_budget import budgeted_scene
    from gelslim.scene_sensor import require_within_gel, twin_sensor
    from gelslim_twin.scene.reader import read_scene
    from gelslim_twin.simulation.stored_sensor import store_sensor

    loaded = budgeted_scene(read_scene(scene), error, within)
    folder = out or Path("out") / loaded.scene.name
    started = time.monotonic()
    with progress_bar(quiet=as_json) as tell:
        if tell:
            tell("sensor", 0, 1)
        sensor = twin_sensor(loaded)
        mesh = sensor.bundle.mesh
        require_within_gel(loaded, mesh.layers * mesh.cell_size_mm[2])
        with contextlib.suppress(FileNotFoundError):
            folder.stat()  # a name too long is told before anything is written beside it
        store_sensor(sensor, _beside(folder), "image" in loaded.scene.observe)
        if count is None:
            answer = _one(loaded, folder, overwrite, tell)
        else:
            answer = _many(loaded, folder, count, jobs, scheduler, overwrite, tell)
    answer["seconds_in_all"] = time.monotonic() - started
    if as_json:
        print_json(answer)
    else:
        _report(folder, answer)
    return 0


def _beside(folder: Path) -> Path:
    """Where the sensor of a simulation is kept, so that the next one finds its compliance."""
    return folder.parent / ".sensor" if folder.parent != folder else folder / ".sensor"


def _one(loaded: LoadedScene, folder: Path, overwrite: bool, tell: Any) -> dict[str, Any]:
    from threadpoolctl import threadpool_limits

    from gelslim_twin.simulation.scene_task import job_of
    from gelslim_twin.simulation.simulate import simulate as simulated
    from gelslim_twin.simulation.stored_sensor import stored_sensor

    sensor = _beside(folder)
    job = job_of(loaded, stored_sensor(sensor), sensor)
    # As in the workers of a data set: threads that wait for each other cost more than they save.
    with threadpool_limits(limits=1, user_api="blas"):
        ledger = simulated(job, folder, overwrite=overwrite, progress=tell)
    return {"folder": str(folder), "scenes": 1, "poses": len(loaded.poses), **ledger.to_record()}


def _many(
    loaded: LoadedScene,
    folder: Path,
    count: int,
    jobs: int,
    scheduler: str,
    overwrite: bool,
    tell: Any,
) -> dict[str, Any]:
    from gelslim_core.jobs.engine import Engine
    from gelslim_twin.simulation.scene_task import SceneTask, perform

    for number in range(count):
        loaded.numbered(number)
    allowed = loaded.scene.tolerance
    tasks = [
        SceneTask(
            str(Path(loaded.path).resolve()),
            str(_beside(folder).resolve()),
            str((folder / f"scene_{number:05d}").resolve()),
            number,
            overwrite,
            (allowed.force_n, allowed.image_px),
        )
        for number in range(count)
    ]
    done: list[dict[str, Any]] = []
    for _, result in Engine(jobs, scheduler).run(perform, tasks):
        done.append(result)
        if tell:
            tell("scenes", len(done), count)
    worst: dict[str, float] = {}
    for result in done:
        for name, value in result["solver_worst"].items():
            worst[name] = max(worst.get(name, 0.0), value)
    return {
        "folder": str(folder),
        "scenes": count,
        "poses_solved": sum(r["poses_solved"] for r in done),
        "frames_drawn": sum(r["frames_drawn"] for r in done),
        "frames_kept": sum(r["frames_kept"] for r in done),
        "solver_worst": worst,
    }


def _report(folder: Path, answer: dict[str, Any]) -> None:
    from gelslim.cli.answer import say

    many = answer["scenes"]
    what = "scene" if many == 1 else f"{many} scenes"
    say(
        f"{what.capitalize()}: {answer['poses_solved']} poses solved, {answer['frames_drawn']} "
        f"frames drawn, {answer['frames_kept']} kept from before, "
        f"{answer['seconds_in_all']:.1f} s."
    )
    worst = answer["solver_worst"]
    if worst:
        say(
            f"Worst of any pose: residual {worst['residual']:.1e}, penetration "
            f"{1000 * worst['penetration_mm']:.2g} µm."
        )
    first = sorted(folder.glob("scene_*"))[:1]
    where = f"In {folder}/scene_*/" if many > 1 or first else f"In {folder}/"
    drawn = any(((first or [folder])[0] / "frames").glob("*.png"))
    names = ["truth.csv", "truth.npz", "plan.json", "ledger.json", *(["frames/"] if drawn else [])]
    print(f"{where}: {', '.join(names)}.")
