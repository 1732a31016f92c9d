"""First contact of two triangle meshes, one of which moves along a straight line.

Seen along the direction of motion, every point moves along its own line of sight. A body that
comes from far away therefore meets another where, on some line of sight, its farthest surface ends
up beyond the nearest surface of the other:

    moving  ====>  |  fixed        height h = coordinate along the motion
    h_moving > h_fixed on one line of sight: contact h_moving - h_fixed before the end

Only triangles of the moving body that look forwards, and triangles of the fixed one that look
backwards, can meet first. Over the common part of two triangles, seen along the motion, the
difference of the heights is linear, so that its extremes lie at the corners of that part: at
corners of one triangle inside the other, or where two edges cross. This is exact for the meshes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
LEAST_AREA_MM2 = 1e-12
"""Smaller triangles, as seen along the motion, are edges of others."""
CELL_MM = 0.8
"""Cell of the grid that sorts out which triangles may meet."""
MOST_CELLS = 1 << 20
MOST_PAIRS = 1 << 17
NONE = np.empty(0, dtype=np.int64)
INSIDE = 1e-9
"""Relative tolerance of the test whether a point lies inside a triangle."""


@dataclass(frozen=True)
class Surface:
    """Closed meshes of several bodies.

    Attributes:
        corners_mm: Corners of the triangles, counter-clockwise seen from outside, (n, 3, 3).
        body: Number of the body that each triangle belongs to, (n,).
    """

    corners_mm: Floats
    body: Integers

    @classmethod
    def joined(cls, surfaces: list[Floats]) -> Surface:
        """One surface of many, whose bodies are numbered in their order."""
        counts = [len(corners) for corners in surfaces]
        corners = np.concatenate(surfaces) if surfaces else np.empty((0, 3, 3))
        return cls(corners, np.repeat(np.arange(len(surfaces)), counts))


@dataclass(frozen=True)
class Contact:
    """Where a motion ends too early.

    Attributes:
        short_mm: Rest of the way that is blocked.
        moving: Number of the moving body.
        fixed: Number of the body that it meets.
        point_mm: Where they meet, (3,).
    """

    short_mm: float
    moving: int
    fixed: int
    point_mm: tuple[float, float, float]


@dataclass(frozen=True)
class _Seen:
    """Triangles as seen along the motion: corners (n, 3, 2) and their heights (n, 3)."""

    plane_mm: Floats
    height_mm: Floats
    body: Integers

    @property
    def low_mm(self) -> Floats:
        """Lower corner of the box around each triangle (n, 2)."""
        return np.asarray(self.plane_mm.min(axis=1))

    @property
    def high_mm(self) -> Floats:
        """Upper corner of the box around each triangle (n, 2)."""
        return np.asarray(self.plane_mm.max(axis=1))

    def __getitem__(self, chosen: NDArray[np.bool_] | Integers) -> _Seen:
        return _Seen(self.plane_mm[chosen], self.height_mm[chosen], self.body[chosen])


def first_contact(
    moving: Surface,
    fixed: Surface,
    direction: tuple[float, float, float],
    length_mm: float = math.inf,
) -> Contact | None:
    """Find the first contact of bodies that move along a straight line.

    Args:
        moving: The moving bodies at the end of their way.
        fixed: The bodies that stay.
        direction: Direction of the motion; its length does not matter.
        length_mm: Length of the way. A body that starts at a finite distance must be free there.

    Returns:
        The contact that comes first, or None where the way is free.
    """
    axes = _axes(direction)
    ahead, behind = _seen(moving, axes, 1), _seen(fixed, axes, -1)
    ahead, behind = _may_meet(ahead, behind, length_mm)
    best: Contact | None = None
    for first, second in _pairs(ahead, behind, length_mm):
        found = _earliest(ahead[first], behind[second], length_mm)
        if found is not None and (best is None or found[0] > best.short_mm):
            short, pair, place, height = found
            point = (place[0] * axes[0] + place[1] * axes[1] + height * axes[2]).tolist()
            best = Contact(
                short,
                int(ahead.body[first[pair]]),
                int(behind.body[second[pair]]),
                (point[0], point[1], point[2]),
            )
    return best


def _axes(direction: tuple[float, float, float]) -> Floats:
    """Right-handed unit vectors as rows, the last along the motion."""
    along = np.asarray(direction, dtype=float)
    along = along / np.linalg.norm(along)
    other = np.zeros(3)
    other[int(np.argmin(np.abs(along)))] = 1.0
    across = np.cross(other, along)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(along, across), along])


def _seen(surface: Surface, axes: Floats, side: int) -> _Seen:
    """The triangles that look forwards (1) or backwards (-1), all counter-clockwise."""
    turned = surface.corners_mm @ axes.T
    plane, height = turned[..., :2], turned[..., 2]
    shown = side * _twice_area(plane[:, 0], plane[:, 1], plane[:, 2]) > LEAST_AREA_MM2
    order = [0, 1, 2] if side > 0 else [0, 2, 1]
    return _Seen(plane[shown][:, order], height[shown][:, order], surface.body[shown])


def _twice_area(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the signed area of triangles, corners (..., 2)."""
    u, v = b - a, c - a
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _may_meet(ahead: _Seen, behind: _Seen, length_mm: float) -> tuple[_Seen, _Seen]:
    """Leave out the triangles that cannot meet any of the other side."""
    if not len(ahead.body) or not len(behind.body):
        return ahead, behind
    low = np.maximum(ahead.low_mm.min(axis=0), behind.low_mm.min(axis=0))
    high = np.minimum(ahead.high_mm.max(axis=0), behind.high_mm.max(axis=0))
    ahead, behind = (s[((s.high_mm >= low) & (s.low_mm <= high)).all(axis=1)] for s in
                     (ahead, behind))  # fmt: skip
    if (high < low).any() or not len(ahead.body) or not len(behind.body):
        return ahead[NONE], behind[NONE]
    grid = _Grid.over(low, high)
    nearest = grid.extreme(behind, behind.height_mm.min(axis=1))
    ahead = ahead[ahead.height_mm.max(axis=1) > grid.least(ahead, nearest)]
    if not len(ahead.body):
        return ahead, behind[NONE]
    farthest = -grid.extreme(ahead, -ahead.height_mm.max(axis=1))
    behind = behind[behind.height_mm.min(axis=1) < -grid.least(behind, -farthest)]
    return ahead, behind


