"""A closed outline of straight and circular pieces, exact in every file format."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed, anticlockwise outline in the sensor frame, in mm.

    `points_mm` (p, 2) without repeating the first. `bulges` (p,): each piece's tan(angle / 4)
    from a point to the next, as in DXF; 0 is straight, positive turns left (anticlockwise).
    Clockwise input is reversed.
    """

    points_mm: NDArray[np.float64]
    bulges: NDArray[np.float64]

    def __post_init__(self) -> None:
        points = np.array(self.points_mm, dtype=np.float64)
        bulges = np.array(self.bulges, dtype=np.float64)
        if _area(_flatten(points, bulges, 0.01)) < 0:
            points, bulges = points[::-1], -np.roll(bulges[::-1], -1)
        for array, name in ((points, "points_mm"), (bulges, "bulges")):
            array = np.ascontiguousarray(array)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def polygon(cls, points_mm: ArrayLike) -> Outline:
        """Return an outline of straight pieces through `points_mm` (p, 2)."""
        points = np.asarray(points_mm, dtype=np.float64)
        return cls(points, np.zeros(len(points)))

    @classmethod
    def rounded_rectangle(
        cls, length_mm: float, width_mm: float, corner_radius_mm: float = 0.0
    ) -> Outline:
        """Return a rectangle centred on the origin, `length_mm` along x and `width_mm` along y.

        The radius is at most half the shorter side.
        """
        a, b, r = length_mm / 2, width_mm / 2, corner_radius_mm
        if r == 0:
            return cls.polygon([(-a, -b), (a, -b), (a, b), (-a, b)])
        points = [(r - a, -b), (a - r, -b), (a, r - b), (a, b - r)]
        points += [(a - r, b), (r - a, b), (-a, b - r), (-a, r - b)]
        arc = np.tan(np.pi / 8)
        return cls(*_without_repeats(np.array(points), np.tile([0.0, arc], 4)))

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        """Return (x least, y least, x greatest, y greatest); arcs within 0.001 mm."""
        flat = self.flattened(0.001)
        low, high = flat.min(axis=0), flat.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def flattened(self, tolerance_mm: float = 0.005) -> NDArray[np.float64]:
        """Return points (n, 2) of a polygon that keeps within `tolerance_mm` of the outline."""
        return _flatten(self.points_mm, self.bulges, tolerance_mm)

    def contains(self, points_mm: ArrayLike) -> NDArray[np.bool_]:
        """Return which of `points_mm` (n, 2) lie inside, by even-odd crossings along x."""
        points = np.asarray(points_mm, dtype=np.float64)
        inside = np.zeros(len(points), dtype=bool)
        flat = self.flattened()
        for (x0, y0), (x1, y1) in zip(flat, np.roll(flat, -1, axis=0), strict=True):
            if y0 == y1:
                continue
            crosses = (points[:, 1] < y0) != (points[:, 1] < y1)
            inside ^= crosses & (points[:, 0] < x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0))
        return inside

    def mirrored(self) -> Outline:
        """Return the mirror image in the x axis, as seen from inside the gel."""
        return Outline(self.points_mm * [1.0, -1.0], -self.bulges)


def arc_centre(
    start: NDArray[np.float64], end: NDArray[np.float64], bulge: float
) -> NDArray[np.float64]:
    """Return the centre (2,) of the arc from `start` to `end`; `bulge` must not be 0."""
    chord = end - start
    normal = np.array([-chord[1], chord[0]])
    return (start + end) / 2 + normal * (1 - bulge**2) / (4 * bulge)


def _without_repeats(
    points: NDArray[np.float64], bulges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    keep = np.any(np.abs(points - np.roll(points, -1, axis=0)) > 1e-9, axis=1)
    return points[keep], bulges[keep]


def _area(points: NDArray[np.float64]) -> float:
    after = np.roll(points, -1, axis=0)
    return float(np.sum(points[:, 0] * after[:, 1] - after[:, 0] * points[:, 1]) / 2)


def _flatten(
    points: NDArray[np.float64], bulges: NDArray[np.float64], tolerance_mm: float
) -> NDArray[np.float64]:
    pieces = []
    for start, end, bulge in zip(points, np.roll(points, -1, axis=0), bulges, strict=True):
        pieces.append(start[None, :])
        if bulge == 0:
            continue
        centre = arc_centre(start, end, float(bulge))
        radius = float(np.hypot(*(start - centre)))
        angle = 4 * np.arctan(float(bulge))
        widest = 2 * np.arccos(max(1 - tolerance_mm / radius, 0.0))
        steps = int(np.ceil(abs(angle) / widest))
        turn = np.arctan2(*(start - centre)[::-1]) + angle * np.arange(1, steps) / steps
        pieces.append(centre + radius * np.column_stack([np.cos(turn), np.sin(turn)]))
    return np.vstack(pieces)
