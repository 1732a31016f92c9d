"""The index of a data set: a row for each frame, in Parquet.

Every shard has a record with its rows and with the hashes of its files. The records are joined to
the index, one row group for each shard.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from gelslim_core.files.replaced_file import replace_file, replacement
from gelslim_core.optional_library import load
from gelslim_twin.datasets.formats import DataSetError, FramePlace
from gelslim_twin.datasets.sample import Sample, Value

INDEX, RECORDS = "index.parquet", "shards"
PURPOSE = "the index of a data set"
_META = b"gelslim"
BATCH_ROWS = 1024
"""Rows of the index that are in memory at one time."""
MOST_REASONS = 10
"""Records that are searched for reasons."""


@dataclass(frozen=True)
class FileHash:
    """Size and SHA-256 of a file."""

    bytes: int
    sha256: str


@dataclass(frozen=True)
class Failure:
    """A sample that could not be made, and why."""

    number: int
    id: str
    reason: str


@dataclass(frozen=True)
class ShardRecord:
    """What a finished shard holds.

    Attributes:
        key: Of the data set.
        name: Of the shard.
        samples: Numbers of its samples, failures included.
        frames: Number of its frames.
        files: Its files by path.
        failures: Samples that could not be made.
        arrays: Shape and type of each array of a frame, and of the picture as `image`.
    """

    key: str
    name: str
    samples: tuple[int, ...]
    frames: int
    files: Mapping[str, FileHash]
    failures: tuple[Failure, ...] = ()
    arrays: Mapping[str, tuple[tuple[int, ...], str]] | None = None

    @classmethod
    def from_json(cls, text: bytes) -> ShardRecord:
        """Read what `to_json` wrote. Raises ValueError, KeyError or TypeError for anything else."""
        found = json.loads(text)
        return cls(
            found["key"],
            found["name"],
            tuple(found["samples"]),
            int(found["frames"]),
            {name: FileHash(**value) for name, value in found["files"].items()},
            tuple(Failure(**value) for value in found["failures"]),
            {name: (tuple(shape), kind) for name, (shape, kind) in found["arrays"].items()},
        )

    def to_json(self) -> bytes:
        """The record as JSON."""
        return json.dumps(asdict(self), sort_keys=True).encode()


def rows_of(
    sample: Sample, places: Sequence[FramePlace], shard: str, position: int
) -> list[dict[str, Value]]:
    """Rows of the frames of a sample.

    Args:
        sample: The sample.
        places: Where each of its frames is.
        shard: Name of the shard.
        position: Number of its first frame within the shard.
    """
    return [
        {
            "id": sample.id,
            "sample": sample.number,
            "seed": sample.seed,
            "split": sample.split,
            "shard": shard,
            "row": position + k,
            "frame": frame.number,
            "time_s": frame.time_s,
            "file": place.file,
            "entry": place.entry,
            **sample.draws,
            **frame.labels,
        }
        for k, (frame, place) in enumerate(zip(sample.frames, places, strict=True))
    ]


def record_path(dataset: Path, name: str) -> Path:
    """File of the record of a shard."""
    return dataset / RECORDS / f"{name}.parquet"


def write_record(dataset: Path, record: ShardRecord, rows: Sequence[Mapping[str, Value]]) -> None:
    """Write the record of a shard with its rows, in one step."""
    arrow, parquet = load("pyarrow", PURPOSE), load("pyarrow.parquet", PURPOSE)
    table = arrow.Table.from_pylist(list(rows))
    table = table.replace_schema_metadata({_META: record.to_json()})
    stream = io.BytesIO()
    parquet.write_table(table, stream, compression="zstd")
    replace_file(record_path(dataset, record.name), stream.getvalue(), parents=True)


def read_record(path: Path) -> ShardRecord | None:
    """The record of a shard; None where there is none that can be read."""
    parquet = load("pyarrow.parquet", PURPOSE)
    try:
        metadata = parquet.read_schema(path).metadata or {}
        return ShardRecord.from_json(metadata[_META])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def rehash(dataset: Path, names: Sequence[str], files: Mapping[str, FileHash]) -> list[str]:
    """Note in the records of shards which of their files a format has written again.

    Args:
        dataset: The data set.
        names: Names of the shards.
        files: Hashes of what was written, by path.

    Returns:
        What was written and belongs to no shard.
    """
    free = set(files)
    parquet = load("pyarrow.parquet", PURPOSE)
    for name in names:
        path = record_path(dataset, name)
        record = read_record(path)
        changed = {} if record is None else {n: files[n] for n in record.files if n in files}
        if record is None or not changed:
            continue
        free -= set(changed)
        record = replace(record, files={**record.files, **changed})
        table = parquet.read_table(path).replace_schema_metadata({_META: record.to_json()})
        stream = io.BytesIO()
        parquet.write_table(table, stream, compression="zstd")
        replace_file(path, stream.getvalue())
    return sorted(free)


class NothingMadeError(DataSetError):
    """Not one sample of a data set could be made."""

    def __init__(self, dataset: Path) -> None:
        reasons = {
            failure.reason
            for path in sorted((dataset / RECORDS).glob("*.parquet"))[:MOST_REASONS]
            if (record := read_record(path)) is not None
            for failure in record.failures
        }
        super().__init__(f"{dataset}: no sample could be made: {'; '.join(sorted(reasons)[:3])}")


def write_index(dataset: Path, names: Sequence[str]) -> None:
    """Join the rows of all shards; the memory that it takes does not depend on their number.

    Args:
        dataset: Folder of the data set, in which the index is written.
        names: Names of the shards in their order.

    Raises:
        DataSetError: No shard has a row.
        MissingLibraryError: pyarrow is not installed.
        OSError: A record cannot be read, or the index not written.
    """
    parquet = load("pyarrow.parquet", PURPOSE)
    writer = None
    with replacement(dataset / INDEX) as stream:
        for name in names:
            table = parquet.read_table(record_path(dataset, name)).replace_schema_metadata(None)
            if table.num_rows == 0:
                continue
            if writer is None:
                writer = parquet.ParquetWriter(stream, table.schema, compression="zstd")
            writer.write_table(table)
        if writer is None:
            raise DataSetError(
                f"{dataset}: no sample could be made; see the reasons in the records"
            )
        writer.close()


def index_rows(dataset: Path, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
    """The rows of the index one after the other, all columns or those named.

    Raises:
        DataSetError: There is no index that can be read.
    """
    parquet = load("pyarrow.parquet", PURPOSE)
    try:
        source = parquet.ParquetFile(dataset / INDEX)
    except (OSError, ValueError) as error:
        raise DataSetError(f"{dataset / INDEX}: cannot be read ({error}); make it again") from error
    with source:
        for batch in source.iter_batches(BATCH_ROWS, columns=columns):
            yield from batch.to_pylist()


def index_schema(dataset: Path) -> list[str]:
    """Names of the columns of the index with their types. Raises DataSetError."""
    parquet = load("pyarrow.parquet", PURPOSE)
    try:
        return [f"{field.name} ({field.type})" for field in parquet.read_schema(dataset / INDEX)]
    except (OSError, ValueError) as error:
        raise DataSetError(f"{dataset / INDEX}: cannot be read ({error}); make it again") from error
