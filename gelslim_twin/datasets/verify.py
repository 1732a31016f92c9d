"""Check a data set: counts, hashes, readable files, splits without leakage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gelslim_twin.datasets.data_set import manifest
from gelslim_twin.datasets.formats import DataSetError, DataSetFormat, format_named
from gelslim_twin.datasets.index_table import ShardRecord, index_rows, read_record, record_path
from gelslim_twin.datasets.shard_task import hash_of

Progress = Callable[[str, int, int], None]


def verify(folder: Path, progress: Progress | None = None) -> dict[str, Any]:
    """Check a data set.

    Args:
        folder: The data set.
        progress: Called with the stage, the shards checked and their number.

    Returns:
        Numbers of `samples`, `frames` and `files`, and `faults`, sentences that name the file.

    Raises:
        DataSetError: The folder holds no complete data set.
    """
    tell = progress or (lambda text, done, total: None)
    about = manifest(folder)
    if about.get("state") != "complete":
        state = "an unfinished data set; make it again to continue" if about else "no data set"
        raise DataSetError(f"{folder} holds {state}")
    reader, faults, files = format_named(about["file_format"]), [], 0
    frames: dict[str, int] = {}
    for done, name in enumerate(about["shards"]):
        tell("shards", done, len(about["shards"]))
        record = read_record(record_path(folder, name))
        if record is None:
            faults.append(f"{record_path(folder, name)}: missing or damaged")
            continue
        frames[name] = record.frames
        files += len(record.files)
        faults += _faults_of(folder, record, reader)
    return {
        "samples": about["samples"],
        "frames": about["frames"],
        "files": files,
        "faults": [*faults, *_faults_of_index(folder, about, frames)],
    }


def _faults_of(folder: Path, record: ShardRecord, reader: DataSetFormat) -> list[str]:
    found = []
    for name, known in record.files.items():
        path = folder / name
        if not path.is_file():
            found.append(f"{path}: missing")
        elif hash_of(path) != known:
            found.append(f"{path}: changed since it was written")
        elif problem := reader.problem(path):
            found.append(f"{path}: cannot be read ({problem})")
    return found


def _faults_of_index(folder: Path, about: dict[str, Any], frames: dict[str, int]) -> list[str]:
    """Faults of the index against the records of the shards and `dataset.json`."""
    try:
        return list(_compared(folder, about, frames))
    except DataSetError as error:
        return [str(error)]


def _compared(folder: Path, about: dict[str, Any], frames: dict[str, int]) -> list[str]:
    rows: Counter[str] = Counter()
    split_of_tool: dict[str, str] = {}
    by_tool = "by sample" not in about["tools"].values()
    found, samples, before = [], 0, None
    for row in index_rows(folder, ("id", "shard", "split", "tool")):
        rows[row["shard"]] += 1
        if row["id"] != before:
            samples, before = samples + 1, row["id"]
        if by_tool and split_of_tool.setdefault(row["tool"], row["split"]) != row["split"]:
            found.append(f"{folder}: the tool {row['tool']} is in two splits")
        if row["shard"].rpartition("-")[0] != row["split"]:
            found.append(f"{folder}: shard {row['shard']} holds samples of {row['split']}")
    if samples != about["samples"]:
        found.append(f"{folder}: the index has {samples} samples, dataset.json {about['samples']}")
    for name, count in frames.items():
        if rows[name] != count:
            found.append(f"{folder}: the index has {rows[name]} frames of {name}, not {count}")
    return list(dict.fromkeys(found))
