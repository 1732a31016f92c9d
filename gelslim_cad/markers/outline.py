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
    Clockwise input is reversed. Raises ValueError for fewer than three points (two with arcs),
    values that are not finite, repeated points or no enclosed area.
    """

    points_mm: NDArray[np.float64]
    bulges: NDArray[np.float64]

    def __post_init__(self) -> None:
        points = np.array(self.points_mm, dtype=np.float64)
        bulges = np.array(self.bulges, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or bulges.shape != points.shape[:1]:
            raise ValueError(
                f"outline: expected points (p, 2) and bulges (p,), got {points.shape} and "
                f"{bulges.shape}"
            )
        if not (np.isfinite(points).all() and np.isfinite(bulges).all()):
            raise ValueError("outline: every coordinate must be finite")
        if len(points) < (2 if np.any(bulges) else 3):
            raise ValueError(f"outline: {len(points)} points do not enclose an area")
        if np.any(np.all(points == np.roll(points, -1, axis=0), axis=1)):
            raise ValueError("outline: two consecutive points coincide; leave repeats out")
        area = _area(_flatten(points, bulges, 0.01))
        if abs(area) <= 1e-12 * np.ptp(points) ** 2:
            raise ValueError("outline: encloses no area")
        if area < 0:
            points, bulges = points[::-1], -np.roll(bulges[::-1], -1)
        for array, name in ((points, "points_mm"), (bulges, "bulges")):
            array = np.ascontiguousarray(array)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def polygon(cls, points_mm: ArrayLike) -> Outline:
        """Return an outline of straight pieces through `points_mm` (p, 2)."""
        points = np.asarray(points_mm, dtype=np.float64)
        if points.ndim == 2 and len(points) > 3 and np.array_equal(points[0], points[-1]):
            points = points[:-1]
        return cls(points, np.zeros(len(points)))

    @classmethod
    def rounded_rectangle(
        cls, length_mm: float, width_mm: float, corner_radius_mm: float = 0.0
    ) -> Outline:
        """Return a rectangle centred on the origin, `length_mm` along x and `width_mm` along y.

        Raises ValueError when the radius is negative or over half the shorter side.
        """
        if not (length_mm > 0 and width_mm > 0):
            raise ValueError(f"outline: {length_mm:g} x {width_mm:g} mm must be > 0 both ways")
        if not 0 <= corner_radius_mm <= min(length_mm, width_mm) / 2:
            raise ValueError(
                f"outline: corner radius {corner_radius_mm:g} mm must be between 0 and half the "
                f"shorter side, {min(length_mm, width_mm) / 2:g} mm"
            )
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

    @property
    def area_mm2(self) -> float:
        """Enclosed area; an arc of angle t and radius r adds r²(t - sin t)/2 to its chord."""
        chords = np.linalg.norm(np.roll(self.points_mm, -1, axis=0) - self.points_mm, axis=1)
        curved = self.bulges != 0
        bulge = self.bulges[curved]
        angle = 4 * np.arctan(bulge)
        radius = chords[curved] * (1 + bulge**2) / (4 * np.abs(bulge))
        return _area(self.points_mm) + float(np.sum(radius**2 * (angle - np.sin(angle)) / 2))

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


def as_outline(shape: Outline | ArrayLike) -> Outline:
    """Return `shape` itself or the polygon through its points (p, 2)."""
    return shape if isinstance(shape, Outline) else Outline.polygon(shape)


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
