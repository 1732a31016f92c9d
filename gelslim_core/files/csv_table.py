"""A table that a person wrote, from a CSV file: rows by the names of the first line."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping
from pathlib import Path

Row = Mapping[str, str]
Refused = Callable[[str], Exception]


def read_csv_table(
    place: Path, form: str, refused: Refused
) -> tuple[tuple[str, ...], list[tuple[str, Row]]]:
    """Read a table whose values are separated by commas, semicolons or tabs.

    Args:
        place: The file.
        form: What its first line must be, as a message says it.
        refused: Makes the error of a message.

    Returns:
        The names of the first line in lower case, and for each further line that is not empty
        where it is and its texts by name.

    Raises:
        Exception: Of `refused`: the file cannot be read, is empty, or a line has another number of
            values than the first.
    """
    try:
        text = place.read_bytes().decode("utf-8-sig")
    except OSError as error:
        reason = (error.strerror or "cannot be read").lower()
        raise refused(f"{place}: {reason}; {form}") from error
    except UnicodeDecodeError as error:
        raise refused(f"{place}: it is not a text file in UTF-8; save the table as CSV") from error
    first, _, _ = text.partition("\n")
    if not first.strip():
        raise refused(f"{place}: it is empty; {form}")
    lines = csv.reader(io.StringIO(text), delimiter=max(",;\t", key=first.count))
    head = tuple(name.strip().lower() for name in next(lines))
    rows: list[tuple[str, Row]] = []
    for number, line in enumerate(lines, start=2):
        if not any(cell.strip() for cell in line):
            continue
        where = f"{place}, line {number}"
        if len(line) != len(head):
            raise refused(f"{where}: {len(line)} values for the {len(head)} columns of line 1")
        rows.append((where, dict(zip(head, (cell.strip() for cell in line), strict=True))))
    return head, rows


def number_of(where: str, row: Row, column: str, refused: Refused) -> float:
    """The number of a column; NaN where it is empty or `nan`.

    Raises:
        Exception: Of `refused`, for anything else that is not a finite number.
    """
    text = row[column]
    if text.lower() in ("", "nan"):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise refused(
            f"{where}: {column} = {text!r}: must be a number with a decimal point, without a unit"
        )
    return value
