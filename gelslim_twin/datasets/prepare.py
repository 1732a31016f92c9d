"""A scene with ranges as a data set that workers can make: planned, checked, sensors drawn."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from gelslim_core.optional_library import load
from gelslim_twin.datasets.built_sensors import built_sensors
from gelslim_twin.datasets.formats import Pictures, format_named
from gelslim_twin.datasets.job import DataSetJob, FrameChoice, gel_of
from gelslim_twin.datasets.joint_plan import hardest, missed, plan_of_all
from gelslim_twin.datasets.splits import division
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.scene_mechanics import can_be_probed, pad_compliance
from gelslim_twin.simulation.scene_task import require_compatible, require_sensor_of_look
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, sensor_key, stored_sensor

if TYPE_CHECKING:
    from ifem_export.compliance.pad_compliance import PadCompliance

FRAMES_PER_SHARD = 256
"""About 100 MB of pictures of 640 x 480 px, and enough shards to divide among many workers."""
JUDGED = 32
"""Samples on which the plan is judged."""
FIXED_STIFFNESS = ("skin", "adhesion")
"""Effects with forces of their own, beside which those of the gel do not scale with its modulus."""
REMEDY = (
    "say what differs from sample to sample, for example `vary: {x_mm: [-3, 3], "
    "depth_factor: [0.5, 1.2]}`, or make one sample"
)


def require_something_drawn(loaded: LoadedScene, count: int) -> None:
    """Raise InputError where more than one sample is asked of a scene that draws nothing."""
    if count > 1 and loaded.scene.vary.is_empty:
        raise loaded.problem(
            "vary", None, f"nothing is drawn, so that all {count} samples would be the same", REMEDY
        )


def require_libraries(loaded: LoadedScene, format_name: str, pictures: Pictures) -> None:
    """Raise MissingLibraryError or DataSetError for what would fail only after hours of work."""
    load("pyarrow.parquet", "the index of a data set")
    if "image" in loaded.scene.observe:
        load("cv2", "a data set with pictures")
    format_named(format_name).require(pictures)


def prepared(
    loaded: LoadedScene,
    sensor_folder: Path,
    out: Path,
    *,
    format_name: str,
    pictures: Pictures,
    frames: FrameChoice,
    frames_per_shard: int = FRAMES_PER_SHARD,
) -> DataSetJob:
    """Plan a data set and draw its sensors.

    Args:
        loaded: The scene.
        sensor_folder: Folder where `store_sensor` wrote the sensor.
        out: Folder of the data set.
        format_name: Name of a format.
        pictures: Encoding of the pictures.
        frames: Frames that are kept of each sample.
        frames_per_shard: Frames of a shard, at most.

    Returns:
        What every worker needs.

    Raises:
        InputError: The scene cannot be simulated as it asks, even at one end of a range.
        DataSetError: There is no such format, or it has no such pictures.
        MissingLibraryError: A library is not installed.
    """
    require_libraries(loaded, format_name, pictures)
    sensor = stored_sensor(sensor_folder)
    plan = _planned(loaded, sensor, sensor_folder)
    gel = gel_of(loaded, sensor.bundle)
    sensors = built_sensors(loaded.scene, sensor.bundle)
    _require_scaling(loaded, plan, gel)
    if loaded.look is not None:
        require_sensor_of_look(loaded, loaded.look, sensor)
        if len(sensors) > 1:
            raise loaded.problem(
                "look",
                None,
                f"is that of one built sensor, and the data set has {len(sensors)}",
                "delete `look`, or write `sensors: 1` below `vary` and draw neither Poisson's "
                "ratio, thickness, camera nor print",
            )
    names = [tool.name for tool in loaded.tools]
    some = [loaded.numbered(number) for number in range(JUDGED)]
    return DataSetJob(
        loaded,
        plan,
        str(sensor_folder.resolve()),
        sensor_key(sensor),
        sensors,
        gel,
        division(loaded.scene.vary.split, names, loaded.scene.seed),
        format_name,
        pictures,
        frames,
        frames_per_shard,
        str(out.resolve()),
        missed(plan, some, bundle_figures(sensor_folder / BUNDLE)),
    )


def _planned(loaded: LoadedScene, sensor: TwinSensor, folder: Path) -> Plan:
    @cache
    def compliance() -> PadCompliance:
        return pad_compliance(sensor, folder)

    plan = plan_of_all(
        hardest(loaded),
        bundle_figures(folder / BUNDLE),
        compliance if can_be_probed(sensor) else None,  # type: ignore[arg-type]
    )
    require_compatible(loaded, sensor, plan)
    for choice in plan.included:
        if choice.effect == "nonlinearity":
            problem = import_module(choice.implementation).unfit(sensor.bundle)
            if problem is not None:
                raise loaded.problem("effects.nonlinearity", None, *problem)
    return plan


def _require_scaling(loaded: LoadedScene, plan: Plan, gel: tuple[tuple[str, object], ...]) -> None:
    others = [name for name in FIXED_STIFFNESS if name in plan.order]
    if "youngs_modulus_factor" in dict(gel) and others:
        raise loaded.problem(
            "vary.gel",
            None,
            f"Young's modulus is drawn, but with {others[0]} the forces do not scale with it",
            f"switch it off (effects: {{{others[0]}: off}}), or do not draw Young's modulus",
        )
