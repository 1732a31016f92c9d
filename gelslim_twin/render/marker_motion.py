"""Displacement given at the markers themselves, with the strain about them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MarkerMotion:
    """Displacement (m, 3) of the dots' centres and its gradient (m, 3, 2) along x and y.

    Zeros for the gradient carry the dots along undistorted. Raises ValueError for other shapes.
    """

    displacement_mm: Array
    gradient: Array

    def __post_init__(self) -> None:
        count = len(np.asarray(self.displacement_mm))
        for name, shape in (("displacement_mm", (count, 3)), ("gradient", (count, 3, 2))):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"marker {name} {value.shape}: must be finite, {shape}")
            object.__setattr__(self, name, value)

    @cached_property
    def moves(self) -> bool:
        """Whether anything is displaced at all."""
        return bool(np.any(self.displacement_mm) or np.any(self.gradient))

    def carried(self, centres_mm: Array, rims_mm: Array) -> Array:
        """Displacement (m, k, 3) of points (m, k, 2) on the rims of dots at centres (m, 2)."""
        if len(centres_mm) != len(self.displacement_mm):
            raise ValueError(
                f"motion of {len(self.displacement_mm)} markers for {len(centres_mm)} dots"
            )
        away = rims_mm - centres_mm[:, None, :]
        strained = np.einsum("mij,mkj->mki", self.gradient, away)
        moved: Array = self.displacement_mm[:, None, :] + strained
        return moved