@dataclass(frozen=True)
class _Grid:
    """Cells in the plane across the motion."""

    low_mm: Floats
    cell_mm: float
    shape: tuple[int, int]

    @classmethod
    def over(cls, low: Floats, high: Floats) -> _Grid:
        """Cells over a rectangle, larger ones where there would be too many."""
        spread = high - low
        cell = max(CELL_MM, math.sqrt(float(spread[0] * spread[1]) / MOST_CELLS))
        counts = np.floor(spread / cell).astype(int) + 1
        return cls(low, cell, (int(counts[0]), int(counts[1])))

    def _cells(self, seen: _Seen) -> tuple[Integers, Integers]:
        """Cells under the triangles' boxes, and where those of each triangle begin."""
        most = np.array(self.shape) - 1
        start = np.floor((seen.low_mm - self.low_mm) / self.cell_mm).astype(np.int64)
        end = np.floor((seen.high_mm - self.low_mm) / self.cell_mm).astype(np.int64)
        start, end = np.clip(start, 0, most), np.clip(end, 0, most)
        wide, tall = (end - start + 1).T
        count = wide * tall
        begin = np.concatenate([[0], np.cumsum(count)[:-1]])
        inner = np.arange(int(count.sum())) - np.repeat(begin, count)
        height = np.repeat(tall, count)
        column = np.repeat(start[:, 0], count) + inner // height
        row = np.repeat(start[:, 1], count) + inner % height
        return column * self.shape[1] + row, begin

    def extreme(self, seen: _Seen, values: Floats) -> Floats:
        """Least value of the triangles over each cell; infinite where there is none."""
        cells, begin = self._cells(seen)
        counts = np.diff(np.append(begin, len(cells)))
        least = np.full(self.shape[0] * self.shape[1], np.inf)
        np.minimum.at(least, cells, np.repeat(values, counts))
        return least

    def least(self, seen: _Seen, over: Floats) -> Floats:
        """Least value of the cells under each triangle."""
        cells, begin = self._cells(seen)
        return np.asarray(np.minimum.reduceat(over[cells], begin))


