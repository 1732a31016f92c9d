"""A motion as a table: a CSV file with one pose per line."""

from __future__ import annotations

import csv
import math
import os
from dataclasses import fields

from gelslim_core.yaml.errors import InputError, Problem, listed, shown
from gelslim_core.yaml.source import MAX_BYTES, read_source
from gelslim_core.yaml.suggest import closest
from gelslim_twin.scene.motion import MAX_POSES
from gelslim_twin.scene.pose import Pose

COLUMNS = tuple(field.name for field in fields(Pose))
REQUIRED = ("time_s", "depth_mm")
LIMITS = {
    "time_s": (0.0, 1e6),
    "x_mm": (-100.0, 100.0),
    "y_mm": (-100.0, 100.0),
    "depth_mm": (-50.0, 20.0),
    "twist_deg": (-3600.0, 3600.0),
    "tilt_x_deg": (-45.0, 45.0),
    "tilt_y_deg": (-45.0, 45.0),
}


def read_motion_csv(path: str | os.PathLike[str]) -> tuple[Pose, ...]:
    """The poses in the CSV file at `path`, times increasing; `#` begins a comment line.

    The first line names the columns: `time_s` and `depth_mm`, and any of the others that `Pose`
    has. Raises `InputError` with every fault found, by line.
    """
    source = read_source(path, 10 * MAX_BYTES)
    rows = [
        (number, next(csv.reader([line])))
        for number, line in enumerate(source.text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise _refused(source.path, None, "", None, "is empty", f"begin with {','.join(COLUMNS)}")
    names = _header(source.path, *rows[0])
    problems: list[Problem] = []
    found: list[Pose] = []
    for number, cells in rows[1:]:
        pose = _pose(source.path, number, names, cells, problems)
        if pose is None:
            continue
        if found and pose.time_s <= found[-1].time_s:
            message = f"must be above the time of the line before, {found[-1].time_s:g} s"
            problems.append(
                Problem(
                    source.path, number, None, "time_s", f"{pose.time_s:g}", message, "sort lines"
                )
            )
        found.append(pose)
    if problems:
        raise listed(problems)
    if not found:
        raise _refused(source.path, rows[0][0], "", None, "has no poses", "add lines of numbers")
    if len(found) > MAX_POSES:
        message = f"has {len(found)} poses, the limit is {MAX_POSES}"
        raise _refused(source.path, None, "", None, message, "keep fewer lines")
    return tuple(found)


def _refused(
    path: str, line: int | None, field: str, value: str | None, message: str, remedy: str
) -> InputError:
    return InputError((Problem(path, line, None, field, value, message, remedy),))


def _header(path: str, line: int, cells: list[str]) -> tuple[str, ...]:
    names = tuple(cell.strip() for cell in cells)
    for name in names:
        if name not in COLUMNS:
            near = closest(name, list(COLUMNS))
            remedy = f"did you mean {near}?" if near else f"the columns are {', '.join(COLUMNS)}"
            raise _refused(path, line, "", shown(name), "unknown column", remedy)
        if names.count(name) > 1:
            raise _refused(path, line, "", name, "column given twice", "delete one")
    for name in REQUIRED:
        if name not in names:
            raise _refused(path, line, name, None, "column missing", f"add the column {name}")
    return names


def _pose(
    path: str, line: int, names: tuple[str, ...], cells: list[str], problems: list[Problem]
) -> Pose | None:
    if len(cells) != len(names):
        message = f"has {len(cells)} values for {len(names)} columns"
        problems.append(Problem(path, line, None, "", None, message, "give one value per column"))
        return None
    values: dict[str, float] = {}
    for name, cell in zip(names, cells, strict=True):
        low, high = LIMITS[name]
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            message = f"must be a number from {low:g} to {high:g}"
            problems.append(
                Problem(path, line, None, name, shown(cell.strip()), message, "correct the value")
            )
        values[name] = value
    return Pose(**values) if all(math.isfinite(v) for v in values.values()) else None
