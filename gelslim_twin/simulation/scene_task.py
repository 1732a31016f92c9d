"""One scene of a data set as a task that any worker can do."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from gelslim_twin.planning.question import plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.mechanics import mechanics_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, stored_sensor
from gelslim_twin.simulation.simulate import Progress, SimulationJob, simulate


@dataclass(frozen=True)
class SceneTask:
    """Scene `number` of a data set; None is the scene as it stands."""

    scene: str
    """Path of the YAML file."""
    sensor: str
    """Folder of a stored sensor."""
    folder: str
    """Where the result goes."""
    number: int | None = None
    overwrite: bool = False
    tolerance: tuple[float, float] | None = None
    """In N and px, in place of the scene's: decided once, so that every worker does the same."""


def perform(task: SceneTask) -> dict[str, Any]:
    """Simulate; the same bytes wherever it is done. Raises what `simulate` raises."""
    from threadpoolctl import threadpool_limits

    loaded = read_scene(task.scene)
    if task.number is not None:
        loaded = loaded.numbered(task.number)
    if task.tolerance is not None:
        loaded = loaded.with_tolerance(*task.tolerance)
    folder = Path(task.sensor)
    with threadpool_limits(limits=1, user_api="blas"):
        job = job_of(loaded, stored_sensor(folder), folder)
        ledger = simulate(job, Path(task.folder), overwrite=task.overwrite)
    return {"number": task.number, "folder": task.folder, **ledger.to_record()}


def job_of(loaded: LoadedScene, sensor: TwinSensor, folder: Path) -> SimulationJob:
    """Plan a scene for a sensor stored in `folder`.

    Raises InputError where the plan needs an effect that the sensor's pad does not allow.
    """
    plan = plan_scene(loaded, bundle_figures(folder / BUNDLE))
    for choice in plan.included:
        if choice.effect == "nonlinearity":
            problem = import_module(choice.implementation).unfit(sensor.bundle)
            if problem is not None:
                raise loaded.problem("effects.nonlinearity", None, *problem)
    return SimulationJob(
        loaded.scene,
        loaded.poses,
        plan,
        sensor,
        lambda: mechanics_of(loaded, plan, sensor, folder),
    )


__all__ = ["Progress", "SceneTask", "job_of", "perform"]
