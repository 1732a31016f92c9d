"""One line of CSV per frame: the wrench and its noise, contact, markers and problems.

The file is UTF-8, separated by commas, with a header line and `\\n` at the end of each line. Floats
have the shortest form that reads back to the same double; `nan` means unknown. A line without its
newline is incomplete.
"""

from __future__ import annotations

import csv
import io
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.tracking.tracks import MarkerStatus

AXES = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")
_STATUS = {
    "tracked": MarkerStatus.TRACKED,
    "predicted": MarkerStatus.PREDICTED,
    "lost": MarkerStatus.LOST,
    "rejected": MarkerStatus.REJECTED,
}
ESCAPE = "backslashreplace"
"""How undecodable bytes, such as those of a file name in another encoding, are written."""
NUMBERS = (
    "index",
    "time_s",
    "stamp_s",
    "sensor_s",
    *AXES,
    *(f"sigma_{axis}" for axis in AXES),
    "normal_known",
    "coverage",
    *_STATUS,
    "contact_nodes",
    "cop_x_mm",
    "cop_y_mm",
    "slip_margin",
    "misfit",
)
"""Columns of numbers; `normal_known` is 0 or 1, counts are nan without markers or nodes."""
COLUMNS = (*NUMBERS, "problems")
"""All columns; several problems are separated by "; "."""
_STAMPS = ("stamp_s", "sensor_s")
"""Columns that the first version of this file did not have."""


@dataclass(frozen=True, eq=False)
class WrenchTable:
    """The n lines of a wrench file."""

    numbers: NDArray[np.float64]
    """(n, len(NUMBERS)), columns as in `NUMBERS`."""
    problems: tuple[str, ...]
    """One text per frame; empty without a problem."""
    incomplete: bool = False
    """Whether the last line is incomplete; it is left out."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.numbers)

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        """(n,) values of a column of numbers. Raises KeyError for another name."""
        if column not in NUMBERS:
            raise KeyError(f"{column!r} is not a column of numbers; these are {', '.join(NUMBERS)}")
        return self.numbers[:, NUMBERS.index(column)]

    @property
    def wrench(self) -> NDArray[np.float64]:
        """(n, 6) force in N, then torque in N mm."""
        return self.numbers[:, [NUMBERS.index(axis) for axis in AXES]]

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(n, 6) standard deviations in N and N mm."""
        return self.numbers[:, [NUMBERS.index(f"sigma_{axis}") for axis in AXES]]


def header() -> str:
    """Return the first line."""
    return ",".join(COLUMNS) + "\n"


def row(result: FrameResult) -> dict[str, float]:
    """Return the numbers of a frame by column; NaN where unknown."""
    return {
        name: value if isinstance(value, int) else float(value)
        for name, value in zip(NUMBERS, _numbers(result), strict=True)
    }


def line(result: FrameResult) -> str:
    """Return the line of a frame, with its newline."""
    numbers = [_text(value) for value in _numbers(result)]
    out = io.StringIO()
    problems = "; ".join(" ".join(problem.split()) for problem in result.problems)
    csv.writer(out, lineterminator="\n").writerow([*numbers, problems])
    return out.getvalue()


def read_wrenches(path: str | os.PathLike[str]) -> WrenchTable:
    """Read a file, also an incomplete one, or one of the first version, without stamps.

    Raises OutputError if it is no wrench file.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise disk_error(path, "reading wrenches", error) from error
    whole, newline, rest = data.rpartition(b"\n")
    try:
        rows = list(csv.reader(io.StringIO((whole + newline).decode("utf-8"), newline="")))
    except (UnicodeDecodeError, csv.Error) as error:
        raise OutputError(f"{os.fspath(path)}: not a wrench file ({error})") from error
    if not rows:
        if (header().encode()).startswith(rest):
            return WrenchTable(np.zeros((0, len(NUMBERS))), (), incomplete=True)
        raise OutputError(
            f"{os.fspath(path)}: not a wrench file; its first line must be {header()!r}"
        )
    names = tuple(rows[0])
    if names not in (COLUMNS, tuple(name for name in COLUMNS if name not in _STAMPS)):
        raise OutputError(
            f"{os.fspath(path)}: not a wrench file; its first line must be {header()!r}"
        )
    numbers = np.full((len(rows) - 1, len(NUMBERS)), np.nan)
    places = [NUMBERS.index(name) for name in names[:-1]]
    for k, row in enumerate(rows[1:]):
        numbers[k, places] = _row(path, k + 2, row, len(names))
    return WrenchTable(
        numbers,
        tuple(row[-1] for row in rows[1:]),
        incomplete=bool(rest),
    )


def _row(path: str | os.PathLike[str], number: int, row: list[str], columns: int) -> list[float]:
    if len(row) != columns:
        raise OutputError(
            f"{os.fspath(path)}, line {number}: {len(row)} values, expected {columns}"
        )
    try:
        return [float(value) for value in row[:-1]]
    except ValueError as error:
        raise OutputError(f"{os.fspath(path)}, line {number}: {error}") from error


def _numbers(result: FrameResult) -> list[float]:
    unknown = [math.nan] * 6
    wrench, field, tracks = result.wrench, result.field, result.tracks
    counts = [math.nan] * 4 if tracks is None else [tracks.count(s) for s in _STATUS.values()]
    contact = [math.nan] * 5
    if field is not None:
        contact = [
            int(field.contact.sum()),
            *field.centre_of_pressure_mm,
            field.slip_margin,
            field.misfit,
        ]
    return [
        int(result.index),
        result.time_s,
        math.nan if result.stamp_s is None else result.stamp_s,
        math.nan if result.sensor_s is None else result.sensor_s,
        *(unknown if wrench is None else wrench.vector),
        *(unknown if wrench is None else _sigma(wrench.covariance)),
        int(result.normal_known),
        result.coverage,
        *counts,
        *contact,
    ]


def _sigma(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6,) standard deviations; rounding errors may make a variance slightly negative."""
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _text(value: float) -> str:
    return str(value) if isinstance(value, int) else repr(float(value))
