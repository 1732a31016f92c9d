"""Known loads of presses from a CSV file.

The first line names the columns: `picture`, then `load_n` in newtons or `load_g` in grams, and if
known `sigma_n` or `sigma_g`, the standard deviation of a load, and `time_s`. A load of 0 marks a
picture without contact.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gelslim_core.files.csv_table import Row, number_of, read_csv_table
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
    head, rows = read_csv_table(place, _FORM, _error)
    unit = _load_unit(place, head)
    found: dict[str, Load] = {}
    for where, row in rows:
        load = _load(where, row, unit)
        if load.picture in found:
            raise _refusal(where, f"picture {load.picture} is in an earlier line too")
        found[load.picture] = load
    if not found:
        raise _refusal(place, "it names no picture; give a line for each")
    return tuple(found.values())


def _load_unit(place: Path, head: Sequence[str]) -> str:
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


def _load(where: str, row: Row, unit: str) -> Load:
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


def _number(where: str, row: Row, column: str) -> float:
    value = number_of(where, row, column, _error)
    if math.isnan(value):
        raise _refusal(where, f"{column} is missing; give the load of picture {row['picture']}")
    return value


def _refusal(where: object, reason: str) -> PressError:
    return _error(f"{where}: {reason}")


def _error(message: str) -> PressError:
    return PressError("table", message)