def _pairs(ahead: _Seen, behind: _Seen, length_mm: float) -> Iterator[tuple[Integers, Integers]]:
    """Pairs of triangles whose boxes allow a contact, in portions."""
    if not len(ahead.body) or not len(behind.body):
        return
    low, high = behind.low_mm, behind.high_mm
    near, far = behind.height_mm.min(axis=1), behind.height_mm.max(axis=1)
    rows = max(1, (MOST_PAIRS << 3) // len(near))
    for start in range(0, len(ahead.body), rows):
        part = ahead[np.arange(start, min(start + rows, len(ahead.body)))]
        here_low, here_high = part.low_mm[:, None], part.high_mm[:, None]
        meets = part.height_mm.max(axis=1)[:, None] > near
        if math.isfinite(length_mm):
            meets &= part.height_mm.min(axis=1)[:, None] - length_mm <= far
        for k in (0, 1):
            meets &= (here_high[..., k] >= low[:, k]) & (here_low[..., k] <= high[:, k])
        first, second = np.nonzero(meets)
        for cut in range(0, len(first), MOST_PAIRS):
            yield first[cut : cut + MOST_PAIRS] + start, second[cut : cut + MOST_PAIRS]


def _earliest(
    ahead: _Seen, behind: _Seen, length_mm: float
) -> tuple[float, int, Floats, float] | None:
    """The earliest contact of pairs: way that is left, pair, place across, height."""
    places, up, low = _corners_of_common_part(ahead, behind)
    over = up - low
    over[np.isnan(over)] = -np.inf
    most = over.max(axis=1)
    least = np.where(np.isinf(over), np.inf, over).min(axis=1)
    blocked = (most > 0) & (least <= length_mm)
    if not blocked.any():
        return None
    short = np.where(blocked, np.minimum(most, length_mm), -np.inf)
    pair = int(short.argmax())
    corner = int(over[pair].argmax())
    return float(short[pair]), pair, places[pair, corner], float(low[pair, corner])


def _corners_of_common_part(ahead: _Seen, behind: _Seen) -> tuple[Floats, Floats, Floats]:
    """Corners (n, 15, 2) with the heights of both triangles there; heights are NaN for no corner.

    They are the corners of each triangle inside the other, and the crossings of their edges.
    """
    a, b = ahead.plane_mm, behind.plane_mm
    over_b = _interpolated(b, behind.height_mm, a)
    over_a = _interpolated(a, ahead.height_mm, b)
    places, up, low = [a, b], [ahead.height_mm, over_a], [over_b, behind.height_mm]
    for i in range(3):
        for j in range(3):
            there, along_a, along_b = _crossing(
                a[:, i], a[:, (i + 1) % 3], b[:, j], b[:, (j + 1) % 3]
            )
            places.append(there[:, None])
            for heights, share, into in (
                (ahead.height_mm, along_a, up),
                (behind.height_mm, along_b, low),
            ):
                k = i if into is up else j
                start, end = heights[:, k], heights[:, (k + 1) % 3]
                into.append((start + share * (end - start))[:, None])
    return np.concatenate(places, axis=1), np.concatenate(up, axis=1), np.concatenate(low, axis=1)


def _interpolated(triangle: Floats, heights: Floats, points: Floats) -> Floats:
    """Heights (n, 3) of triangles (n, 3, 2) at three points each; NaN outside."""
    corner = [triangle[:, k, None] for k in range(3)]
    whole = _twice_area(corner[0], corner[1], corner[2])
    shares = np.stack(
        [_twice_area(points, corner[(k + 1) % 3], corner[(k + 2) % 3]) / whole for k in range(3)],
        axis=-1,
    )
    inside = (shares >= -INSIDE).all(axis=-1)
    return np.where(inside, (shares * heights[:, None]).sum(axis=-1), np.nan)


def _crossing(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats, Floats]:
    """Crossings (n, 2) of edges ab and cd, and the share of each edge before it; NaN if none."""
    run, other, gap = b - a, d - c, c - a
    det = run[:, 0] * other[:, 1] - run[:, 1] * other[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (gap[:, 0] * other[:, 1] - gap[:, 1] * other[:, 0]) / det
        t = (gap[:, 0] * run[:, 1] - gap[:, 1] * run[:, 0]) / det
        found = (s >= -INSIDE) & (s <= 1 + INSIDE) & (t >= -INSIDE) & (t <= 1 + INSIDE)
        s, t = np.where(found, s, np.nan), np.where(found, t, np.nan)
        return a + s[:, None] * run, s, t
