"""Simulated contacts of a sensor: plan, frames with true forces, validation."""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gelslim.design import Progress
    from gelslim_core.budget.budget import Budget
    from gelslim_core.budget.ladder import Choice
    from gelslim_twin.effects.circumstances import SensorFigures
    from gelslim_twin.planning.plan import Plan
    from gelslim_twin.planning.planner import Question
    from gelslim_twin.scene.reader import LoadedScene
    from gelslim_twin.simulation.sensor import TwinSensor
    from gelslim_twin.validation.score import Validation
    from ifem_export.compliance.columns import SurfaceCompliance

    SceneLike = LoadedScene | str | os.PathLike[str]

USUAL_ERROR = 0.01
"""Relative error for which a scene is probed where a budget gives a time alone."""


def scene_of(scene: SceneLike) -> LoadedScene:
    """Return a scene that was read; a file is read first.

    Raises:
        InputError: The file has faults.
    """
    from gelslim_twin.scene.reader import LoadedScene, read_scene

    return scene if isinstance(scene, LoadedScene) else read_scene(scene)


def plan(scene: SceneLike, budget: Budget | None = None) -> Plan:
    """Plan which physical effects a contact scene needs.

    A few poses of a long run are solved to find the sizes of effects; nothing else is simulated.

    Args:
        scene: The result of `read_scene`, or the path of a YAML file.
        budget: Error and time allowed; replaces the tolerance of the scene.

    Returns:
        Each effect with the reason why it is kept or left out, the error of leaving it out, and
        the time predicted.

    Raises:
        InputError: The scene or its sensor has faults.
        BudgetError: No plan keeps the budget.
    """
    from gelslim.scene_sensor import require_within_gel, scene_bundle, sensor_figures
    from gelslim_twin.planning.question import question
    from gelslim_twin.simulation.scene_task import planned, viewer_of
    from gelslim_twin.simulation.sensor import TwinSensor

    loaded, _ = with_budget(scene_of(scene), budget)
    figures = sensor_figures(loaded)
    require_within_gel(loaded, figures.thickness_mm)

    @cache
    def sensor() -> TwinSensor:
        return TwinSensor(scene_bundle(loaded))

    return planned(
        loaded,
        question(loaded, figures),
        lambda: _compliance(loaded),
        None if loaded.look is not None else lambda made: viewer_of(loaded, sensor(), made),
    )


