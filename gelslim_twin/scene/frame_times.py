"""When frames are taken, and between which poses they lie."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from gelslim_twin.scene.pose import Pose


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
