"""Data sets for learning: made from a scene with ranges, verified, merged."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import os

    from gelslim.design import Progress
    from gelslim_twin.datasets.job import DataSetJob
    from gelslim_twin.scene.reader import LoadedScene


def sensor_folder(folder: Path) -> Path:
    """Return the folder of the sensor of a simulation, where the next one finds it."""
    return folder.parent / ".sensor" if folder.parent != folder else folder / ".sensor"


def prepared_data_set(
    loaded: LoadedScene,
    out: Path,
    *,
    count: int,
    file_format: str = "folder",
    pictures: str = "png",
    quality: int = 95,
    frames: str = "last",
    frames_per_shard: int | None = None,
    progress: Progress | None = None,
) -> DataSetJob:
    """Check a data set, store its sensor next to it, and plan it.

    Arguments and errors are those of `gelslim.data_set`.
    """
    from gelslim.scene_sensor import require_within_gel, scene_bundle
    from gelslim_twin.datasets.built_sensors import built_sensors, thickness_mm
    from gelslim_twin.datasets.data_set import manifest
    from gelslim_twin.datasets.formats import pictures_of
    from gelslim_twin.datasets.job import FrameChoice
    from gelslim_twin.datasets.joint_plan import hardest
    from gelslim_twin.datasets.prepare import (
        FRAMES_PER_SHARD,
        prepared,
        require_libraries,
        require_something_drawn,
    )
    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor

    require_something_drawn(loaded, count)
    encoding, kept = pictures_of(pictures, quality), FrameChoice.parsed(frames)
    require_libraries(loaded, file_format, encoding)
    with contextlib.suppress(FileNotFoundError):
        out.stat()  # A name that is too long is refused before anything is written.
    if progress:
        progress("sensor", 0, 1)
    bundle = scene_bundle(loaded, with_light="image" in loaded.scene.observe)
    sensors = built_sensors(loaded.scene, bundle)
    thinnest_mm = thickness_mm(bundle) * min(one.thickness_factor for one in sensors)
    for scene in hardest(loaded):
        require_within_gel(scene, thinnest_mm)
    place = sensor_folder(out)
    store_sensor(TwinSensor(bundle), place)
    if progress:
        progress("plan", 0, 1)
    if frames_per_shard is None:
        frames_per_shard = manifest(out).get("frames_per_shard", FRAMES_PER_SHARD)
    return prepared(
        loaded,
        place,
        out,
        format_name=file_format,
        pictures=encoding,
        frames=kept,
        frames_per_shard=frames_per_shard,
    )


def made_data_set(
    job: DataSetJob,
    folder: Path,
    count: int,
    engine: tuple[int, str],
    overwrite: bool,
    progress: Progress | None,
) -> dict[str, Any]:
    """Make a prepared data set. Arguments and errors are those of `gelslim.data_set`."""
    from gelslim_core.jobs import Engine
    from gelslim_twin.datasets.data_set import make_data_set

    answer = make_data_set(job, count, Engine(*engine), overwrite=overwrite, progress=progress)
    return {"folder": str(folder), **answer}


def verify_data_set(
    folder: str | os.PathLike[str], progress: Progress | None = None
) -> dict[str, Any]:
    """Check a data set: counts, hashes, and that every file can be read.

    Args:
        folder: The data set.
        progress: Called as the work goes on.

    Returns:
        Counts of samples, frames and files, and the `faults` that were found.

    Raises:
        DataSetError: The folder holds no complete data set.
    """
    from gelslim_twin.datasets.verify import verify

    return verify(Path(folder), progress)


def merge_data_sets(
    folders: list[Path], out: str | os.PathLike[str], progress: Progress | None = None
) -> dict[str, Any]:
    """Merge data sets of the same scenes' kind into a new one. The sources stay as they are.

    Args:
        folders: Two or more complete data sets with the same columns, format and pictures.
        out: A new folder.
        progress: Called as the work goes on.

    Returns:
        What the new `dataset.json` says.

    Raises:
        DataSetError: They do not fit together, for example because they share a sample.
        OutputError: The new one cannot be written.
    """
    from gelslim_twin.datasets.merge import merge

    return merge([Path(folder) for folder in folders], Path(out), progress)
