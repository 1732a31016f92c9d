"""The poses of a path that a probe solves: the hardest ones, and some between."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.scene.pose import Pose

MOST_POSES, STRAIGHT_POSES, RECEDING_POSES = 12, 4, 24
"""Poses of the path that a probe solves on a linear gel, those in contact of a straight press, of
which the deepest is the hardest, and of one that holds the tool back."""
HOLDS_BACK = 1.0
"""Friction from which gel may hold a tool with walls on its way out, at a single pose by ten times
what friction adds at the deepest (random scene 3137)."""


def straight_poses(circumstances: Circumstances) -> int:
    """Number of poses of a straight press that a probe solves."""
    c = circumstances
    held_back = c.motion.recedes and c.has_walls and c.friction >= HOLDS_BACK
    return RECEDING_POSES if held_back else STRAIGHT_POSES


def pressed_poses(poses: Sequence[Pose], most: int, with_fastest: bool = False) -> tuple[Pose, ...]:
    """A few poses of a straight press, in order: the deepest, and others evenly in contact.

    With `with_fastest` the two poses between which the tool is fastest are among them.
    """
    fastest = _fastest(poses, 0.0) if with_fastest else set[int]()
    # Of a tool that is held the last pose tells most, since forces relax until then.
    able = [
        k
        for k, pose in enumerate(poses)
        if pose.depth_mm > 0 and (k + 1 == len(poses) or pose.depth_mm != poses[k + 1].depth_mm)
    ]
    if not able:
        return probed_poses(poses)
    kept = {max(able, key=lambda k: poses[k].depth_mm), able[-1], *fastest}
    _spread(kept, able, most + len(fastest))
    return tuple(poses[k] for k in sorted(kept))


def _spread(kept: set[int], able: Sequence[int], most: int) -> None:
    """Add those of `able` that lie farthest from those kept, until there are `most`."""
    while len(kept) < most and (left := [k for k in able if k not in kept]):
        kept.add(max(left, key=lambda k: min(abs(k - other) for other in kept)))


def probed_poses(poses: Sequence[Pose], reach_mm: float | None = None) -> tuple[Pose, ...]:
    """A few poses of a path, in order: its extremes, its end, and others evenly between.

    Extremes are the deepest pose, the one farthest aside from where the deepest is, and those of
    the largest twist and tilt. With `reach_mm`, the distance from the axis of the tool to the rim
    of the contact, the two poses between which the tool is fastest are among them.
    """
    most = MOST_POSES
    fastest = set[int]() if reach_mm is None else _fastest(poses, reach_mm)
    most += len(fastest)
    if len(poses) <= most:
        return tuple(poses)
    every = range(len(poses))
    deepest = max(every, key=lambda k: poses[k].depth_mm)
    still = poses[deepest]

    def aside(k: int) -> float:
        return (poses[k].x_mm - still.x_mm) ** 2 + (poses[k].y_mm - still.y_mm) ** 2

    kept = {
        deepest,
        len(poses) - 1,
        max(every, key=aside),
        max(every, key=lambda k: abs(poses[k].twist_deg - still.twist_deg)),
        max(every, key=lambda k: abs(poses[k].tilt_x_deg) + abs(poses[k].tilt_y_deg)),
        *fastest,
    }
    _spread(kept, every, most)
    return tuple(poses[k] for k in sorted(kept))


def _fastest(poses: Sequence[Pose], reach_mm: float) -> set[int]:
    """The two poses between which the tool in contact moves fastest."""

    def speed(k: int) -> float:
        a, b = poses[k - 1], poses[k]
        if max(a.depth_mm, b.depth_mm) <= 0:
            return 0.0
        turns = (
            b.twist_deg - a.twist_deg,
            b.tilt_x_deg - a.tilt_x_deg,
            b.tilt_y_deg - a.tilt_y_deg,
        )
        turned_mm = reach_mm * math.radians(sum(map(abs, turns)))
        way_mm = math.dist((a.x_mm, a.y_mm, a.depth_mm), (b.x_mm, b.y_mm, b.depth_mm))
        return (way_mm + turned_mm) / (b.time_s - a.time_s)

    if len(poses) < 2:
        return set()
    last = max(range(1, len(poses)), key=speed)
    return {last - 1, last}
