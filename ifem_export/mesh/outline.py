"""Outlines of the gel in the x-y plane.

Every outline is closed: points on the boundary, within a rounding tolerance relative to the
outline's size, count as inside, so that a crop does not depend on the last bit of a cell centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import OutlineError

_BOUNDARY_RELATIVE = 1e-9
_MAX_POLYGON_POINTS = 4000


class Outline(Protocol):
    """A bounded region of the x-y plane."""

    @property
    def area_mm2(self) -> float:
        """Enclosed area."""
        ...

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max)."""
        ...

    def contains(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point lies inside or on the outline; the arguments broadcast."""
        ...


def _require_positive(name: str, value: float, *, zero_allowed: bool = False) -> None:
    low_enough = value < 0.0 or (value == 0.0 and not zero_allowed)
    if isinstance(value, bool) or not math.isfinite(value) or low_enough:
        raise OutlineError(
            f"{name} = {value!r}: must be a finite number {'>= 0' if zero_allowed else '> 0'}"
        )


@dataclass(frozen=True)
class RoundedRectangle:
    """Rectangle centred on the origin, length along x, width along y, circular corners.

    Raises:
        OutlineError: a side is not positive, or the radius exceeds half the shorter side.
    """

    length_mm: float
    width_mm: float
    corner_radius_mm: float = 0.0

    def __post_init__(self) -> None:
        _require_positive("length_mm", self.length_mm)
        _require_positive("width_mm", self.width_mm)
        _require_positive("corner_radius_mm", self.corner_radius_mm, zero_allowed=True)
        limit = min(self.length_mm, self.width_mm) / 2.0
        if self.corner_radius_mm > limit:
            raise OutlineError(
                f"corner_radius_mm = {self.corner_radius_mm!r}: must be <= {limit:g}, "
                "half the shorter side"
            )

    @property
    def area_mm2(self) -> float:
        """Length times width less the four corners, (4-π)r²."""
        return self.length_mm * self.width_mm - (4.0 - math.pi) * self.corner_radius_mm**2

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max)."""
        a, b = self.length_mm / 2.0, self.width_mm / 2.0
        return (-a, -b, a, b)

    def contains(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point lies inside or on the outline; the arguments broadcast."""
        r = self.corner_radius_mm
        tolerance = _BOUNDARY_RELATIVE * max(self.length_mm, self.width_mm)
        dx = np.abs(np.asarray(x_mm, dtype=float)) - (self.length_mm / 2.0 - r)
        dy = np.abs(np.asarray(y_mm, dtype=float)) - (self.width_mm / 2.0 - r)
        outside = np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0))
        return np.asarray(outside <= r + tolerance, dtype=bool)


@dataclass(frozen=True)
class Disc:
    """Disc centred on the origin.

    Raises:
        OutlineError: the radius is not positive.
    """

    radius_mm: float

    def __post_init__(self) -> None:
        _require_positive("radius_mm", self.radius_mm)

    @property
    def area_mm2(self) -> float:
        """π r²."""
        return math.pi * self.radius_mm**2

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max)."""
        r = self.radius_mm
        return (-r, -r, r, r)

    def contains(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point lies inside or on the outline; the arguments broadcast."""
        limit = self.radius_mm * (1.0 + _BOUNDARY_RELATIVE)
        return np.asarray(np.hypot(x_mm, y_mm) <= limit, dtype=bool)


@dataclass(frozen=True)
class Polygon:
    """Simple polygon, either orientation, last point not repeated.

    Args:
        points_mm: vertices ((x, y), ...), at least 3 and at most 4000.

    Raises:
        OutlineError: not enough points, not finite, repeated in a row, no area, or the edges
            cross or touch each other.
    """

    points_mm: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        points = np.asarray(self.points_mm, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
            raise OutlineError(
                f"points_mm has shape {points.shape}: must be (n, 2) with n >= 3 vertices"
            )
        if len(points) > _MAX_POLYGON_POINTS:
            raise OutlineError(
                f"points_mm has {len(points)} vertices: at most {_MAX_POLYGON_POINTS}; simplify it"
            )
        if not np.isfinite(points).all():
            raise OutlineError("points_mm holds a value that is not finite: check the vertices")
        object.__setattr__(self, "points_mm", tuple((float(x), float(y)) for x, y in points))
        _check_simple(points)

    @property
    def area_mm2(self) -> float:
        """Shoelace area."""
        return abs(_signed_area(np.asarray(self.points_mm)))

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max)."""
        points = np.asarray(self.points_mm)
        x_min, y_min = points.min(axis=0)
        x_max, y_max = points.max(axis=0)
        return (float(x_min), float(y_min), float(x_max), float(y_max))

    def contains(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point lies inside or on the outline; the arguments broadcast.

        Even-odd rule by edge crossings (half-open in y, so a vertex counts once), and then
        every point within the rounding tolerance of an edge.
        """
        x, y = np.broadcast_arrays(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float))
        start = np.asarray(self.points_mm)
        end = np.roll(start, -1, axis=0)
        x_min, y_min, x_max, y_max = self.bounds_mm
        tolerance = _BOUNDARY_RELATIVE * max(x_max - x_min, y_max - y_min)
        odd = np.zeros(x.shape, dtype=bool)
        on_edge = np.zeros(x.shape, dtype=bool)
        for (ax, ay), (bx, by) in zip(start, end, strict=True):
            ex, ey = bx - ax, by - ay
            if ey != 0.0:
                crosses = (ay > y) != (by > y)
                odd ^= crosses & (x < ax + (y - ay) * (ex / ey))
            t = np.clip(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
            on_edge |= np.hypot(x - ax - t * ex, y - ay - t * ey) <= tolerance
        return odd | on_edge


def _signed_area(points: NDArray[Any]) -> float:
    x, y = (points - points.mean(axis=0)).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2.0)


def _check_simple(points: NDArray[Any]) -> None:
    """Refuse repeated vertices, zero area, and edges that meet away from shared vertices."""
    end = np.roll(points, -1, axis=0)
    repeated = np.flatnonzero((points == end).all(axis=1))
    if len(repeated):
        raise OutlineError(
            f"points_mm[{repeated[0]}] is repeated by the next vertex: remove one of them "
            "(do not close the polygon by repeating the first vertex)"
        )
    extent = float(np.ptp(points, axis=0).max())
    if abs(_signed_area(points)) <= 1e-12 * extent**2:
        raise OutlineError("points_mm encloses no area: the vertices lie on one line")
    crossing = _first_crossing(points, end)
    if crossing is not None:
        raise OutlineError(
            f"points_mm: edges {crossing[0]} and {crossing[1]} cross or touch; "
            "give a simple polygon"
        )


def _first_crossing(start: NDArray[Any], end: NDArray[Any]) -> tuple[int, int] | None:
    n = len(start)
    for i in range(n - 1):
        others = np.arange(i + 1, n)
        a, b, c, d = start[i], end[i], start[others], end[others]
        d1, d2 = _side(a, b, c), _side(a, b, d)
        d3, d4 = _side(c, d, a), _side(c, d, b)
        low = np.minimum(c, d) <= np.maximum(a, b)
        high = np.maximum(c, d) >= np.minimum(a, b)
        boxes_meet = (low & high).all(axis=1)
        meets = boxes_meet & (d1 * d2 <= 0) & (d3 * d4 <= 0)
        follows, precedes = others == i + 1, (i == 0) & (others == n - 1)
        # Neighbours share a vertex by right; they overlap only when one folds back on the other.
        u = b - a
        along = np.einsum("ij,j->i", d - c, u)
        folds = (d1 == 0) & (d2 == 0) & (along < 0)
        meets = np.where(follows | precedes, folds, meets)
        hit = np.flatnonzero(meets)
        if len(hit):
            return i, int(others[hit[0]])
    return None


def _side(a: NDArray[Any], b: NDArray[Any], p: NDArray[Any]) -> NDArray[Any]:
    """Sign of the turn a→b→p; broadcasts over rows."""
    a, b, p = np.atleast_2d(a), np.atleast_2d(b), np.atleast_2d(p)
    cross = (b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (p[:, 0] - a[:, 0])
    return np.asarray(np.sign(cross))
