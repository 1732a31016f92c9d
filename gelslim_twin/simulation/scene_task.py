"""A planned scene as a job, and one scene of a data set as a task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_twin.planning.grey_sizes import PICTURED
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question
from gelslim_twin.planning.probing import effects_to_probe, probe_ms
from gelslim_twin.planning.question import plan_asked, question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.built_look import BuiltLook, LookError
from gelslim_twin.scene.indenter import MeshFile
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.scene_mechanics import can_be_probed, mechanics_of, pad_compliance
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, stored_sensor
from gelslim_twin.simulation.simulate import SimulationJob, simulate

if TYPE_CHECKING:
    from gelslim_twin.simulation.picture import Viewer
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
        InputError: The plan needs an effect that the sensor's pad does not allow, the gel meets an
            undercut of a mesh, or the scene's look is that of another sensor.
    """
    if loaded.look is not None:
        require_sensor_of_look(loaded, loaded.look, sensor)
    require_no_undercut(loaded, sensor)

    @cache
    def compliance(skin: bool = False) -> PadCompliance:
        return pad_compliance(sensor, folder, skin=skin)

    asked = question(loaded, bundle_figures(folder / BUNDLE))
    plan = planned(
        loaded,
        asked,
        compliance if can_be_probed(sensor) else None,
        None if loaded.look is not None else partial(viewer_of, loaded, sensor),
    )
    require_compatible(loaded, sensor, plan)
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
        loaded.look,
    )


LARGE = "large deformation was chosen too"
EXCLUDED = (
    (
        ("nonlinearity", "skin"),
        "the sensor's gel has a coat or a fabric, large deformation takes a bare gel",
        "switch one of them off (effects: {nonlinearity: off} or {skin: off})",
    ),
    (
        ("viscoelasticity", "nonlinearity"),
        f"the contact of a viscoelastic gel is solved at small strain, {LARGE}",
        "switch nonlinearity off, or give the terms to `relaxation`, which keeps the shape of "
        "the elastic gel",
    ),
    (
        ("sliding_friction", "nonlinearity"),
        f"friction that depends on the speed is solved at small strain, {LARGE}",
        "switch one of them off (effects: {nonlinearity: off} or {sliding_friction: off})",
    ),
    (
        ("adhesion", "nonlinearity"),
        f"the bonds of a tacky gel are solved at small strain, {LARGE}",
        "switch one of them off (effects: {nonlinearity: off} or {adhesion: off})",
    ),
    (
        ("adhesion", "viscoelasticity"),
        "the bonds of a tacky gel are solved on an elastic gel, a viscoelastic one was chosen too",
        "switch one of them off (effects: {viscoelasticity: off} or {adhesion: off})",
    ),
)
"""Effects that exclude each other, the first of which is named, the reason, and the remedy."""
TABLE_ONLY = ("sliding_friction", "adhesion")
"""Effects that take a table of the compliance's columns."""


def require_compatible(loaded: LoadedScene, sensor: TwinSensor, plan: Plan) -> None:
    """Raise InputError for a plan whose effects exclude each other or need another pad."""
    from ifem_export.compliance.table_size import has_room

    for pair, message, remedy in EXCLUDED:
        if set(pair) <= set(plan.order):
            raise loaded.problem(f"effects.{pair[0]}", None, message, remedy)
    nodes = len(sensor.bundle.mesh.surface)
    for effect in TABLE_ONLY:
        if effect in plan.order and not has_room(nodes):
            raise loaded.problem(
                f"effects.{effect}",
                None,
                f"the sensor's pad has {nodes} surface nodes, more than this effect takes",
                "switch it off, or lower the sensor's mesh.nodes_per_marker_pitch",
            )


def require_sensor_of_look(loaded: LoadedScene, look: BuiltLook, sensor: TwinSensor) -> None:
    """Raise InputError for a look of another sensor than that of the scene."""
    try:
        look.require_bundle(sensor.bundle)
    except LookError as error:
        message, _, remedy = str(error).rpartition(": ")
        raise loaded.problem("look", None, message, remedy) from None


def require_no_undercut(loaded: LoadedScene, sensor: TwinSensor) -> None:
    """Raise InputError where the gel meets a part of a mesh that is hidden behind a gap.

    Args:
        loaded: The scene.
        sensor: The sensor, whose undeformed gel counts.
    """
    for index, indenter in enumerate(loaded.scene.indenters):
        if not isinstance(indenter, MeshFile):
            continue
        from gelslim_twin.tools.undercut import undercut_of_file

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


def viewer_of(loaded: LoadedScene, sensor: TwinSensor, plan: Plan) -> Viewer:
    """How a sensor as designed is seen by a plan."""
    from gelslim_twin.simulation.picture import Viewer

    return Viewer(sensor, plan, loaded.scene)


def planned(
    loaded: LoadedScene,
    asked: Question,
    compliance: Callable[[], PadCompliance] | None,
    viewer: Callable[[Plan], Viewer] | None = None,
) -> Plan:
    """Plan a scene; where it pays, a probe finds the sizes of effects before.

    Args:
        loaded: The scene.
        asked: The scene as the planner takes it, without a probe.
        compliance: Gives the compliance of the pad, called only for a probe; None for a pad that
            is not probed.
        viewer: How the sensor is seen by a plan, for the probe of pictures; None for none.

    Returns:
        The plan.

    Raises:
        InputError: As `plan_scene`.
    """
    plan = plan_asked(loaded, asked)
    effects = () if compliance is None else effects_to_probe(asked, plan)
    if viewer is None:
        effects = tuple(name for name in effects if name not in PICTURED)
    if not effects or compliance is None:
        return plan
    from gelslim_twin.simulation.probe import probed
    from ifem_export.compliance.columns import SurfaceCompliance

    pad = compliance()
    assert isinstance(pad, SurfaceCompliance), "a probe takes a table of columns"
    solved = tuple(name for name in effects if name not in PICTURED)
    pictured = None
    if viewer is not None and solved != effects:
        from gelslim_twin.simulation.drawn_effects import drawn_effects

        pictured = partial(drawn_effects, viewer=viewer, by_bounds=plan, solved=solved)
    spent_ms = probe_ms(asked, plan, solved)
    return plan_asked(loaded, probed(asked, loaded, pad, solved, spent_ms, pictured))
