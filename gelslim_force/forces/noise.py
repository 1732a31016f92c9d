"""What noise of the motion makes of the forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.tracking.marker_noise import quiet_sigma
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
_DRAWS, _SEED = 16, 20190521


@dataclass(frozen=True)
class MotionNoise:
    """Standard deviations of white noise in one frame."""

    marker_px: float = 0.0
    """Of one coordinate of a marker's place."""
    normal_mm: float = 0.0
    """Of the normal motion of a node, from neighbour to neighbour."""

    @property
    def variances(self) -> Array:
        """(2,) in px^2 and mm^2, the order of `ForceNoise.draws`."""
        return np.array([self.marker_px**2, self.normal_mm**2])


@dataclass(frozen=True, eq=False)
class ForceNoise:
    """Forces that motions of unit noise make, drawn from a fixed seed."""

    draws: Array
    """(2, d, c, 3): N per px of marker noise, N per mm of noise of the normal motion."""

    @classmethod
    def of(cls, operator: SurfaceOperator, motion: SurfaceMotion) -> ForceNoise:
        """Of one sensor's linear operator and the markers it follows."""
        rng = np.random.default_rng(_SEED)
        draws = np.empty((2, _DRAWS, len(motion.points_mm), 3))
        for k in range(_DRAWS):
            moved = motion.of_noise(rng.normal(size=(len(motion.view), 2)))
            draws[0, k] = operator.force(moved)
        for k in range(_DRAWS):
            moved = np.zeros_like(motion.points_mm)
            moved[:, 2] = rng.normal(size=len(moved))
            draws[1, k] = operator.force(moved)
        return cls(draws)

    @classmethod
    def none(cls, count: int) -> ForceNoise:
        """Of `count` nodes whose motion has no noise."""
        return cls(np.zeros((2, 1, count, 3)))


def normal_noise_mm(curvature: sparse.csr_array, w_mm: Array) -> float:
    """Standard deviation of one node's normal motion (c,), for `surface_lattice.curvature`.

    The lower quartile does not see the nodes that curve around a contact.
    """
    return quiet_sigma(curvature @ w_mm) / np.sqrt(1.25)
