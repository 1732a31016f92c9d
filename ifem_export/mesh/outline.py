"""The gel's outline in the x-y plane.

Points on the boundary count as inside, within a rounding tolerance relative to the outline's
size, so that the cropped mesh does not depend on the last bit of a cell centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import OutlineError

_BOUNDARY_RELATIVE = 1e-9


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


def require_positive(name: str, value: float, *, zero_allowed: bool = False) -> None:
    """Raise OutlineError unless the length is finite and positive (or zero, where allowed)."""
    too_small = value < 0.0 or (value == 0.0 and not zero_allowed)
    if isinstance(value, bool) or not math.isfinite(value) or too_small:
        raise OutlineError(
            f"{name} = {value!r}: must be a finite number {'>= 0' if zero_allowed else '> 0'}",
            field=name,
            value=value,
        )


@dataclass(frozen=True)
class RoundedRectangle:
    """Rectangle centred on the origin with circular corners.

    Equal sides and a corner radius of half a side make a disc.

    Attributes:
        length_mm: Side along x, > 0.
        width_mm: Side along y, > 0.
        corner_radius_mm: Radius of the corners, from 0 to half the shorter side.

    Raises:
        OutlineError: A side is not positive, or the radius is out of range.
    """

    length_mm: float
    width_mm: float
    corner_radius_mm: float = 0.0

    def __post_init__(self) -> None:
        require_positive("length_mm", self.length_mm)
        require_positive("width_mm", self.width_mm)
        require_positive("corner_radius_mm", self.corner_radius_mm, zero_allowed=True)
        limit = min(self.length_mm, self.width_mm) / 2.0
        if self.corner_radius_mm > limit:
            raise OutlineError(
                f"corner_radius_mm = {self.corner_radius_mm!r}: must be <= {limit:g}, "
                "half the shorter side",
                field="corner_radius_mm",
                value=self.corner_radius_mm,
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
        """Whether each point lies inside or on the outline.

        Args:
            x_mm: Coordinates of the points; both arguments broadcast.
            y_mm: Likewise.

        Returns:
            Booleans of the broadcast shape.
        """
        r = self.corner_radius_mm
        tolerance = _BOUNDARY_RELATIVE * max(self.length_mm, self.width_mm)
        dx = np.abs(np.asarray(x_mm, dtype=float)) - (self.length_mm / 2.0 - r)
        dy = np.abs(np.asarray(y_mm, dtype=float)) - (self.width_mm / 2.0 - r)
        outside = np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0))
        return np.asarray(outside <= r + tolerance, dtype=bool)
