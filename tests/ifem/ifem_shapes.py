"""Outlines and outer surfaces that no finger of ours has, for pads of other shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from ifem_export.mesh.outline import RoundedRectangle


def disc(radius_mm: float) -> RoundedRectangle:
    return RoundedRectangle(2 * radius_mm, 2 * radius_mm, radius_mm)


class Polygon:
    """An outline by its vertices, closed within a rounding tolerance."""

    def __init__(self, points_mm: ArrayLike) -> None:
        self.shape = shapely.Polygon(np.asarray(points_mm, dtype=float))
        assert self.shape.is_valid
        self._closed = self.shape.buffer(1e-9, join_style="mitre")
        shapely.prepare(self._closed)

    @property
    def area_mm2(self) -> float:
        return float(self.shape.area)

    @property
    def bounds_mm(self) -> tuple[float, float, float, float]:
        x_min, y_min, x_max, y_max = self.shape.bounds
        return (x_min, y_min, x_max, y_max)

    def contains(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.bool_]:
        x, y = np.broadcast_arrays(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float))
        return np.asarray(shapely.intersects_xy(self._closed, x, y))


@dataclass(frozen=True)
class Sphere:
    """A spherical crown, z = √(R² - x² - y²) - R."""

    radius_mm: float

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.float64]:
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        under = np.maximum(self.radius_mm**2 - x * x - y * y, 0.0)
        return np.asarray(np.sqrt(under) - self.radius_mm)
