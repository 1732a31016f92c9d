"""Merge data sets: their files are linked or copied under new numbers of shards.

Files of a data set are replaced and never changed, so that links to them are safe.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gelslim_core.errors import disk_error
from gelslim_core.files.file_lock import beside
from gelslim_core.files.replaced_file import json_bytes, replace_file
from gelslim_core.optional_library import load
from gelslim_twin.datasets.data_set import MANIFEST, PLAN, counted, manifest
from gelslim_twin.datasets.formats import (
    DataSetError,
    MergeableFormat,
    Shard,
    format_named,
    pictures_of,
)
from gelslim_twin.datasets.index_table import (
    PURPOSE,
    ShardRecord,
    index_ids,
    index_schema,
    read_record,
    record_path,
    rehash,
    write_index,
    write_record,
)
from gelslim_twin.datasets.sample import SPLITS
from gelslim_twin.datasets.sensor_files import SENSORS
from gelslim_twin.datasets.shard_task import moved

Progress = Callable[[str, int, int], None]
SAME = ("file_format", "pictures", "frames_kept", "arrays", "observe", "labels")
"""What data sets must have in common."""
OF_SOURCE = ("name", "seed", "key", "scene", "samples", "effects", "over_tolerance")
"""What the merged data set keeps of each source."""


@dataclass(frozen=True)
class _Source:
    """A shard of a source and what becomes of it."""

    folder: Path
    record: ShardRecord
    shard: Shard
    sensor_offset: int


def merge(folders: Sequence[Path], out: Path, progress: Progress | None = None) -> dict[str, Any]:
    """Merge data sets into a new one; see `gelslim.merge_data_sets`."""
    tell = progress or (lambda text, done, total: None)
    abouts = [_complete(folder) for folder in folders]
    _require_fitting(folders, abouts)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataSetError(f"{out}: is there already; choose a new folder")
    work = beside(Path(os.path.abspath(out)), ".building")
    try:
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        answer = _merged(folders, abouts, work, tell)
        with contextlib.suppress(OSError):
            out.rmdir()
        os.rename(work, out)
    except OSError as error:
        raise disk_error(out, "merging data sets", error) from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return answer


def _complete(folder: Path) -> dict[str, Any]:
    about = manifest(folder)
    if about.get("state") != "complete":
        raise DataSetError(f"{folder}: holds no complete data set")
    return about


def _require_fitting(folders: Sequence[Path], abouts: Sequence[Mapping[str, Any]]) -> None:
    first = abouts[0]
    if len(folders) < 2:
        raise DataSetError("one data set alone cannot be merged; name two or more")
    _renumbering(first["file_format"])
    ids: dict[str, int] = {}
    splits: dict[str, tuple[str, Path]] = {}
    for number, (folder, about) in enumerate(zip(folders, abouts, strict=True)):
        for name in SAME:
            if about[name] != first[name]:
                raise DataSetError(
                    f"{folder}: differs in {name} from {folders[0]}; make them with the same "
                    "options and the same `observe`"
                )
        theirs, ours = (index_schema(place) for place in (folder, folders[0]))
        if theirs != ours:
            raise DataSetError(
                f"{folder}: has other columns than {folders[0]} ("
                f"{', '.join(sorted(set(theirs) ^ set(ours))) or 'in another order'}); "
                "draw the same quantities"
            )
        for name, split in about["tools"].items():
            before = splits.setdefault(name, (split, folder))
            if before[0] != split:
                raise DataSetError(
                    f"{folder}: the tool {name} is for {split}, and for {before[0]} in "
                    f"{before[1]}; name its split in both scenes, as in "
                    f"`vary: {{split: {{test: [{name}]}}}}`"
                )
        for identity in index_ids(folder):
            if ids.setdefault(identity, number) != number:
                raise DataSetError(
                    f"{folder}: holds the sample {identity} as {folders[ids[identity]]} does; "
                    "give one of the scenes another name or another seed"
                )


def _merged(
    folders: Sequence[Path], abouts: Sequence[dict[str, Any]], work: Path, tell: Progress
) -> dict[str, Any]:
    key = hashlib.sha256("|".join(about["key"] for about in abouts).encode()).hexdigest()
    sources = _sources(folders, abouts, key)
    for done, source in enumerate(sources):
        tell("shards", done, len(sources))
        _take(source, work, str(abouts[0]["file_format"]))
    _take_sensors(folders, abouts, work)
    _linked(folders[0] / PLAN, work / PLAN)
    wanted = [source.shard for source in sources]
    write_index(work, [shard.name for shard in wanted])
    about: dict[str, Any] = {
        **abouts[0],
        "key": key,
        "count": sum(a["count"] for a in abouts),
        "sensors": sum(a["sensors"] for a in abouts),
        "tools": {name: split for a in abouts for name, split in a["tools"].items()},
        "merged": [{name: a[name] for name in OF_SOURCE} for a in abouts],
    }
    inner = work / ".work-complete"
    inner.mkdir()
    format_named(about["file_format"]).complete(inner, work, wanted, about)
    files = moved(inner, work)
    about["format_files"] = rehash(work, [shard.name for shard in wanted], files)
    shutil.rmtree(inner)
    answer = {**about, **counted(work, wanted)}
    replace_file(work / MANIFEST, json_bytes(answer))
    return answer


def _renumbering(file_format: str) -> MergeableFormat:
    found = format_named(file_format)
    if not isinstance(found, MergeableFormat):
        raise DataSetError(
            f"data sets of the format {file_format} cannot be merged; make one data set with the "
            "ranges of all"
        )
    return found


def _sources(
    folders: Sequence[Path], abouts: Sequence[Mapping[str, Any]], key: str
) -> list[_Source]:
    """All shards, split after split and within each one source after the other."""
    found: list[_Source] = []
    first = 0
    for split in SPLITS:
        number: Counter[str] = Counter()
        for index, (folder, about) in enumerate(zip(folders, abouts, strict=True)):
            offset = sum(a["sensors"] for a in abouts[:index])
            for name in about["shards"]:
                if name.rpartition("-")[0] != split:
                    continue
                record = read_record(record_path(folder, name))
                if record is None:
                    raise DataSetError(f"{folder}: the record of {name} is gone; verify it")
                pictures = pictures_of(**about["pictures"])
                shard = Shard(split, number[split], first, record.samples, pictures, None,
                              about["kept_rate_hz"])  # fmt: skip
                found.append(_Source(folder, replace(record, key=key), shard, offset))
                number[split] += 1
                first += len(record.samples)
    return found


def _take(source: _Source, work: Path, file_format: str) -> None:
    """Link the files of a shard under their new names, and write its record."""
    reader, shard = _renumbering(file_format), source.shard
    names = {file: reader.renumbered(file, shard.number) for file in source.record.files}
    for old, new in names.items():
        _linked(source.folder / old, work / new)
    parquet = load("pyarrow.parquet", PURPOSE)
    rows = parquet.read_table(record_path(source.folder, source.record.name)).to_pylist()
    for row in rows:
        row["shard"] = shard.name
        row["file"] = reader.renumbered(row["file"], shard.number)
        row["sensor"] += source.sensor_offset
    files = {names[old]: known for old, known in source.record.files.items()}
    write_record(work, replace(source.record, name=shard.name, files=files), rows)


def _take_sensors(folders: Sequence[Path], abouts: Sequence[Mapping[str, Any]], work: Path) -> None:
    number = 0
    for folder, about in zip(folders, abouts, strict=True):
        for k in range(about["sensors"]):
            for old in (folder / SENSORS).glob(f"sensor_{k:02d}.*"):
                _linked(old, work / SENSORS / f"sensor_{number:02d}{old.suffix}")
            number += 1


def _linked(old: Path, new: Path) -> None:
    new.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(old, new)
    except (OSError, NotImplementedError):
        shutil.copy2(old, new)
