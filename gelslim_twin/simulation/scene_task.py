"""A planned scene as a job, its mechanical model, and one scene of a data set as a task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_twin.planning.plan import Choice, Plan
from gelslim_twin.planning.planner import Question
from gelslim_twin.planning.probing import effects_to_probe, probe_ms
from gelslim_twin.planning.question import (
    bundle_figures,
    contact_friction,
    plan_asked,
    question,
)
from gelslim_twin.scene.indenter import MeshFile
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, stored_sensor
from gelslim_twin.simulation.simulate import Mechanics, SimulationJob, simulate

if TYPE_CHECKING:
    from ifem_export.compliance.columns import SurfaceCompliance
    from ifem_export.compliance.pad_compliance import PadCompliance


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
    """In N and px, instead of the scene's. It is decided once, so that all workers agree."""


def perform(task: SceneTask) -> dict[str, Any]:
    """Simulate one scene. The files are the same on every worker. Raises what `simulate` raises."""
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
    """Plan a scene for a stored sensor and prepare its simulation; a probe is made where it pays.

    Args:
        loaded: The scene.
        sensor: The sensor.
        folder: Folder where `store_sensor` wrote the sensor; it also keeps the pad's compliance.

    Returns:
        The input of `simulate`.

    Raises:
        InputError: The plan needs an effect that the sensor's pad does not allow, or the gel meets
            an undercut of a mesh.
    """
    require_no_undercut(loaded, sensor)

    @cache
    def compliance(skin: bool = False) -> PadCompliance:
        return pad_compliance(sensor, folder, skin=skin)

    asked = question(loaded, bundle_figures(folder / BUNDLE))
    plan = planned(loaded, asked, compliance if can_be_probed(sensor) else None)
    if {"skin", "nonlinearity"} <= set(plan.order):
        raise loaded.problem(
            "effects.nonlinearity",
            None,
            "the sensor's gel has a coat or a fabric, large deformation takes a bare gel",
            "switch one of them off (effects: {nonlinearity: off} or {skin: off})",
        )
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
        lambda: mechanics_of(loaded, plan, compliance("skin" in plan.order)),
    )


def require_no_undercut(loaded: LoadedScene, sensor: TwinSensor) -> None:
    """Raise InputError where the gel meets a part of a mesh that is hidden behind a gap.

    Args:
        loaded: The scene.
        sensor: The sensor, whose undeformed gel counts.
    """
    for index, indenter in enumerate(loaded.scene.indenters):
        if not isinstance(indenter, MeshFile):
            continue
        from gelslim_twin.contact.undercut import undercut_of_file

        hidden = undercut_of_file(indenter, loaded.folder)
        if hidden is None:
            continue
        top_mm = float(sensor.points_mm[:, 2].max())
        for pose in loaded.poses:
            met = hidden.below(pose, sensor.size_mm, top_mm)
            if met is not None:
                raise loaded.problem(
                    f"indenters[{index}].file",
                    indenter.file,
                    f"the gel meets an undercut at {pose.time_s:g} s, hidden from below by other "
                    f"parts: {met}",
                    "turn the mesh, press less deep, or fill the gap in the mesh",
                )


def can_be_probed(sensor: TwinSensor) -> bool:
    """Whether a probe serves a sensor: it takes a bare gel and a table of columns."""
    from ifem_export.compliance.table_size import has_room

    return sensor.bundle.skin is None and has_room(len(sensor.bundle.mesh.surface))


def planned(
    loaded: LoadedScene, asked: Question, compliance: Callable[[], SurfaceCompliance] | None
) -> Plan:
    """Plan a scene; where it pays, a probe finds the sizes of effects before.

    Args:
        loaded: The scene.
        asked: The scene as the planner takes it, without a probe.
        compliance: Gives the compliance of the pad, called only for a probe; None for a pad that
            is not probed.

    Returns:
        The plan.

    Raises:
        InputError: As `plan_scene`.
    """
    plan = plan_asked(loaded, asked)
    effects = effects_to_probe(asked, plan)
    if not effects or compliance is None:
        return plan
    from gelslim_twin.simulation.probe import probed

    spent_ms = probe_ms(asked, plan, effects)
    return plan_asked(loaded, probed(asked, loaded, compliance(), effects, spent_ms))


def pad_compliance(
    sensor: TwinSensor, folder: Path | None = None, *, skin: bool = False
) -> PadCompliance:
    """The compliance of a sensor's pad: a table of columns where that fits, else a convolution.

    Args:
        sensor: The sensor.
        folder: Folder that keeps the columns.
        skin: Whether the coat and the fabric of the gel count.
    """
    from ifem_export.compliance.table_size import has_room

    membranes = sensor.bundle.skin.membranes if skin and sensor.bundle.skin else ()
    if has_room(len(sensor.bundle.mesh.surface)):
        from ifem_export.compliance.columns import SurfaceCompliance

        return SurfaceCompliance(sensor.bundle, folder, membranes)
    from ifem_export.compliance.convolved import ConvolvedCompliance

    return ConvolvedCompliance(sensor.bundle, membranes)


def mechanics_of(loaded: LoadedScene, plan: Plan, compliance: PadCompliance) -> Mechanics:
    """The mechanical model of a planned scene on a pad.

    Only modules of effects in the plan are imported. Raises ValueError or OSError for a mesh
    that cannot be read.
    """
    chosen = {choice.effect: choice for choice in plan.included}
    solver = import_module(chosen["normal_contact"].implementation)
    from gelslim_twin.contact.tool import Tool

    tolerance, friction = _tolerance(chosen["normal_contact"]), 0.0
    if "friction" in chosen:
        tolerance = min(tolerance, _tolerance(chosen["friction"]))
        skin = compliance.bundle.skin
        friction = contact_friction(loaded.scene.contact, None if skin is None else skin.friction)
    settings = solver.ContactSettings(tolerance, friction)
    tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    contact: Any = _linear_contact(solver, compliance, tool, settings)
    if "nonlinearity" in chosen:
        nonlinear = import_module(chosen["nonlinearity"].implementation)
        contact = nonlinear.NonlinearContact(
            contact, **dict(chosen["nonlinearity"].rung_parameters)
        )
    if "relaxation" in chosen:
        given = loaded.scene.effects.parameters()["relaxation"].model_dump()["terms"]
        relaxation = import_module(chosen["relaxation"].implementation)
        fractions, times_s = (tuple(t[n] for t in given) for n in ("fraction", "time_s"))
        contact = relaxation.RelaxingContact(contact, relaxation.PronySeries(fractions, times_s))
    return contact


def _linear_contact(solver: Any, compliance: PadCompliance, tool: Any, settings: Any) -> Any:
    from ifem_export.compliance.table_size import has_room

    if has_room(len(compliance.bundle.mesh.surface)):
        return solver.ContactSolver(compliance, tool, settings)
    from gelslim_twin.contact.fine_contact import FineContact

    return FineContact(compliance, tool, settings)


def _tolerance(choice: Choice) -> float:
    return float(dict(choice.rung_parameters)["tolerance"])
