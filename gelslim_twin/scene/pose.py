"""The pose of the tool at one time, the poses of a motion by waypoints, and times of frames."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace

from gelslim_twin.scene.motion import (
    Hold,
    Motion,
    Press,
    Release,
    Roll,
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

    Raises ValueError for a motion by table, which `read_pose_table` reads.
    """
    if motion.waypoints is None:
        raise ValueError("this motion is a table: read it with read_pose_table")
    pose = Pose(
        x_mm=motion.start_x_mm,
        y_mm=motion.start_y_mm,
        twist_deg=motion.start_twist_deg,
        tilt_x_deg=motion.start_tilt_x_deg,
        tilt_y_deg=motion.start_tilt_y_deg,
    )
    found, raised = [pose], 0.0
    for waypoint in motion.waypoints:
        found += between(pose, waypoint, raised)
        if isinstance(waypoint, Roll):
            raised += pose.depth_mm - found[-1].depth_mm
        pose = found[-1]
    return tuple(found)


def between(start: Pose, waypoint: Waypoint, raised_mm: float = 0.0) -> Iterator[Pose]:
    """The `waypoint.steps` poses from `start`, itself left out, to the end of the movement.

    `raised_mm` is how far rolling has lifted the tool's origin over the lowest point of the wheel,
    whose depth the waypoints give.
    """
    if isinstance(waypoint, Roll):
        for step in range(1, waypoint.steps + 1):
            yield _rolled(start, waypoint, step / waypoint.steps)
        return
    end = _end(start, waypoint, raised_mm)
    for step in range(1, waypoint.steps):
        part = step / waypoint.steps
        time_s = start.time_s + part * waypoint.duration_s
        yield replace(start.blended(end, part), time_s=time_s)
    yield end


def _rolled(start: Pose, roll: Roll, part: float) -> Pose:
    """The pose after a part of a roll.

    The centre of the wheel is `radius_mm` above the tool's origin along its axis. It moves level by
    the radius times the angle, to +x about +y and to -y about +x, and the tool turns about it.
    """
    angle = part * roll.angle_deg
    way = roll.radius_mm * math.radians(angle)
    turned = (
        replace(start, tilt_x_deg=start.tilt_x_deg + angle)
        if roll.about == "x"
        else replace(start, tilt_y_deg=start.tilt_y_deg + angle)
    )
    before, after = _axis(start), _axis(turned)
    dx, dy, dz = (roll.radius_mm * (a - b) for a, b in zip(before, after, strict=True))
    return replace(
        turned,
        time_s=start.time_s + part * roll.duration_s,
        x_mm=start.x_mm + dx + (way if roll.about == "y" else 0.0),
        y_mm=start.y_mm + dy - (way if roll.about == "x" else 0.0),
        depth_mm=start.depth_mm - dz,
    )


def _axis(pose: Pose) -> tuple[float, float, float]:
    """Direction of the tool's axis, the third column of its rotation."""
    a, b = math.radians(pose.tilt_x_deg), math.radians(pose.tilt_y_deg)
    return math.cos(a) * math.sin(b), -math.sin(a), math.cos(a) * math.cos(b)


def _end(start: Pose, waypoint: Waypoint, raised_mm: float) -> Pose:
    pose = replace(start, time_s=start.time_s + waypoint.duration_s)
    match waypoint:
        case Press():
            return replace(pose, depth_mm=waypoint.depth_mm - raised_mm)
        case Shear() | Slide():
            return replace(pose, x_mm=start.x_mm + waypoint.x_mm, y_mm=start.y_mm + waypoint.y_mm)
        case Twist():
            return replace(pose, twist_deg=start.twist_deg + waypoint.angle_deg)
        case Tilt() if waypoint.about == "x":
            return replace(pose, tilt_x_deg=start.tilt_x_deg + waypoint.angle_deg)
        case Tilt():
            return replace(pose, tilt_y_deg=start.tilt_y_deg + waypoint.angle_deg)
        case Release():
            return replace(pose, depth_mm=-waypoint.clearance_mm - raised_mm)
        case Roll():
            return _rolled(start, waypoint, 1.0)
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
