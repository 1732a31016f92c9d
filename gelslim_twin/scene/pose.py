"""Where the tool is at one time, and the poses of a motion."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gelslim_twin.scene.motion import (
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
    names = ("x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg")
    for step in range(1, waypoint.steps):
        part = step / waypoint.steps
        values = {n: _blend(getattr(start, n), getattr(end, n), part) for n in names}
        yield Pose(time_s=start.time_s + part * waypoint.duration_s, **values)
    yield end


def _blend(a: float, b: float, part: float) -> float:
    # A coordinate that stays must stay to the bit.
    return a if a == b else a + part * (b - a)


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

    The last frame at an even rate is the last that is not after the last pose. Raises ValueError
    without poses or for a rate that is not positive.
    """
    if not poses:
        raise ValueError("a motion without poses has no frames")
    if frame_rate_hz is None:
        return tuple(FrameTime(pose.time_s, k, 0.0) for k, pose in enumerate(poses))
    if not (math.isfinite(frame_rate_hz) and frame_rate_hz > 0):
        raise ValueError(f"a frame rate of {frame_rate_hz} Hz: must be positive")
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
