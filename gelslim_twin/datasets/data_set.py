"""Make a data set: shard by shard on several workers, continued after an interruption.

The folder of a data set:

    dataset.json        what it is; its state is "complete" once all is there
    index.parquet       a row for each frame: draws, labels, and where its files are
    plan.json           the effects that are simulated
    sensors/            for each built sensor its nodes, dots at rest and picture at rest
    shards/             for each shard its rows and the hashes of its files
    train/ validation/ test/ ...   the files of the format
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import disk_error
from gelslim_core.files.file_lock import beside, locked
from gelslim_core.files.replaced_file import json_bytes, replace_file, sweep
from gelslim_core.jobs import Engine
from gelslim_twin.datasets.formats import DataSetError, Shard, format_named
from gelslim_twin.datasets.index_table import (
    INDEX,
    RECORDS,
    ShardRecord,
    read_record,
    record_path,
    rehash,
    write_index,
)
from gelslim_twin.datasets.job import FORMAT, DataSetJob
from gelslim_twin.datasets.labels import MEANING
from gelslim_twin.datasets.making import compute_compliance
from gelslim_twin.datasets.sample import SPLITS
from gelslim_twin.datasets.sensor_files import SENSORS, are_written, write_sensors
from gelslim_twin.datasets.shard_task import WORK, Tasks, moved, perform
from gelslim_twin.datasets.splits import Shards
from gelslim_twin.scene.pose import frame_times

HERE = Engine()
"""This process."""
_EVEN_S = 1e-6
"""Times that differ by less are even."""
MANIFEST, PLAN = "dataset.json", "plan.json"
Progress = Callable[[str, int, int], None]


def make_data_set(
    job: DataSetJob,
    count: int,
    engine: Engine = HERE,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Make a data set of `count` samples, or what is missing of it.

    Args:
        job: The data set, from `prepared`.
        count: Number of its samples; more than before adds samples.
        engine: Where the shards are made.
        overwrite: Replace another data set in the folder.
        progress: Called with the stage, what is done and the total.

    Returns:
        What `dataset.json` says.

    Raises:
        DataSetError: The folder holds something else, or a data set with more samples.
        OutputError: It cannot be written.
    """
    tell = progress or (lambda text, done, total: None)
    folder = job.out_folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with locked(beside(folder, ".lock"), _say_waiting):
            return _made(job, count, engine, overwrite, tell)
    except OSError as error:
        raise disk_error(folder, "writing the data set", error) from error


def _say_waiting(lock: Path) -> None:
    print("Another gelslim is writing into this folder; waiting for it", file=sys.stderr)


def _made(
    job: DataSetJob, count: int, engine: Engine, overwrite: bool, tell: Progress
) -> dict[str, Any]:
    folder = job.out_folder
    _open(job, count, overwrite)
    about = description(job, count)
    wanted = all_shards(job, count)
    missing = [number for number, shard in enumerate(wanted) if not _is_done(job, shard)]
    before = manifest(folder)
    if before.get("state") == "complete" and before["count"] == count and not missing:
        return before
    replace_file(folder / MANIFEST, json_bytes({**about, "state": "running"}))
    replace_file(folder / PLAN, job.plan.to_json().encode())
    tell("sensors", 0, 1)
    compute_compliance(job)
    # A worker prepares the sensors for its samples, so that their files cost it little.
    elsewhere = len(missing) > 1 and not are_written(job)
    if not elsewhere:
        write_sensors(job)
    tasks = Tasks(job, wanted, missing, about, sensors=elsewhere)
    done = count - sum(tasks.samples(number) for number in range(len(tasks)))
    tell("samples", done, count)
    for number, _ in engine.run(perform, tasks):
        done += tasks.samples(number)
        tell("samples", done, count)
    _remove_surplus(folder, wanted)
    write_index(folder, [s.name for s in wanted])
    _complete_format(job, wanted, about)
    answer = {**about, **counted(folder, wanted)}
    replace_file(folder / MANIFEST, json_bytes(answer))
    return answer


