"""Poses of a motion from a CSV table, with angles, quaternions or rotation matrices."""

from __future__ import annotations

import csv
import math
import os
from dataclasses import replace

from gelslim_core.yaml.errors import InputError, Problem, listed, shown
from gelslim_core.yaml.source import MAX_BYTES, read_source
from gelslim_core.yaml.suggest import closest
from gelslim_twin.scene.motion import MAX_POSES
from gelslim_twin.scene.pose import Pose

LIMITS = {
    "time_s": (0.0, 1e6),
    "x_mm": (-100.0, 100.0),
    "y_mm": (-100.0, 100.0),
    "depth_mm": (-50.0, 20.0),
    "twist_deg": (-3600.0, 3600.0),
    "tilt_x_deg": (-45.0, 45.0),
    "tilt_y_deg": (-45.0, 45.0),
}
ANGLES = ("twist_deg", "tilt_x_deg", "tilt_y_deg")
QUATERNION = ("qw", "qx", "qy", "qz")
MATRIX = tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))
PLACE = tuple(name for name in LIMITS if name not in ANGLES)
COLUMNS, REQUIRED = (*LIMITS, *QUATERNION, *MATRIX), ("time_s", "depth_mm")
UNIT = (-1.001, 1.001)
"""Limits of the entries of a quaternion and of a matrix, which may be rounded."""
NOT_RIGID = 1e-3
"""Largest deviation of a rotation that is read from an exact one."""


def read_pose_table(path: str | os.PathLike[str]) -> tuple[Pose, ...]:
    """The poses in the CSV file at `path`, times increasing; `#` begins a comment line.

    The first line names the columns: `time_s` and `depth_mm`, `x_mm` and `y_mm` where they are not
    0, and the rotation as `twist_deg`, `tilt_x_deg` and `tilt_y_deg`, as a unit quaternion `qw`,
    `qx`, `qy`, `qz`, or as a matrix by rows, `r11` to `r33`. Raises `InputError` with every fault
    found, by line.
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
        if found:
            # The load steps between two poses must not lead once round.
            whole = 360 * round((found[-1].twist_deg - pose.twist_deg) / 360)
            pose = pose if set(names) & set(ANGLES) else replace(
                pose, twist_deg=pose.twist_deg + whole
            )  # fmt: skip
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
    given = [group for group in (ANGLES, QUATERNION, MATRIX) if set(group) & set(names)]
    if len(given) > 1:
        both = f"has {given[0][0]} and {given[1][0]}, the rotation is given once"
        raise _refused(path, line, "", None, both, "keep angles, quaternion or matrix")
    whole = given[0] if given and given[0] != ANGLES else ()
    for name in (*REQUIRED, *whole):
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
        low, high = LIMITS.get(name, UNIT)
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
    if not all(math.isfinite(v) for v in values.values()):
        return None
    place = {name: value for name, value in values.items() if name in PLACE}
    if QUATERNION[0] in values or MATRIX[0] in values:
        return _turned(path, line, place, values, problems)
    return Pose(**values)


def _turned(
    path: str,
    line: int,
    place: dict[str, float],
    values: dict[str, float],
    problems: list[Problem],
) -> Pose | None:
    """The pose whose rotation is a quaternion or a matrix."""
    import numpy as np

    from gelslim_twin.scene.rotation import angles_deg, quaternion_matrix

    if QUATERNION[0] in values:
        four = np.array([values[name] for name in QUATERNION])
        size = float(np.linalg.norm(four))
        fault = "" if abs(size - 1) <= NOT_RIGID else f"the quaternion has the length {size:.4g}"
        turn = quaternion_matrix(*(four / size)) if size > 0 else np.eye(3)
        name, remedy = QUATERNION[0], "divide it by its length"
    else:
        given = np.array([values[name] for name in MATRIX]).reshape(3, 3)
        left, sizes, right = np.linalg.svd(given)
        turn, off = left @ right, float(np.abs(sizes - 1).max())
        mirrored = np.linalg.det(given) <= 0
        fault = f"the matrix is no rotation, by {off:.2g}" if off > NOT_RIGID or mirrored else ""
        name, remedy = MATRIX[0], "give a rotation without scale or reflection"
    twist, tilt_x, tilt_y = angles_deg(turn)
    low, high = LIMITS["tilt_x_deg"]
    if not fault and max(abs(tilt_x), abs(tilt_y)) > high:
        fault = f"tilts the tool by {tilt_x:.3g}° about x and {tilt_y:.3g}° about y"
        remedy = f"keep both from {low:g} to {high:g}; the tool is known from below only"
    if fault:
        problems.append(Problem(path, line, None, name, shown(f"{values[name]:g}"), fault, remedy))
        return None
    return Pose(**place, twist_deg=twist, tilt_x_deg=tilt_x, tilt_y_deg=tilt_y)
