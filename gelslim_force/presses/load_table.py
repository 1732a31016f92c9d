"""Known loads of presses from a CSV file.

The first line names the columns: `picture`, then `load_n` in newtons or `load_g` in grams, and if
known `sigma_n` or `sigma_g`, the standard deviation of a load, and `time_s`. A load of 0 marks a
picture without contact.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gelslim_force.presses.press_error import PressError

NEWTON_PER_GRAM = 9.80665e-3
"""Standard gravity."""
LOAD_SHARE, SCALE_N = 0.005, NEWTON_PER_GRAM
"""Standard deviation of a load where none is given: a share of it, and 1 g of a kitchen scale."""
_UNITS = {"n": 1.0, "g": NEWTON_PER_GRAM}
_LARGEST_N = 1000.0
_FORM = "the first line must be such as `picture,load_g` or `picture,load_n`"


@dataclass(frozen=True)
class Load:
    """One line of the table.

    Attributes:
        picture: Name of the picture.
        load_n: Force of the ball on the gel; 0 without contact.
        sigma_n: Its standard deviation; infinite for a press whose load is not known.
        time_s: When the picture was taken; None where the table does not say.
    """

    picture: str
    load_n: float
    sigma_n: float
    time_s: float | None = None


def read_loads(path: str | os.PathLike[str]) -> tuple[Load, ...]:
    """Read the table of loads.

    Args:
        path: CSV file as described in the module, separated by commas, semicolons or tabs.

    Returns:
        The loads in the order of the file.

    Raises:
        PressError: The file cannot be read, a column is missing, a value is impossible, or a
            picture is named twice. The message names the file and the line.
    """
    place = Path(path)
    try:
        text = place.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise _refusal(place, f"{(error.strerror or 'cannot be read').lower()}; {_FORM}") from error
    except UnicodeDecodeError as error:
        raise _refusal(place, "it is not a text file in UTF-8; save the table as CSV") from error
    lines = text.splitlines()
    if not lines or not lines[0].strip():
        raise _refusal(place, f"it is empty; {_FORM}")
    separator = max(",;\t", key=lines[0].count)
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    head = [name.strip().lower() for name in next(rows)]
    unit = _load_unit(place, head)
    found: dict[str, Load] = {}
    for number, row in enumerate(rows, start=2):
        if not any(cell.strip() for cell in row):
            continue
        where = f"{place}, line {number}"
        if len(row) != len(head):
            raise _refusal(where, f"{len(row)} values for the {len(head)} columns of line 1")
        load = _load(where, dict(zip(head, (cell.strip() for cell in row), strict=True)), unit)
        if load.picture in found:
            raise _refusal(where, f"picture {load.picture} is in an earlier line too")
        found[load.picture] = load
    if not found:
        raise _refusal(place, "it names no picture; give a line for each")
    return tuple(found.values())


def _load_unit(place: Path, head: list[str]) -> str:
    """`n` or `g`, from the names of the columns."""
    units = [unit for unit in _UNITS if f"load_{unit}" in head]
    if "picture" not in head or len(units) != 1:
        raise _refusal(f"{place}, line 1", f"columns {', '.join(head)}: {_FORM}")
    known = {"picture", "time_s", *(f"{n}_{u}" for n in ("load", "sigma") for u in _UNITS)}
    strange = [name for name in head if name not in known]
    if strange:
        raise _refusal(
            f"{place}, line 1", f"column {strange[0]!r}: must be one of {', '.join(sorted(known))}"
        )
    return units[0]


def _load(where: str, row: Mapping[str, str], unit: str) -> Load:
    name = row["picture"]
    if not name:
        raise _refusal(where, "the name of the picture is missing")
    value = _number(where, row, f"load_{unit}") * _UNITS[unit]
    if not 0 <= value <= _LARGEST_N:
        raise _refusal(
            where,
            f"load_{unit} = {row[f'load_{unit}']}: must be 0 or more, at most {_LARGEST_N:g} N; "
            "a push on the gel is positive, and 0 marks a picture without contact",
        )
    sigma = math.hypot(LOAD_SHARE * value, SCALE_N)
    for kind, factor in _UNITS.items():
        if row.get(f"sigma_{kind}"):
            sigma = _number(where, row, f"sigma_{kind}") * factor
            if not sigma > 0:
                raise _refusal(where, f"sigma_{kind} = {row[f'sigma_{kind}']}: must be above 0")
    time_s = _number(where, row, "time_s") if row.get("time_s") else None
    return Load(name, value, sigma, time_s)


def _number(where: str, row: Mapping[str, str], column: str) -> float:
    text = row[column]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _refusal(
            where,
            f"{column} = {text!r}: must be a number with a decimal point, without a unit"
            if text
            else f"{column} is missing; give the load of picture {row['picture']}",
        )
    return value


def _refusal(where: object, reason: str) -> PressError:
    return PressError("table", f"{where}: {reason}")
