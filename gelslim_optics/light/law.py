"""How an emitter's intensity falls off with the angle from its axis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TABLE_STEPS = 8192


@dataclass(frozen=True)
class Lambertian:
    """Intensity ∝ cos θ: a bare LED die behind a flat window."""

    def cosine(self, u: Array) -> Array:
        """cos θ of the ray that leaves the share u of the flux nearer to the axis."""
        return np.sqrt(1 - u)


@dataclass(frozen=True)
class Dome:
    """Intensity ∝ cosᵐ θ within `half_angle_deg`, none beyond: a lensed LED."""

    half_angle_deg: float = 60.0
    exponent: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < self.half_angle_deg <= 90:
            raise ValueError(f"half_angle_deg = {self.half_angle_deg!r}: must be in (0, 90]")
        if not (math.isfinite(self.exponent) and self.exponent >= 0):
            raise ValueError(f"exponent = {self.exponent!r}: must be >= 0")

    def cosine(self, u: Array) -> Array:
        """cos θ of the ray that leaves the share u of the flux nearer to the axis."""
        power = self.exponent + 1
        last = math.cos(math.radians(self.half_angle_deg)) ** power
        return (1 - u * (1 - last)) ** (1 / power)


@dataclass(frozen=True)
class MeasuredLaw:
    """Relative intensity per solid angle at rising angles, linear between them, none beyond."""

    angle_deg: tuple[float, ...]
    intensity: tuple[float, ...]

    def __post_init__(self) -> None:
        angles, values = np.asarray(self.angle_deg), np.asarray(self.intensity)
        if angles.size < 2 or angles.size != values.size:
            raise ValueError("a measured law needs two or more angles and as many intensities")
        if not (angles[0] == 0 and angles[-1] <= 90 and np.all(np.diff(angles) > 0)):
            raise ValueError("angle_deg must start at 0, rise, and end at 90 or below")
        if not (np.all(np.isfinite(values)) and np.all(values >= 0) and np.any(values > 0)):
            raise ValueError("intensity must be finite, >= 0 and not all zero")

    def cosine(self, u: Array) -> Array:
        """cos θ of the ray that leaves the share u of the flux nearer to the axis."""
        cosines, shares = _cumulative(self)
        return np.interp(u, shares, cosines)


@lru_cache(maxsize=32)
def _cumulative(law: MeasuredLaw) -> tuple[Array, Array]:
    """cos θ on a fine grid from the axis outwards, and the share of flux nearer to the axis."""
    theta = np.linspace(0.0, math.radians(law.angle_deg[-1]), TABLE_STEPS)
    density = np.interp(theta, np.radians(law.angle_deg), law.intensity)
    cosines = np.cos(theta)
    steps = (density[1:] + density[:-1]) / 2 * -np.diff(cosines)
    shares = np.concatenate(([0.0], np.cumsum(steps)))
    return cosines, shares / shares[-1]


AngularLaw = Lambertian | Dome | MeasuredLaw
