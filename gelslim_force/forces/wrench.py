"""Resultant of the surface forces about the sensor origin, with its noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Wrench:
    """Force and torque on the gel about the sensor origin, in the sensor frame."""

    force_n: Array
    """(3,); z is NaN where the normal motion is unknown."""
    torque_nmm: Array
    """(3,); x and y are NaN where the normal motion is unknown."""
    covariance: Array
    """(6, 6) of (force, torque) in N and N mm from marker noise; NaN where unknown."""

    @property
    def vector(self) -> Array:
        """(6,) force, then torque."""
        return np.concatenate([self.force_n, self.torque_nmm])

    @property
    def standard_deviation(self) -> Array:
        """(6,) in N and N mm."""
        return np.sqrt(np.diag(self.covariance))


def resultant(points_mm: ArrayLike, force_n: ArrayLike) -> tuple[Array, Array]:
    """Sum of forces (c, 3) and their torque about the origin, acting at points (c, 3)."""
    points, force = np.asarray(points_mm, dtype=float), np.asarray(force_n, dtype=float)
    return force.sum(axis=0), np.cross(points, force).sum(axis=0)
