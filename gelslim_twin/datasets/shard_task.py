"""One shard as a task: its samples are made and written, its files hashed and moved in place."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


@single_threaded
def perform(task: ShardTask) -> dict[str, Any]:
    """Make a shard. The files are the same on every worker.

    Samples whose contact is not solved, or that leave the limits of the scene, are left out and
    listed in the record.

    Returns:
        Counts of samples, frames and failures.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        return _performed(task)


def _performed(task: ShardTask) -> dict[str, Any]:
    job, shard = task.job, task.shard
    work = job.out_folder / f"{WORK}{shard.name}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        writer = format_named(job.format).writer(work, shard, task.about)
        rows: list[Mapping[str, Value]] = []
        failures: list[Failure] = []
        arrays: dict[str, tuple[tuple[int, ...], str]] = {}
        maker = maker_of(job)
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
        files = moved(work, job.out_folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    record = ShardRecord(
        job.key, shard.name, shard.samples, len(rows), files, tuple(failures), arrays
    )
    write_record(job.out_folder, record, rows)
    return {"samples": len(shard.samples) - len(failures), "frames": len(rows),
            "failed": len(failures)}  # fmt: skip


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
