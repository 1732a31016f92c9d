"""The table of an exploration as CSV and Parquet: the same bytes for the same table."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any


def csv_bytes(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """UTF-8 CSV with one row per design; numbers in full, nothing where there is none."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["design", *columns])
    for k, row in enumerate(zip(*columns.values(), strict=True)):
        writer.writerow([k, *map(_cell, row)])
    return stream.getvalue().encode()


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else value


def parquet_bytes(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """The same as Parquet; axes of words and numbers become text. Raises ImportError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    count = len(next(iter(columns.values())))
    arrays = {"design": pa.array(range(count), pa.int64())}
    arrays |= {name: _array(list(values)) for name, values in columns.items()}
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table(arrays), sink)
    return bytes(sink.getvalue().to_pybytes())


def _array(values: list[Any]) -> Any:
    import pyarrow as pa

    kinds = {type(v) for v in values if v is not None}
    if kinds == {bool}:
        return pa.array(values, pa.bool_())
    if kinds <= {int}:
        return pa.array(values, pa.int64() if kinds else pa.float64())
    if kinds <= {int, float}:
        return pa.array([None if v is None else float(v) for v in values], pa.float64())
    return pa.array([None if v is None else str(v) for v in values], pa.string())
