"""Several frames of a run in one file, `fields_00000.npz` or `fields_00000.parquet`."""

from __future__ import annotations

import io
import json
import os
import queue
import threading
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_core.files.replaced_file import replace_file
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.packed_frame import PER_MARKER, PER_NODE, PackedFrame, unpack

Format = Literal["npz", "parquet"]
FORMAT_NAME = "gelslim-fields/1"
_MAX_WAITING = 2
"""Chunks that wait in memory at most; `submit` waits until there is room."""
_FILL: Mapping[str, Any] = {"status": -1, "dots": -1, "contact": False}


@dataclass(frozen=True, eq=False)
class FieldChunk:
    """n frames with the same m markers and c nodes."""

    arrays: Mapping[str, NDArray[Any]]
    """(n, ...) by name; rows that a frame does not have are NaN, -1 or false."""
    points_mm: NDArray[np.float64]
    """(c, 3) nodes at rest."""
    problems: tuple[tuple[str, ...], ...]
    extra: tuple[str, ...]
    """A JSON object per frame."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.problems)

    def results(
        self, stage_ms: Mapping[int, Mapping[str, float]] | None = None
    ) -> Iterator[FrameResult]:
        """Yield the results in order, with the times of the stages by frame index."""
        times = stage_ms or {}
        for k in range(len(self)):
            frame = {name: array[k] for name, array in self.arrays.items()}
            stages = times.get(int(frame["index"]))
            yield unpack(frame, self.points_mm, self.problems[k], self.extra[k], stages)


def fits(
    first: PackedFrame | None, points_mm: NDArray[np.float64] | None, new: PackedFrame
) -> bool:
    """Return whether a frame can be added to a chunk.

    `first` is the first frame of the chunk that has markers, `points_mm` are its nodes; None if
    the chunk has none yet.
    """
    if first is not None and new.markers and new.markers != first.markers:
        return False
    if points_mm is None or new.points_mm is None:
        return True
    return points_mm is new.points_mm or np.array_equal(points_mm, new.points_mm)


def stack(frames: Sequence[PackedFrame]) -> FieldChunk:
    """Join frames with the same markers and nodes. Raises ValueError if they differ."""
    markers = max((frame.markers for frame in frames), default=0)
    nodes = max((frame.nodes for frame in frames), default=0)
    arrays: dict[str, NDArray[Any]] = {}
    for name in frames[0].arrays if frames else ():
        count = markers if name in PER_MARKER else nodes if name in PER_NODE else None
        arrays[name] = np.stack([_filled(name, frame.arrays[name], count) for frame in frames])
    points = next((f.points_mm for f in frames if f.points_mm is not None), np.zeros((0, 3)))
    return FieldChunk(
        arrays, points, tuple(f.problems for f in frames), tuple(f.extra for f in frames)
    )


def _filled(name: str, array: NDArray[Any], count: int | None) -> NDArray[Any]:
    if count is None or len(array) == count:
        return array
    if len(array):
        raise ValueError(f"{name}: {len(array)} rows in a chunk of {count}")
    return np.full((count, *array.shape[1:]), _FILL.get(name, np.nan), dtype=array.dtype)


def write_chunk(path: Path, chunk: FieldChunk) -> None:
    """Write a chunk atomically, in the format that the suffix of `path` says.

    Raises MissingLibraryError if Parquet needs pyarrow, OSError if the disk refuses.
    """
    replace_file(path, parquet_bytes(chunk) if path.suffix == ".parquet" else npz_bytes(chunk))


def read_chunk(path: str | os.PathLike[str]) -> FieldChunk:
    """Read a chunk of either format. Raises OutputError."""
    try:
        if Path(path).suffix == ".parquet":
            return _from_parquet(path)
        return _from_npz(path)
    except FileNotFoundError as error:
        raise disk_error(path, "reading fields", error) from error
    except OutputError:
        raise
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise OutputError(f"{os.fspath(path)}: not a chunk of fields ({error})") from error


def npz_bytes(chunk: FieldChunk) -> bytes:
    """Return a NumPy archive; equal chunks give equal bytes."""
    out = io.BytesIO()
    texts = {
        "problems": np.array([json.dumps(p) for p in chunk.problems], dtype=np.str_),
        "extra": np.array(chunk.extra, dtype=np.str_),
        "format": np.array(FORMAT_NAME),
    }
    np.savez(out, points_mm=chunk.points_mm, **texts, **dict(chunk.arrays))  # type: ignore[arg-type]
    return out.getvalue()


def _from_npz(path: str | os.PathLike[str]) -> FieldChunk:
    with np.load(path, allow_pickle=False) as file:
        if str(file["format"]) != FORMAT_NAME:
            raise OutputError(f"{os.fspath(path)}: format {file['format']}, not {FORMAT_NAME}")
        others = ("points_mm", "problems", "extra", "format")
        arrays = {name: file[name] for name in file.files if name not in others}
        problems = tuple(tuple(json.loads(str(text))) for text in file["problems"])
        return FieldChunk(arrays, file["points_mm"], problems, tuple(str(t) for t in file["extra"]))


def parquet_bytes(chunk: FieldChunk) -> bytes:
    """Return a Parquet file: a row per frame, arrays as lists of fixed size, shapes as metadata.

    Raises MissingLibraryError without pyarrow.
    """
    pa = optional_library.load("pyarrow", "Parquet")
    parquet = optional_library.load("pyarrow.parquet", "Parquet")
    columns = dict(chunk.arrays)
    columns["points_mm"] = np.repeat(chunk.points_mm[None], len(chunk), axis=0)
    fields, values = [], []
    for name, array in columns.items():
        size = int(np.prod(array.shape[1:]))
        flat = pa.array(np.ascontiguousarray(array).reshape(-1))
        values.append(flat if array.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, size))
        shape = json.dumps(array.shape[1:])
        fields.append(pa.field(name, values[-1].type, metadata={"shape": shape}))
    for name, texts in (
        ("problems", list(map(json.dumps, chunk.problems))),
        ("extra", chunk.extra),
    ):
        values.append(pa.array(list(texts), pa.string()))
        fields.append(pa.field(name, pa.string()))
    schema = pa.schema(fields, metadata={"format": FORMAT_NAME})
    out = io.BytesIO()
    table = pa.Table.from_arrays(values, schema=schema)
    parquet.write_table(table, out, compression="zstd", compression_level=1)
    return out.getvalue()


def _from_parquet(path: str | os.PathLike[str]) -> FieldChunk:
    parquet = optional_library.load("pyarrow.parquet", "Parquet")
    table = parquet.ParquetFile(path).read()
    if (table.schema.metadata or {}).get(b"format", b"").decode() != FORMAT_NAME:
        raise OutputError(f"{os.fspath(path)}: not of the format {FORMAT_NAME}")
    arrays = {}
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        if name in ("problems", "extra"):
            arrays[name] = column.to_pylist()
            continue
        shape = json.loads(table.schema.field(name).metadata[b"shape"])
        flat = column.flatten() if shape else column
        arrays[name] = flat.to_numpy(zero_copy_only=False).reshape(table.num_rows, *shape)
    problems = tuple(tuple(json.loads(text)) for text in arrays.pop("problems"))
    extra = tuple(arrays.pop("extra"))
    points = arrays.pop("points_mm")
    return FieldChunk(arrays, points[0] if len(points) else np.zeros((0, 3)), problems, extra)


class ChunkWriter:
    """Turns finished journals into chunks in a thread, so that no frame waits for the disk.

    A journal is deleted once its chunk is on the disk.
    """

    def __init__(self, before: Callable[[], None]) -> None:
        """Start the thread, which calls `before` ahead of each chunk."""
        self._before = before
        self._queue: queue.Queue[tuple[Path, Path, Sequence[PackedFrame]] | None] = queue.Queue(
            _MAX_WAITING
        )
        self._error: OutputError | None = None
        self._thread: threading.Thread | None = None

    def submit(self, target: Path, journal: Path, frames: Sequence[PackedFrame]) -> None:
        """Queue a closed journal and its frames. Raises OutputError if an earlier chunk failed."""
        self.check()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="chunk-writer", daemon=True)
            self._thread.start()
        self._queue.put((target, journal, frames))

    def check(self) -> None:
        """Raise OutputError if a chunk could not be written; its journal still exists."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Wait until all chunks are written; `check` tells about errors."""
        if self._thread is not None and self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            target, journal, frames = item
            try:
                if self._error is None:
                    self._before()
                    write_chunk(target, stack(frames))
                    journal.unlink()
            except OutputError as error:
                self._error = error
            except OSError as error:
                self._error = disk_error(target, "writing a chunk of fields", error)
            except Exception as error:  # an error in a thread would go unnoticed
                self._error = OutputError(f"{target}: {type(error).__name__}: {error}")