def manifest(folder: Path) -> dict[str, Any]:
    """Content of `dataset.json`; empty where there is none."""
    try:
        found = json.loads((folder / MANIFEST).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and found.get("format") == FORMAT else {}


def _open(job: DataSetJob, count: int, overwrite: bool) -> None:
    """Continue in the folder, or refuse it. With `overwrite` another data set is removed."""
    folder, found = job.out_folder, manifest(job.out_folder)
    sweep(folder, again=True)
    for left in folder.glob(f"{WORK}*"):
        shutil.rmtree(left, ignore_errors=True)
    if not found and any(folder.iterdir()):
        raise DataSetError(f"{folder} is not empty and holds no data set; choose another folder")
    if not found:
        return
    if found.get("key") == job.key and found.get("count", 0) <= count:
        return
    if not overwrite:
        more = found.get("count") if found.get("key") == job.key else None
        what = f"this data set with {more} samples" if more else "another data set"
        raise DataSetError(
            f"{folder} holds {what} ({found.get('name')}); choose another folder"
            + (f", ask for at least {more} samples," if more else "")
            + " or replace it with --force"
        )
    _remove(folder)


def _remove(folder: Path) -> None:
    """Remove the files of a data set, and only those."""
    for path in sorted((folder / RECORDS).glob("*.parquet")):
        record = read_record(path)
        for name in () if record is None else record.files:
            (folder / name).unlink(missing_ok=True)
        path.unlink()
    for name in (*manifest(folder).get("format_files", ()), INDEX, PLAN, MANIFEST):
        (folder / name).unlink(missing_ok=True)
    shutil.rmtree(folder / SENSORS, ignore_errors=True)
    for place, _, _ in sorted(os.walk(folder), reverse=True):
        if not any(Path(place).iterdir()) and Path(place) != folder:
            Path(place).rmdir()


def all_shards(job: DataSetJob, count: int) -> Shards:
    """The shards of a data set with `count` samples."""
    poses = job.loaded.poses
    even = not job.loaded.scene.vary.motions
    rate = job.loaded.scene.camera.frame_rate_hz
    kept = len(job.frames.of(len(frame_times(poses, rate))))
    size = max(1, job.frames_per_shard // kept)
    return Shards(
        split_numbers(job, count), size, job.pictures, kept if even else None, kept_rate_hz(job)
    )


def kept_rate_hz(job: DataSetJob) -> float | None:
    """Frames per second of those that are kept; None where their times are not even."""
    scene = job.loaded.scene
    camera_hz = scene.camera.frame_rate_hz
    if camera_hz is not None:
        return camera_hz / max(job.frames.every, 1)
    times = frame_times(job.loaded.poses)
    kept = np.array([times[k].time_s for k in job.frames.of(len(times))])
    steps = np.diff(kept)
    if scene.vary.motions or not len(steps) or np.ptp(steps) > _EVEN_S:
        return None
    return round(float(1 / steps.mean()), 6)


def split_numbers(job: DataSetJob, count: int) -> NDArray[np.int8]:
    """Number of the split of each sample, an index of `SPLITS`."""
    return np.fromiter(
        (SPLITS.index(job.division.of(k, job.drawn_tool(k))) for k in range(count)),
        dtype=np.int8,
        count=count,
    )


def _is_done(job: DataSetJob, shard: Shard) -> bool:
    """Whether a shard has its record and all files have their sizes."""
    record = read_record(record_path(job.out_folder, shard.name))
    return (
        record is not None
        and record.key == job.key
        and record.samples == shard.samples
        and all(_size(job.out_folder / n) == known.bytes for n, known in record.files.items())
    )


def _size(path: Path) -> int:
    """Bytes of a file; -1 if there is none."""
    try:
        return path.stat().st_size
    except OSError:
        return -1


def _remove_surplus(folder: Path, wanted: Sequence[Shard]) -> None:
    """Remove records that belong to no shard, which an earlier data set may have left."""
    names = {shard.name for shard in wanted}
    for path in (folder / RECORDS).glob("*.parquet"):
        if path.stem not in names:
            path.unlink()


def _complete_format(job: DataSetJob, wanted: Sequence[Shard], about: dict[str, Any]) -> None:
    work = job.out_folder / f"{WORK}complete"
    work.mkdir()
    try:
        format_named(job.format).complete(work, job.out_folder, wanted, about)
        files = moved(work, job.out_folder)
        names = [shard.name for shard in wanted]
        about["format_files"] = rehash(job.out_folder, names, files)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def description(job: DataSetJob, count: int) -> dict[str, Any]:
    """What is known of a data set before it is made."""
    scene, plan = job.loaded.scene, job.plan
    return {
        "format": FORMAT,
        "key": job.key,
        "name": scene.name,
        "seed": scene.seed,
        "count": count,
        "file_format": job.format,
        "pictures": {"kind": job.pictures.kind, "quality": job.pictures.quality},
        "frames_kept": str(job.frames),
        "frames_per_shard": job.frames_per_shard,
        "frame_rate_hz": scene.camera.frame_rate_hz,
        "kept_rate_hz": kept_rate_hz(job),
        "observe": list(scene.observe),
        "tools": {
            tool.name: job.division.tools[k] if job.division.by == "tool" else "by sample"
            for k, tool in enumerate(job.loaded.tools)
        },
        "sensors": len(job.sensors),
        "effects": list(plan.order),
        "over_tolerance": {name: dict(found) for name, found in job.over_tolerance.items()},
        "labels": dict(MEANING),
        "scene": json.loads(scene.model_dump_json(exclude_unset=True)),
    }


def counted(folder: Path, wanted: Sequence[Shard]) -> dict[str, Any]:
    """Counts over all shards, reasons of failures, and the size of the files in bytes.

    Raises:
        DataSetError: A shard has no record.
    """
    splits: dict[str, Counter[str]] = {split: Counter() for split in SPLITS}
    reasons: Counter[str] = Counter()
    arrays: dict[str, Any] = {}
    total_bytes = 0
    for shard in wanted:
        record = read_record(record_path(folder, shard.name))
        if record is None:
            raise DataSetError(f"{folder}: the record of {shard.name} is gone; run it again")
        made = len(record.samples) - len(record.failures)
        splits[shard.split].update(samples=made, frames=record.frames)
        reasons.update(failure.reason for failure in record.failures)
        total_bytes += sum(file.bytes for file in record.files.values())
        arrays = arrays or _shapes(record)
    return {
        "state": "complete",
        "samples": sum(c["samples"] for c in splits.values()),
        "frames": sum(c["frames"] for c in splits.values()),
        "failed": sum(reasons.values()),
        "failures": dict(reasons.most_common(20)),
        "bytes": total_bytes,
        "splits": {name: dict(count) for name, count in splits.items() if count["frames"]},
        "arrays": arrays,
        "shards": [shard.name for shard in wanted],
    }


def _shapes(record: ShardRecord) -> dict[str, Any]:
    return {
        name: {"shape": list(shape), "dtype": kind}
        for name, (shape, kind) in (record.arrays or {}).items()
    }
