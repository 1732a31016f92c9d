"""Merge data sets: their files are linked or copied under new numbers of shards.

Files of a data set are replaced and never changed, so that links to them are safe.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

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
    index_rows,
    index_schema,
    read_record,
    record_path,
    rehash,
    write_index,
    write_record,
)
from gelslim_twin.datasets.sample import SPLITS, Split
from gelslim_twin.datasets.sensor_files import SENSORS
from gelslim_twin.datasets.shard_task import moved

Progress = Callable[[str, int, int], None]
SAME = ("file_format", "pictures", "frames_kept", "arrays", "observe", "labels")
"""What data sets must have in common."""
OF_SOURCE = ("name", "seed", "key", "scene", "samples", "effects", "over_tolerance")
"""What the merged data set keeps of each source."""


@dataclass(frozen=True)
class _Source:
    """A shard of a source and what becomes of it.

    Attributes:
        folder: Data set that it is of.
        name: Its name there.
        split: Its split.
        number: Its number within its split in the merged data set.
        first: Place of its first sample there.
        sensor_offset: What its numbers of sensors are raised by.
    """

    folder: Path
    name: str
    split: Split
    number: int
    first: int
    sensor_offset: int

    def record(self) -> ShardRecord:
        """Its record, read anew each time. Raises DataSetError where it is gone."""
        found = read_record(record_path(self.folder, self.name))
        if found is None:
            raise DataSetError(f"{self.folder}: the record of {self.name} is gone; verify it")
        return found


class _MergedShards(Sequence[Shard]):
    """The shards of the merged data set; none is kept in memory."""

    def __init__(self, sources: Sequence[_Source], about: Mapping[str, Any]) -> None:
        self._sources = sources
        self._pictures, self._rate_hz = pictures_of(**about["pictures"]), about["kept_rate_hz"]

    def __len__(self) -> int:
        return len(self._sources)

    @overload
    def __getitem__(self, index: int) -> Shard: ...
    @overload
    def __getitem__(self, index: slice) -> list[Shard]: ...
    def __getitem__(self, index: int | slice) -> Shard | list[Shard]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        one = self._sources[index]
        samples = one.record().samples
        return Shard(one.split, one.number, one.first, samples, self._pictures, None, self._rate_hz)


class _Samples:
    """The samples of a data set, in one bit each, by what stands before the number in their ids."""

    def __init__(self, ids: Iterable[str]) -> None:
        self._bits: dict[str, NDArray[np.uint8]] = {}
        before = ""
        for identity in ids:
            if identity != before:
                self._add(identity)
                before = identity

    def _add(self, identity: str) -> None:
        name, _, digits = identity.rpartition("-")
        place, bit = divmod(int(digits), 8)
        bits = self._bits.get(name, np.zeros(0, np.uint8))
        if place >= len(bits):
            bits = np.concatenate([bits, np.zeros(max(place + 1 - len(bits), len(bits)), np.uint8)])
        bits[place] |= 1 << bit
        self._bits[name] = bits

    def shared(self, other: _Samples) -> str | None:
        """The id of the first sample that both have."""
        for name in self._bits.keys() & other._bits.keys():
            mine, theirs = self._bits[name], other._bits[name]
            least = min(len(mine), len(theirs))
            both = mine[:least] & theirs[:least]
            if both.any():
                number = int(np.flatnonzero(np.unpackbits(both, bitorder="little"))[0])
                return f"{name}-{number:07d}"
        return None


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
    held: list[_Samples] = []
    splits: dict[str, tuple[str, Path]] = {}
    for folder, about in zip(folders, abouts, strict=True):
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
        mine = _Samples(row["id"] for row in index_rows(folder, ("id",)))
        for place, other in zip(folders, held, strict=False):
            if identity := mine.shared(other):
                raise DataSetError(
                    f"{folder}: holds the sample {identity} as {place} does; "
                    "give one of the scenes another name or another seed"
                )
        held.append(mine)


def _merged(
    folders: Sequence[Path], abouts: Sequence[dict[str, Any]], work: Path, tell: Progress
) -> dict[str, Any]:
    key = hashlib.sha256("|".join(about["key"] for about in abouts).encode()).hexdigest()
    sources = _sources(folders, abouts)
    for done, source in enumerate(sources):
        tell("shards", done, len(sources))
        _take(source, work, str(abouts[0]["file_format"]), key)
    _take_sensors(folders, abouts, work)
    _linked(folders[0] / PLAN, work / PLAN)
    wanted = _MergedShards(sources, abouts[0])
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


def _sources(folders: Sequence[Path], abouts: Sequence[Mapping[str, Any]]) -> list[_Source]:
    """All shards, split after split and within each one source after the other."""
    found: list[_Source] = []
    first = 0
    for split in SPLITS:
        number = 0
        for index, (folder, about) in enumerate(zip(folders, abouts, strict=True)):
            offset = sum(a["sensors"] for a in abouts[:index])
            for name in about["shards"]:
                if name.rpartition("-")[0] != split:
                    continue
                found.append(_Source(folder, name, split, number, first, offset))
                number += 1
                first += len(found[-1].record().samples)
    return found


def _take(source: _Source, work: Path, file_format: str, key: str) -> None:
    """Link the files of a shard under their new names, and write its record."""
    reader, record = _renumbering(file_format), source.record()
    shard = f"{source.split}-{source.number:05d}"
    names = {file: reader.renumbered(file, source.number) for file in record.files}
    for old, new in names.items():
        _linked(source.folder / old, work / new)
    parquet = load("pyarrow.parquet", PURPOSE)
    rows = parquet.read_table(record_path(source.folder, record.name)).to_pylist()
    for row in rows:
        row["shard"] = shard
        row["file"] = reader.renumbered(row["file"], source.number)
        row["sensor"] += source.sensor_offset
    files = {names[old]: known for old, known in record.files.items()}
    write_record(work, replace(record, key=key, name=shard, files=files), rows)


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