def simulate(
    scene: SceneLike,
    out: str | os.PathLike[str] | None = None,
    budget: Budget | None = None,
    *,
    count: int | None = None,
    jobs: int = 1,
    scheduler: str = "",
    overwrite: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Simulate a contact scene: frames, true surface motion and true forces.

    Only the effects that the tolerance needs are simulated. A run that was interrupted continues
    where it stopped.

    Args:
        scene: The result of `read_scene`, or the path of a YAML file.
        out: Folder of the results; `out/NAME` by default.
        budget: Error and time allowed; replaces the tolerance of the scene.
        count: Number of samples of the data set that the scene's `vary` block describes, with all
            their frames, as by `data_set`; None for the scene itself.
        jobs: Number of processes for a data set.
        scheduler: Address of a Dask scheduler, in place of processes.
        overwrite: Replace another simulation in the folder.
        progress: Called as the work goes on.

    Returns:
        The folder, counts of scenes, poses and frames, and the largest residuals of the solver; of
        a data set what `data_set` returns.

    Raises:
        InputError: The scene or its sensor has faults.
        BudgetError: No plan keeps the budget.
        SimulationError: The folder holds something else or cannot be written.
        ContactError: A contact was not solved.
    """
    from gelslim.data_sets import sensor_folder
    from gelslim.scene_sensor import require_within_gel, scene_bundle
    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor

    if count is not None:
        where: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler, "overwrite": overwrite}
        return data_set(scene, out, budget, count=count, frames="all", progress=progress, **where)
    loaded, _ = with_budget(scene_of(scene), budget)
    folder = Path("out") / loaded.scene.name if out is None else Path(out)
    if progress:
        progress("sensor", 0, 1)
    sensor = TwinSensor(scene_bundle(loaded, with_light="image" in loaded.scene.observe))
    mesh = sensor.bundle.mesh
    require_within_gel(loaded, mesh.layers * mesh.cell_size_mm[2])
    with contextlib.suppress(FileNotFoundError):
        folder.stat()  # A name that is too long is refused before anything is written.
    store_sensor(sensor, sensor_folder(folder))
    return _one(loaded, folder, overwrite, progress)


def data_set(
    scene: SceneLike,
    out: str | os.PathLike[str] | None = None,
    budget: Budget | None = None,
    *,
    count: int,
    file_format: str = "folder",
    pictures: str = "png",
    quality: int = 95,
    frames: str = "last",
    jobs: int = 1,
    scheduler: str = "",
    frames_per_shard: int | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Make a data set of the contacts that the `vary` block of a scene describes.

    Every sample depends on the seed of the scene and on its number only. A data set that was
    interrupted continues where it stopped, and one that is complete grows to a larger count.

    Args:
        scene: The result of `read_scene`, or the path of a YAML file.
        out: Folder of the data set; `out/NAME` by default.
        budget: Error and time allowed; replaces the tolerance of the scene.
        count: Number of samples.
        file_format: `folder`, `webdataset`, `zarr` or `lerobot`.
        pictures: `png`, `webp` or `jpeg`; `video` for `lerobot` alone.
        quality: 1 to 100 of WebP, JPEG and video; WebP and video are lossless at 100.
        frames: `last`, `all` or `every:K`.
        jobs: Number of processes.
        scheduler: Address of a Dask scheduler, in place of processes.
        frames_per_shard: Frames that are written together, at most; by default those of the data
            set in the folder, or 256 for a new one.
        overwrite: Replace another data set in the folder.
        progress: Called as the work goes on.

    Returns:
        The folder, and what its `dataset.json` says: counts, splits, shapes of the arrays.

    Raises:
        InputError: The scene or its sensor has faults, or draws nothing although several samples
            are asked for.
        BudgetError: No plan keeps the budget.
        DataSetError: The folder holds something else, or the format has no such pictures.
        EngineError: No cluster answers, or a script with several jobs has no
            `if __name__ == "__main__":`.
    """
    from gelslim.data_sets import made_data_set, prepared_data_set
    from gelslim_core.jobs import Engine
    from gelslim_twin.datasets.ready import load_libraries

    engine = Engine(jobs, scheduler)
    engine.require_main()
    loaded, _ = with_budget(scene_of(scene), budget)
    folder = Path("out") / loaded.scene.name if out is None else Path(out)
    with engine.warmed(load_libraries):
        job = prepared_data_set(
            loaded, folder, count=count, file_format=file_format, pictures=pictures,
            quality=quality, frames=frames, frames_per_shard=frames_per_shard, progress=progress,
        )  # fmt: skip
    return made_data_set(job, folder, count, (jobs, scheduler), overwrite, progress)


def validate(
    spec: str | os.PathLike[str],
    folder: str | os.PathLike[str] | None = None,
    budget: Budget | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Validation:
    """Compare the force pipeline of a sensor with simulated contacts of known force.

    Args:
        spec: Path of the finger's YAML file.
        folder: Keeps the sensor and its compliance for the next validation; None keeps nothing.
        budget: Error and time allowed for the force operator.
        seed: Seed of noise, dirt and print faults.
        progress: Called as the work goes on.

    Returns:
        The contacts, the errors of each chain of estimation, and the error budget.

    Raises:
        InputError: The spec has faults.
        BudgetError: No operator keeps the budget.
        ContactError: A contact was not solved.
        CalibrationError: The sensor's own reference picture was refused.
    """
    from dataclasses import replace

    from gelslim.design import chosen_operator, spec_of
    from gelslim.scene_sensor import spec_bundle
    from gelslim_cad.dimensions import derive
    from gelslim_cad.sensor import measured_ladder
    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor, stored_sensor
    from gelslim_twin.validation.validate import validate as validated

    sensor = TwinSensor(spec_bundle(Path(spec)))
    ladder, label = None, ""
    remarks: tuple[str, ...] = ()
    if budget is not None and not budget.unlimited:
        # A budget that no operator keeps is refused before anything is written.
        ladder = measured_ladder(derive(spec_of(spec)), sensor.bundle.mesh, progress=progress)
        label, remarks = chosen_operator(ladder, budget)
    if folder is not None:
        store_sensor(sensor, Path(folder))
        sensor = stored_sensor(Path(folder))
    if label:
        sensor = replace(sensor, bundle=replace(sensor.bundle, ladder=ladder, operator=label))
    place = None if folder is None else Path(folder)
    found = validated(sensor, place, seed, progress, budget)
    return replace(found, operator=label, remarks=remarks)


def with_budget(
    loaded: LoadedScene, budget: Budget | None
) -> tuple[LoadedScene, tuple[Choice, bool] | None]:
    """Give a scene the tolerance of a budget.

    Errors are relative to the force of the deepest contact, for which a few poses are solved.

    Returns:
        The scene, unchanged without a budget; and the choice with whether its times are those of
        this machine, or None without a budget.

    Raises:
        BudgetError: No plan keeps the budget.
    """
    if budget is None or budget.unlimited:
        return loaded, None
    from gelslim.scene_sensor import sensor_figures
    from gelslim_twin.planning.tolerance_ladder import choose_tolerance

    figures = sensor_figures(loaded)
    paces = machine_paces(figures)
    asked = _solved_question(loaded, figures, budget.error or USUAL_ERROR)
    choice, allowed = choose_tolerance(asked, budget, paces)
    return loaded.with_tolerance(allowed.force_n, allowed.image_px), (choice, bool(paces))


def _solved_question(loaded: LoadedScene, figures: SensorFigures, error: float) -> Question:
    """Return the question of a scene with its force solved, and the sizes of effects if it pays.

    `error` is the relative error at which it may pay.
    """
    from dataclasses import replace

    from gelslim_twin.planning.planner import make_plan
    from gelslim_twin.planning.probing import PROBED, effects_to_probe, probe_ms
    from gelslim_twin.planning.question import question
    from gelslim_twin.planning.tolerance_ladder import tolerance_at
    from gelslim_twin.simulation.probe import probed

    asked = question(loaded, figures)
    if asked.circumstances.contact.normal_n <= 0:
        return asked
    compliance = _compliance(loaded)
    solved = probed(asked, loaded, compliance)
    allowed = tolerance_at(solved, error)
    bounded = replace(asked, force_n=allowed.force_n, image_px=allowed.image_px)
    plan = make_plan(bounded)
    effects = tuple(name for name in effects_to_probe(bounded, plan) if name in PROBED)
    if not effects:
        return solved
    return probed(asked, loaded, compliance, effects, probe_ms(bounded, plan, effects))


def _compliance(loaded: LoadedScene) -> SurfaceCompliance:
    """Return the compliance of the pad of a scene's sensor; nothing is stored."""
    from gelslim.scene_sensor import scene_bundle
    from ifem_export.compliance.columns import SurfaceCompliance

    return SurfaceCompliance(scene_bundle(loaded, with_light=False))


def twin_key(figures: SensorFigures) -> str:
    """Return the key of a sensor's simulation among the times of a machine.

    It hashes what the cost of a simulation depends on.
    """
    parts = (figures.surface_nodes, figures.layers, figures.markers, figures.frame_px)
    return f"twin-{hashlib.sha256(repr(parts).encode()).hexdigest()[:32]}"


def machine_paces(figures: SensorFigures) -> Mapping[str, float]:
    """Return the times of this machine over the declared ones, by group of effects.

    Empty if `gelslim bench` has not measured them.
    """
    from gelslim_core.budget.machine_times import read_times

    return read_times(twin_key(figures))


def _one(
    loaded: LoadedScene, folder: Path, overwrite: bool, progress: Progress | None
) -> dict[str, Any]:
    from threadpoolctl import threadpool_limits

    from gelslim.data_sets import sensor_folder
    from gelslim_twin.simulation.scene_task import job_of
    from gelslim_twin.simulation.sensor import stored_sensor
    from gelslim_twin.simulation.simulate import simulate as simulated

    place = sensor_folder(folder)
    # As in the workers of a data set, where several threads are slower than one.
    with threadpool_limits(limits=1, user_api="blas"):
        job = job_of(loaded, stored_sensor(place), place)
        ledger = simulated(job, folder, overwrite=overwrite, progress=progress)
    return {"folder": str(folder), "scenes": 1, "poses": len(loaded.poses), **ledger.to_record()}
