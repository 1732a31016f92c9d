"""The tasks of a data set: the files of its sensors, and one shard after the other.

The samples of a shard are made and written, its files hashed and moved in place.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from gelslim_core.yaml.errors import InputError
from gelslim_twin.datasets.formats import Shard, format_named
from gelslim_twin.datasets.index_table import (
    Failure,
    FileHash,
    ShardRecord,
    rows_of,
    write_record,
)
from gelslim_twin.datasets.job import DataSetJob
from gelslim_twin.datasets.making import maker_of
from gelslim_twin.datasets.sample import Sample, Value
from gelslim_twin.datasets.sensor_files import write_sensors
from ifem_export.errors import IfemError
from ifem_export.operators.single_thread import single_threaded

WORK = ".work-"


@dataclass(frozen=True)
class ShardTask:
    """A shard of a data set.

    Attributes:
        job: The data set.
        shard: The shard.
        about: What `dataset.json` says of the data set.
    """

    job: DataSetJob
    shard: Shard
    about: Mapping[str, Any]


@dataclass(frozen=True)
class SensorTask:
    """The files of the built sensors, which a worker prepares for its samples anyway."""

    job: DataSetJob


Task = ShardTask | SensorTask


class Tasks(Sequence[Task]):
    """The tasks of a data set, each made when it is asked for, so that none takes memory before."""

    def __init__(
        self,
        job: DataSetJob,
        shards: Sequence[Shard],
        missing: Sequence[int],
        about: Mapping[str, Any],
        *,
        sensors: bool,
    ) -> None:
        """Take what the tasks have in common.

        Args:
            job: The data set.
            shards: All its shards.
            missing: Places of the shards to make among these.
            about: What `dataset.json` says of the data set.
            sensors: Whether the first task writes the files of the sensors.
        """
        self._job, self._shards, self._missing, self._about = job, shards, missing, about
        self._before = int(sensors)

    def __len__(self) -> int:
        """Number of tasks."""
        return self._before + len(self._missing)

    @overload
    def __getitem__(self, index: int) -> Task: ...
    @overload
    def __getitem__(self, index: slice) -> list[Task]: ...
    def __getitem__(self, index: int | slice) -> Task | list[Task]:
        """A task by its place."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(index)
        if index < self._before:
            return SensorTask(self._job)
        shard = self._shards[self._missing[index - self._before]]
        return ShardTask(self._job, shard, self._about)

    def samples(self, index: int) -> int:
        """Samples of a task, those that cannot be made included."""
        if index < self._before:
            return 0
        return len(self._shards[self._missing[index - self._before]].samples)


@single_threaded
def perform(task: Task) -> dict[str, Any]:
    """Carry out a task. The files are the same on every worker.

    Samples whose contact is not solved, or that leave the limits of the scene, are left out and
    listed in the record of their shard.

    Returns:
        Counts of samples, frames and failures.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        if isinstance(task, ShardTask):
            return _performed(task)
        write_sensors(task.job)
        return {"samples": 0, "frames": 0, "failed": 0}


def _performed(task: ShardTask) -> dict[str, Any]:
    job, shard = task.job, task.shard
    work = job.out_folder / f"{WORK}{shard.name}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        rows, failures, arrays = _written(task, work)
        files = moved(work, job.out_folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    record = ShardRecord(
        job.key, shard.name, shard.samples, len(rows), files, tuple(failures), arrays
    )
    write_record(job.out_folder, record, rows)
    return {"samples": len(shard.samples) - len(failures), "frames": len(rows),
            "failed": len(failures)}  # fmt: skip


def _written(
    task: ShardTask, work: Path
) -> tuple[list[Mapping[str, Value]], list[Failure], dict[str, tuple[tuple[int, ...], str]]]:
    """Make and write all samples; returns rows, failures, shapes and types of the arrays."""
    job, shard = task.job, task.shard
    rows: list[Mapping[str, Value]] = []
    failures: list[Failure] = []
    arrays: dict[str, tuple[tuple[int, ...], str]] = {}
    maker = maker_of(job)
    writer = format_named(job.format).writer(work, shard, task.about)
    try:
        for number in shard.samples:
            try:
                sample = maker.sample(number)
            except (IfemError, InputError) as error:
                failures.append(Failure(number, job.sample_id(number), str(error)))
                continue
            places = writer.add(sample)
            rows += rows_of(sample, places, shard.name, len(rows))
            arrays = arrays or _arrays_of(sample)
        writer.finish()
    except BaseException:
        writer.abandon()
        raise
    return rows, failures, arrays


def _arrays_of(sample: Sample) -> dict[str, tuple[tuple[int, ...], str]]:
    frame = sample.frames[0]
    held = dict(frame.arrays)
    if frame.image is not None:
        held["image"] = frame.image
    return {name: (array.shape, str(array.dtype)) for name, array in held.items()}


def moved(work: Path, dataset: Path) -> dict[str, FileHash]:
    """Move all files of a folder to the same paths in the data set. Returns their hashes."""
    found: dict[str, FileHash] = {}
    for path in sorted(work.rglob("*")):
        if path.is_dir():
            continue
        name = path.relative_to(work).as_posix()
        found[name] = hash_of(path)
        target = dataset / name
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, target)
    return found


def hash_of(path: Path) -> FileHash:
    """Size and SHA-256 of a file."""
    with open(path, "rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return FileHash(path.stat().st_size, digest)
