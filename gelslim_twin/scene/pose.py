"""The pose of the tool at one time, and the poses of a motion by waypoints or by a CSV table."""

from __future__ import annotations

import csv
import math
import os
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace

from gelslim_core.yaml.errors import InputError, Problem, listed, shown
from gelslim_core.yaml.source import MAX_BYTES, read_source
from gelslim_core.yaml.suggest import closest
from gelslim_twin.scene.motion import (
    MAX_POSES,
    Hold,
    Motion,
    Press,
    Release,
    Shear,
    Slide,
    Tilt,
    Twist,
    Waypoint,
)


@dataclass(frozen=True)
class Pose:
    """The tool at one time, in the sensor frame.

    `x_mm`, `y_mm` place the tool's origin, its lowest point when upright; `depth_mm` is how far
    that point is below the undeformed outer surface. The tool is first twisted about z, then
    tilted about the sensor's x, then about its y, all through that point.
    """

    time_s: float = 0.0
    x_mm: float = 0.0
    y_mm: float = 0.0
    depth_mm: float = 0.0
    twist_deg: float = 0.0
    tilt_x_deg: float = 0.0
    tilt_y_deg: float = 0.0

    def blended(self, later: Pose, part: float) -> Pose:
        """Linear interpolation to a later pose, at `part` (0 ... 1) of the way.

        A coordinate that does not change keeps its value to the last bit.
        """
        ends = zip(astuple(self), astuple(later), strict=True)
        return Pose(*(a if a == b else a + part * (b - a) for a, b in ends))


def poses(motion: Motion) -> tuple[Pose, ...]:
    """Poses of a motion by waypoints: the start, touching at depth 0 and time 0, then each step.

    Raises ValueError for a motion by table, which `read_motion_csv` reads.
    """
    if motion.waypoints is None:
        raise ValueError("this motion is a table: read it with read_motion_csv")
    pose = Pose(x_mm=motion.start_x_mm, y_mm=motion.start_y_mm)
    found = [pose]
    for waypoint in motion.waypoints:
        found += between(pose, waypoint)
        pose = found[-1]
    return tuple(found)


def between(start: Pose, waypoint: Waypoint) -> Iterator[Pose]:
    """The `waypoint.steps` poses from `start`, itself left out, to the end of the movement."""
    end = _end(start, waypoint)
    for step in range(1, waypoint.steps):
        part = step / waypoint.steps
        time_s = start.time_s + part * waypoint.duration_s
        yield replace(start.blended(end, part), time_s=time_s)
    yield end


def _end(start: Pose, waypoint: Waypoint) -> Pose:
    pose = replace(start, time_s=start.time_s + waypoint.duration_s)
    match waypoint:
        case Press():
            return replace(pose, depth_mm=waypoint.depth_mm)
        case Shear() | Slide():
            return replace(pose, x_mm=start.x_mm + waypoint.x_mm, y_mm=start.y_mm + waypoint.y_mm)
        case Twist():
            return replace(pose, twist_deg=start.twist_deg + waypoint.angle_deg)
        case Tilt() if waypoint.about == "x":
            return replace(pose, tilt_x_deg=start.tilt_x_deg + waypoint.angle_deg)
        case Tilt():
            return replace(pose, tilt_y_deg=start.tilt_y_deg + waypoint.angle_deg)
        case Release():
            return replace(pose, depth_mm=-waypoint.clearance_mm)
        case Hold():
            return pose


@dataclass(frozen=True)
class FrameTime:
    """A frame's time: `part` of the way from pose `before` to the next one (0: at the pose)."""

    time_s: float
    before: int
    part: float


def frame_times(poses: Sequence[Pose], frame_rate_hz: float | None = None) -> tuple[FrameTime, ...]:
    """Times of frames: one per pose, or from the first pose on at an even rate.

    The last frame at an even rate is the last that is not after the last pose.
    """
    if frame_rate_hz is None:
        return tuple(FrameTime(pose.time_s, k, 0.0) for k, pose in enumerate(poses))
    times = [pose.time_s for pose in poses]
    # A frame on the last pose must not be lost to rounding.
    count = math.floor((times[-1] - times[0]) * frame_rate_hz * (1 + 1e-12)) + 1
    return tuple(
        _between(times, min(times[-1], times[0] + k / frame_rate_hz)) for k in range(count)
    )


def _between(times: Sequence[float], time: float) -> FrameTime:
    before = min(bisect_right(times, time) - 1, len(times) - 1)
    if before == len(times) - 1:
        return FrameTime(time, before, 0.0)
    start, end = times[before], times[before + 1]
    return FrameTime(time, before, (time - start) / (end - start))


LIMITS = {
    "time_s": (0.0, 1e6),
    "x_mm": (-100.0, 100.0),
    "y_mm": (-100.0, 100.0),
    "depth_mm": (-50.0, 20.0),
    "twist_deg": (-3600.0, 3600.0),
    "tilt_x_deg": (-45.0, 45.0),
    "tilt_y_deg": (-45.0, 45.0),
}
COLUMNS, REQUIRED = tuple(LIMITS), ("time_s", "depth_mm")


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
