"""Domed outer surfaces of the gel: height over the x-y plane, apex at z = 0, falling outwards."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import OutlineError

Array = NDArray[np.float64]


class Crown(Protocol):
    """The outer surface as z(x, y) <= 0."""

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """z of the outer surface over points; the arguments broadcast."""
        ...


@dataclass(frozen=True)
class Paraboloid:
    """z = -crown (x² + y²) / rim², the gel's shape in the CAD.

    Args:
        crown_mm: fall from the apex to the rim, > 0.
        rim_mm: distance of the outline's farthest points from the centre, > 0.

    Raises:
        OutlineError: a length is not finite and > 0.
    """

    crown_mm: float
    rim_mm: float

    def __post_init__(self) -> None:
        _require_positive(crown_mm=self.crown_mm, rim_mm=self.rim_mm)

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """z of the outer surface over points; the arguments broadcast."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        return np.asarray(-self.crown_mm / self.rim_mm**2 * (x * x + y * y))


@dataclass(frozen=True)
class Sphere:
    """z = √(R² - x² - y²) - R; constant at -R beyond the equator.

    Raises:
        OutlineError: the radius is not finite and > 0.
    """

    radius_mm: float

    def __post_init__(self) -> None:
        _require_positive(radius_mm=self.radius_mm)

    def height_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """z of the outer surface over points; the arguments broadcast."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        under = np.maximum(self.radius_mm**2 - x * x - y * y, 0.0)
        return np.asarray(np.sqrt(under) - self.radius_mm)


def _require_positive(**lengths_mm: float) -> None:
    for name, value in lengths_mm.items():
        if not (math.isfinite(value) and value > 0.0):
            raise OutlineError(f"{name} = {value!r}: must be a finite number > 0")
