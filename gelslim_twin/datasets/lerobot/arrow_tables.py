"""Columns as tables of Arrow with the types that the loader of LeRobot expects."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_twin.datasets.lerobot.features import Feature

_PURPOSE = "a data set of LeRobot"
TASK = "__index_level_0__"
"""Column of `meta/tasks.parquet` that pandas takes for its index, the tasks in words."""


def arrow() -> Any:
    """The module `pyarrow`. Raises MissingLibraryError."""
    return optional_library.load("pyarrow", _PURPOSE)


def parquet() -> Any:
    """The module `pyarrow.parquet`. Raises MissingLibraryError."""
    return optional_library.load("pyarrow.parquet", _PURPOSE)


def parquet_writer(path: Path, schema: Any) -> Any:
    """Begin a file whose pages have checksums, so that damage shows. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return parquet().ParquetWriter(path, schema, write_page_checksum=True)


def frame_table(
    features: Mapping[str, Feature], columns: Mapping[str, NDArray[Any]], pictures: list[bytes]
) -> Any:
    """A table of frames.

    Args:
        features: All columns; a video is in a file of its own and has none.
        columns: Values (t, ...) of those that are no pictures.
        pictures: The t encoded pictures of the column of type `image`; empty without one.
    """
    pa, schema = arrow(), frame_schema(features)
    made = []
    for field in schema:
        if features[field.name].dtype == "image":
            entries = [{"bytes": data, "path": None} for data in pictures]
            made.append(pa.array(entries, type=field.type))
        else:
            made.append(_array(columns[field.name], features[field.name]))
    return pa.table(made, schema=schema)


def frame_schema(features: Mapping[str, Feature]) -> Any:
    """Columns and types of a table of frames; a video has none."""
    pa = arrow()
    return pa.schema([(n, _type(f)) for n, f in features.items() if f.dtype != "video"])


def _type(feature: Feature) -> Any:
    pa = arrow()
    if feature.dtype == "image":
        return pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    if feature.dtype == "string":
        return pa.string()
    kind = pa.from_numpy_dtype(np.dtype(feature.dtype))
    if feature.shape == (1,):
        return kind
    if len(feature.shape) == 1:
        return pa.list_(kind, feature.shape[0])
    for _ in feature.shape:
        kind = pa.list_(kind)
    return kind


def tasks_table(tasks: list[str]) -> Any:
    """The tasks by number, as pandas stores a frame whose index they are."""
    pa = arrow()
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), TASK: tasks})
    about = {
        "index_columns": [TASK],
        "column_indexes": [],
        "columns": [
            _pandas_column("task_index", "task_index", "int64"),
            _pandas_column(None, TASK, "unicode"),
        ],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": None,
    }
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _pandas_column(name: str | None, field: str, kind: str) -> dict[str, Any]:
    numpy_type = "object" if kind == "unicode" else kind
    return {
        "name": name, "field_name": field, "pandas_type": kind, "numpy_type": numpy_type,
        "metadata": None,
    }  # fmt: skip


def _array(values: NDArray[Any], feature: Feature) -> Any:
    pa = arrow()
    if feature.dtype == "string":
        return pa.array([str(value) for value in values], pa.string())
    flat = pa.array(np.ascontiguousarray(values).ravel())
    if feature.shape == (1,):
        return flat
    if len(feature.shape) == 1:
        return pa.FixedSizeListArray.from_arrays(flat, feature.shape[0])
    for size in reversed(feature.shape):
        ends = np.arange(len(flat) // size + 1, dtype=np.int32) * size
        flat = pa.ListArray.from_arrays(pa.array(ends), flat)
    return flat


def parquet_problem(path: Path) -> str:
    """Why a file of Parquet cannot be read; empty if all its columns can."""
    try:
        with parquet().ParquetFile(path, page_checksum_verification=True) as file:
            for _ in file.iter_batches():
                pass
    except (OSError, ValueError) as error:
        return str(error)
    return ""
