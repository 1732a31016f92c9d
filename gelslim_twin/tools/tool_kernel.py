"""Compiled geometry of a tool: points in its frame, tangent planes, their frames, walls passed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

DIFFERENCE_MM = 1e-4
"""Step of the differences from which slopes are taken."""
MOST_SLOPE = 10.0
"""Largest slope; steeper flanks and walls are given this one."""
LEAST_SLOPE = 1e-9
"""What differences of a level face leave by rounding."""
BENT = 0.03
"""Rise over the last plane per distance above which a wall is searched on the path."""
ROUNDING_MM = 1e-7


@njit(cache=True)
def own_coordinates(points: Any, origin: Any, turn: Any, own: Any) -> None:
    """own (3, n) = points (n, 3) in the frame with this origin (3,) and the axes of turn (3, 3)."""
    for i in range(len(points)):
        x, y, z = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        for a in range(3):
            own[a, i] = x * turn[0, a] + y * turn[1, a] + z * turn[2, a]


@njit(cache=True)
def carried_points(points: Any, start: Any, turn: Any, end: Any, moved: Any) -> None:
    """moved (n, 3) = points (n, 3) turned by turn (3, 3) about `start`, which goes to `end`."""
    for i in range(len(points)):
        x, y, z = points[i, 0] - start[0], points[i, 1] - start[1], points[i, 2] - start[2]
        for a in range(3):
            moved[i, a] = turn[a, 0] * x + turn[a, 1] * y + turn[a, 2] * z + end[a]


@njit(cache=True)
def central_slope(behind: float, here: float, ahead: float) -> float:
    """Slope by the central difference; at a rim the one-sided difference within the tool."""
    up, down = (ahead - here) / DIFFERENCE_MM, (here - behind) / DIFFERENCE_MM
    if not math.isfinite(up):
        up = down
    if not math.isfinite(down):
        down = up
    # Next to a wall the slope is that of this side.
    if abs(up) > 2 * MOST_SLOPE and abs(down) <= MOST_SLOPE:
        up = down
    elif abs(down) > 2 * MOST_SLOPE and abs(up) <= MOST_SLOPE:
        down = up
    if not math.isfinite(up):
        return 0.0
    mean = (up + down) / 2
    if abs(mean) < LEAST_SLOPE:
        return 0.0
    return min(MOST_SLOPE, max(-MOST_SLOPE, mean))


@njit(cache=True)
def tangent_planes(
    own: Any, height: Any, on: Any, around: Any, origin: Any, turn: Any, met: Any, normal: Any
) -> None:
    """Points met (n, 3) and unit normals (n, 3) of tangent planes, in the sensor frame.

    own (3, n) and height (n,) are the points and the heights of the tool over them in its frame,
    around (4, m) the heights one step ahead and behind along x, then y, of the m points `on`; the
    other planes are level in the tool's frame.
    """
    tilted = turn[0, 2] != 0.0 or turn[1, 2] != 0.0
    for i in range(len(height)):
        outside = not math.isfinite(height[i])
        x, y, z = own[0, i], own[1, i], 0.0 if outside else height[i]
        for a in range(3):
            met[i, a] = turn[a, 0] * x + turn[a, 1] * y + turn[a, 2] * z + origin[a]
            normal[i, a] = turn[a, 2] if tilted else 0.0
        if not tilted:
            normal[i, 2] = 1.0
        if outside:
            met[i, 2] = np.inf
    for k in range(len(on)):
        i = on[k]
        sx = central_slope(around[1, k], height[i], around[0, k])
        sy = central_slope(around[3, k], height[i], around[2, k])
        if sx == 0.0 and sy == 0.0:
            continue
        size = math.sqrt(1.0 + sx * sx + sy * sy)
        for a in range(3):
            normal[i, a] = (turn[a, 2] - turn[a, 0] * sx - turn[a, 1] * sy) / size


@njit(cache=True)
def paths_to_walls(
    last: Any, normal: Any, turn: Any, own: Any, height: Any, lost: Any, steep: Any
) -> None:
    """Which points have left the tool, and which may have passed an upward wall.

    last (3, n) are the places on the tool where the points were, with the normals (n, 3) there; a
    point that was on none has an infinite place. own (3, n) and height (n,) are points and heights
    now. All but the normals in the frame of the tool, whose axes are the columns of turn (3, 3).
    Sets lost (n,) and steep (n,).
    """
    for i in range(len(height)):
        lost[i] = steep[i] = False
        if not math.isfinite(last[2, i]):
            continue
        if not math.isfinite(height[i]):
            lost[i] = True
            continue
        nx = normal[i, 0] * turn[0, 0] + normal[i, 1] * turn[1, 0] + normal[i, 2] * turn[2, 0]
        ny = normal[i, 0] * turn[0, 1] + normal[i, 1] * turn[1, 1] + normal[i, 2] * turn[2, 1]
        nz = normal[i, 0] * turn[0, 2] + normal[i, 1] * turn[1, 2] + normal[i, 2] * turn[2, 2]
        wx, wy = own[0, i] - last[0, i], own[1, i] - last[1, i]
        plane = last[2, i] - (wx * nx + wy * ny) / max(nz, 1e-9)
        steep[i] = height[i] - plane > BENT * math.sqrt(wx * wx + wy * wy) + ROUNDING_MM


@njit(cache=True)
def gaps_to_planes(met: Any, normal: Any, points: Any, gap: Any) -> None:
    """gap (n,) of points (n, 3) to planes through `met` (n, 3) along their normals (n, 3)."""
    for i in range(len(gap)):
        gap[i] = (
            (met[i, 0] - points[i, 0]) * normal[i, 0]
            + (met[i, 1] - points[i, 1]) * normal[i, 1]
            + (met[i, 2] - points[i, 2]) * normal[i, 2]
        )


@njit(cache=True)
def node_frames(normal: Any, frames: Any) -> None:
    """frames (n, 3, 3): in the columns two tangents and the unit normal (n, 3).

    The first tangent has no part along y, the second is the normal times the first.
    """
    for i in range(len(normal)):
        x, y, z = normal[i, 0], normal[i, 1], normal[i, 2]
        size = math.hypot(x, z)
        a, c = z / size, -x / size
        frames[i, 0, 0], frames[i, 1, 0], frames[i, 2, 0] = a, 0.0, c
        frames[i, 0, 1], frames[i, 1, 1], frames[i, 2, 1] = y * c, z * a - x * c, -y * a
        frames[i, 0, 2], frames[i, 1, 2], frames[i, 2, 2] = x, y, z
